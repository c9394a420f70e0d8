"""A walked cycle as pictures take it: its stretches."""

from __future__ import annotations

import numpy as np

from pipeline.api.pictures.scene import mass_centre
from pipeline.robot.robot import Robot
from pipeline.simulation.walk_stand import Walking
from reports.figures.walk import Stretch


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
