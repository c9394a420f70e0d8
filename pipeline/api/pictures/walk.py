"""A walked cycle as pictures take it: its stretches, and steps of equal time."""

from __future__ import annotations

import numpy as np

from pipeline.api.pictures.scene import Scene, mass_centre
from pipeline.robot.robot import Robot
from pipeline.simulation.walk_stand import Walking
from reports.figures.walk import Steps, Stretch

#: Steps of a cycle that the moving picture shows.
STEPS = 24
#: Samples of a cycle that a picture can show, and the least of one segment.
_MOST, _LEAST = 200, 21


def stretches(robot: Robot, walking: Walking) -> list[Stretch]:
    """What figures show of every segment."""
    out = []
    for segment, demand, contacts, margin in zip(
        walking.motion.segments,
        walking.demand.segments,
        walking.demand.contacts,
        walking.margins,
        strict=True,
    ):
        assert contacts is not None
        centre = mass_centre(robot, segment.configuration) - segment.configuration[:, :3]
        rotation = robot.base_rotation(segment.configuration)
        if rotation is not None:
            centre = np.einsum("nji,nj->ni", rotation, centre)  # world -> base
        stands = [leg in contacts.stance for leg in robot.leg_names]
        out.append(
            Stretch(
                time=segment.time,
                stance=segment.stance,
                velocity=demand.velocity,
                torque=demand.torque,
                feet=contacts.position,
                normal=np.where(stands, contacts.force_world @ segment.ground_normal, 0.0),
                friction=contacts.friction_needed,
                mass_centre=centre,
                margin=margin,
            )
        )
    return out


def thinned(parts: list[Stretch]) -> list[Stretch]:
    """No more samples than a picture can show, the ends and the middle among them."""
    count = max(_LEAST, 1 + 2 * (_MOST // (2 * len(parts))))
    return [
        part.every(np.unique(np.linspace(0, part.time.size - 1, count).round()).astype(np.intp))
        for part in parts
    ]


def steps_of(scene: Scene, walking: Walking, count: int = STEPS) -> Steps:
    """One cycle in steps of equal time.

    Args:
        scene: Of the robot that walks.
        walking: The cycle.
        count: How many steps.
    """
    robot, motion, demand = scene.robot, walking.motion, walking.demand
    rows = rows_of_steps(walking, count)
    q = np.array([motion.segments[i].configuration[k] for i, k in rows])
    contacts = [demand.contacts[i] for i, _ in rows]
    legs = robot.leg_names
    origin = q[:, :3] - [0.0, 0.0, q[0, 2]]
    posed = [scene.legs(row) for row in q]
    feet = np.array([[leg.foot for leg in pose] for pose in posed])
    places = np.array([[j.position for leg in pose for j in leg.joints] for pose in posed])
    joints = tuple(joint for leg in robot.spec.legs for joint in leg.joints)
    columns = [robot.joints.index(joint) for joint in joints]
    period = motion.period or _duration(walking)
    return Steps(
        legs=legs,
        joints=joints,
        units=tuple("N" if robot.sliding[column] else "N·m" for column in columns),
        time=period * np.arange(count) / count,
        period=period,
        bodies=tuple(scene.bodies(q, origin)),
        feet=feet - origin[:, None],
        stands=np.array([[leg in c.stance for leg in legs] for c in contacts if c]),
        force=np.array([c.force_world[k] for c, (_, k) in zip(contacts, rows, strict=True) if c]),
        places=places - origin[:, None],
        torque=np.array([demand.segments[i].torque[k, columns] for i, k in rows]),
        mass_centre=mass_centre(robot, q) - origin,
        margin=np.array([walking.margins[i][k] for i, k in rows]),
        origin=origin,
        ground=motion.segments[0].ground_normal,
    )


def rows_of_steps(walking: Walking, count: int) -> list[tuple[int, int]]:
    """Segment and sample of steps of equal time; where two segments meet, the later one."""
    segments = walking.motion.segments
    times = segments[0].time[0] + _duration(walking) * np.arange(count) / count
    which = [max(i for i, s in enumerate(segments) if s.time[0] <= t + 1e-9) for t in times]
    return [
        (i, int(np.abs(segments[i].time - t).argmin())) for i, t in zip(which, times, strict=True)
    ]


def _duration(walking: Walking) -> float:
    segments = walking.motion.segments
    return float(segments[-1].time[-1] - segments[0].time[0])
