"""Static stability: where the centre of mass stands over the support polygon."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.motion.motion import Segment
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


def support_margin(feet: Array, point: Array) -> Array:
    """Distance of a point from the nearest edge of the feet's convex hull, seen from above.

    Args:
        feet: Foot points [m], shape (N, F, 3), the same order around the hull at every sample not
            being required.
        point: Projected point [m], shape (N, 2).

    Returns:
        Margin [m], shape (N,); negative outside the hull.
    """
    xy = feet[..., :2]
    n_feet = xy.shape[1]
    margin = np.full(xy.shape[0], np.inf)
    for i in range(n_feet):
        for j in range(n_feet):
            if i == j:
                continue
            edge = xy[:, j] - xy[:, i]
            length = np.hypot(edge[:, 0], edge[:, 1])

            def left_of(p: Array, i: int = i, edge: Array = edge, length: Array = length) -> Array:
                d = p - xy[:, i]
                return (edge[:, 0] * d[:, 1] - edge[:, 1] * d[:, 0]) / length

            others = np.stack([left_of(xy[:, k]) for k in range(n_feet)], axis=1)
            on_hull = (others >= -1e-12).all(axis=1)  # an edge that has all feet to its left
            margin = np.where(on_hull, np.minimum(margin, left_of(point)), margin)
    return margin
