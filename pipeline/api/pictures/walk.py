"""A walked cycle as pictures take it: its stretches."""

from __future__ import annotations

import numpy as np

from pipeline.api.pictures.scene import mass_centre
from pipeline.robot.robot import Robot
from pipeline.simulation.walk_stand import Walking
from reports.figures.walk import Stretch

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
