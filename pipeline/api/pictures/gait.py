"""The gait in pictures: its stretches, and one cycle in steps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.api.pictures.scene import Scenery, mass_centre
from pipeline.motion.motion import Segment
from pipeline.robot.robot import Robot
from pipeline.simulation.walk_stand import Walking
from reports.figures.energy.all_legs import LegsStretch
from reports.figures.robot.gait_steps import Body, Steps
from reports.figures.robot.gait_view import GaitStretch
from reports.figures.robot.outline import hull_points
from reports.figures.robot.solids import Leg
from reports.figures.robot.sticks import bare_legs, leg_sticks, trunk_centre

Array = NDArray[np.float64]
#: Steps of a cycle that the moving picture shows.
STEPS = 24
#: Samples of a cycle that a picture can show, and the least of one segment.
_MOST, _LEAST = 200, 21
#: Corners of a body nearer than this share of the robot's size are drawn as one.
_CELL = 0.012


def gait_stretches(robot: Robot, walking: Walking) -> list[GaitStretch]:
    """What the gait's figure shows of every segment."""
    out = []
    for segment, contacts, margin in zip(
        walking.motion.segments, walking.demand.contacts, walking.margins, strict=True
    ):
        assert contacts is not None
        rows = _shown(segment, walking)
        configuration = segment.configuration[rows]
        centre = mass_centre(robot, configuration) - configuration[:, :3]
        rotation = robot.base_rotation(configuration)
        if rotation is not None:
            centre = np.einsum("nji,nj->ni", rotation, centre)  # world -> base
        out.append(
            GaitStretch(
                segment.time[rows],
                contacts.position[rows],
                segment.stance,
                centre,
                margin[rows],
            )
        )
    return out


def _shown(segment: Segment, walking: Walking) -> NDArray[np.intp]:
    """Samples of a segment for a picture: no more than it can show, the ends and the middle too."""
    count = max(_LEAST, 1 + 2 * (_MOST // (2 * len(walking.motion.segments))))
    rows: NDArray[np.intp] = np.unique(np.linspace(0, segment.time.size - 1, count).round())
    return rows.astype(np.intp)


def gait_steps_of(scenery: Scenery, walking: Walking, count: int = STEPS) -> Steps:
    """One cycle in steps of equal time.

    Args:
        scenery: Of the robot that walks.
        walking: The cycle.
        count: How many steps.
    """
    robot, motion = scenery.robot, walking.motion
    found, q = rows_of_steps(walking, count)
    contacts = [walking.demand.contacts[i] for i, _ in found]
    legs, period = robot.leg_names, motion.period or _duration(walking)
    force = np.array([c.force_world[k] for c, (_, k) in zip(contacts, found, strict=True) if c])
    stands = np.array([[leg in c.stance for leg in legs] for c in contacts if c])
    follow = q[:, :3] - [0.0, 0.0, q[0, 2]]
    posed = [scenery.legs_at(scenery.placements(row)) for row in q]
    feet = np.array([[leg.foot for leg in pose] for pose in posed])
    joints = np.array([[j.position for leg in pose for j in leg.joints] for pose in posed])
    columns = [robot.joints.index(j) for leg in robot.spec.legs for j in leg.joints]
    torque = np.array([walking.demand.segments[i].torque[k, columns] for i, k in found])
    return Steps(
        legs=legs,
        time=period * np.arange(count) / count,
        period=period,
        bodies=(*_bodies(scenery, q, follow), *_stick_bodies(scenery, q[0], posed, follow)),
        feet=feet - follow[:, None],
        stands=stands,
        force=force,
        joints=joints - follow[:, None],
        torque=torque,
        mass_centre=mass_centre(robot, q) - follow,
        margin=np.array([walking.margins[i][k] for i, k in found]),
        origin=follow,
    )


def rows_of_steps(walking: Walking, count: int) -> tuple[list[tuple[int, int]], Array]:
    """Where steps of equal time lie in a cycle.

    Returns:
        Segment and sample of each step, and configurations, shape (count, nq).
    """
    segments = walking.motion.segments
    start = float(segments[0].time[0])
    found = [_row(walking, start + _duration(walking) * k / count) for k in range(count)]
    return found, np.array([segments[i].configuration[k] for i, k in found])


def _duration(walking: Walking) -> float:
    segments = walking.motion.segments
    return float(segments[-1].time[-1] - segments[0].time[0])


def _row(walking: Walking, time: float) -> tuple[int, int]:
    """Segment and sample at an instant; where two meet, the later one."""
    segments = walking.motion.segments
    which = max(i for i, s in enumerate(segments) if s.time[0] <= time + 1e-9)
    return which, int(np.abs(segments[which].time - time).argmin())


def _bodies(scenery: Scenery, q: Array, follow: Array) -> list[Body]:
    """Hulls of the moving bodies, carried through the steps."""
    model = scenery.robot.model
    data = model.createData()
    pin.forwardKinematics(model, data, q[0])
    at_first = [placement.copy() for placement in data.oMi]
    placed = scenery.placements(q[0])
    by_body: dict[tuple[int, bool], list[Array]] = {}
    for solid in scenery.shapes.at(placed):
        by_body.setdefault((scenery.carrier[solid.link], False), []).append(solid.points)
    if scenery.load is not None:
        ball = scenery.load.at(placed[scenery.load.link])
        by_body[scenery.carrier[ball.link], True] = [ball.points]
    joined = {body: np.concatenate(points) for body, points in by_body.items()}
    if not joined:
        return []
    size = float(np.ptp(np.concatenate(list(joined.values())), axis=0).max())
    corners = {body: hull_points(points, _CELL * size) for body, points in joined.items()}
    moved: dict[tuple[int, bool], list[Array]] = {key: [] for key in corners}
    for row in q:
        pin.forwardKinematics(model, data, row)
        for (body, load), points in corners.items():
            motion = (data.oMi[body] * at_first[body].inverse()).homogeneous
            moved[body, load].append(points @ motion[:3, :3].T + motion[:3, 3])
    return [
        Body(scenery.leg_of_body.get(body, ""), np.array(points) - follow[:, None], load)
        for (body, load), points in moved.items()
    ]


def _stick_bodies(
    scenery: Scenery, first: Array, posed: Sequence[Sequence[Leg]], follow: Array
) -> list[Body]:
    """Sticks for the legs of which the URDF shows nothing."""
    bare = set(bare_legs(scenery.at(first)[0], posed[0]))
    out = []
    for i, leg in enumerate(posed[0]):
        if leg.name in bare:
            steps = [leg_sticks(pose[i], trunk_centre(pose)) for pose in posed]
            for parts in zip(*steps, strict=True):
                points = np.array([part.points for _, part in parts])
                out.append(Body(leg.name, points - follow[:, None]))
    return out


def legs_stretches(robot: Robot, walking: Walking) -> list[LegsStretch]:
    """What the figures of all legs show of every segment."""
    out = []
    for segment, demand, contacts, margin in zip(
        walking.motion.segments,
        walking.demand.segments,
        walking.demand.contacts,
        walking.margins,
        strict=True,
    ):
        assert contacts is not None
        rows = _shown(segment, walking)
        stands = [leg in contacts.stance for leg in robot.leg_names]
        out.append(
            LegsStretch(
                segment.time[rows],
                segment.stance,
                demand.torque[rows],
                np.where(stands, contacts.force_world[rows] @ segment.ground_normal, 0.0),
                contacts.friction_needed[rows],
                margin[rows],
            )
        )
    return out
