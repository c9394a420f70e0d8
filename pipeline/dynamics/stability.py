"""Static stability: where the centre of mass stands over the support polygon."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.motion.motion import Segment
from pipeline.motion.support import support_margin
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.robot import Robot

Array = NDArray[np.float64]


def stability_margins(robot: Robot, segment: Segment) -> Array:
    """Margin of static stability along a segment.

    Args:
        robot: A robot with a floating base.
        segment: The motion.

    Returns:
        Distance of the centre of mass's vertical projection from the nearest edge of the support
        polygon [m], shape (N,); negative outside.
    """
    q = segment.configuration
    stance = [robot.leg_names.index(leg) for leg in segment.stance]
    feet = foot_positions(robot.chains, robot.leg_positions(q))[:, stance]
    rotation = robot.base_rotation(q)
    if rotation is not None:
        feet = np.einsum("nij,nfj->nfi", rotation, feet)
    data = robot.model.createData()
    centre = np.array([pin.centerOfMass(robot.model, data, row) for row in q]) - q[:, :3]
    return support_margin(feet, centre[:, :2])
