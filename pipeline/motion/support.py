"""The support polygon: hull of the standing feet seen from above, and a point's margin in it.

`standing_posture` stands still on any set of feet, on any ground, as ``[gait]`` states.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.errors import GaitError
from pipeline.motion.feet import base_quaternions
from pipeline.motion.footfall import LEAST_FEET
from pipeline.motion.gait import body_rotation, gait_table, lifts, neutral_feet
from pipeline.motion.motion import Ground, Segment
from pipeline.robot.inverse.inverse_kinematics import (
    refuse_beyond_limits,
    solve_positions,
    start_postures,
)
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.robot import Robot

_ON_EDGE = 1e-12  # [m]


@dataclass(frozen=True)
class SupportEdges:
    """Lines between any two feet, seen from above, and which of them bound the hull."""

    start: Array  #: A point of each line [m], shape (N, E, 2).
    edge: Array  #: Along it, to the other foot [m], shape (N, E, 2).
    length: Array  #: Of that [m], shape (N, E).
    #: Whether all feet lie on it or to its left, so that it bounds the hull, shape (N, E).
    used: NDArray[np.bool_]

    @property
    def inward(self) -> Array:
        """Unit vectors to the left of the lines, shape (N, E, 2)."""
        left = np.stack([-self.edge[..., 1], self.edge[..., 0]], axis=-1)
        return np.asarray(left / self.length[..., None])

    def distance(self, point: Array) -> Array:
        """How far points, shape (N, 2), lie to the left of every line [m], shape (N, E)."""
        return _left_of(self.start, self.edge, self.length, point[:, None])


def _left_of(start: Array, edge: Array, length: Array, point: Array) -> Array:
    d = point - start
    return np.asarray((edge[..., 0] * d[..., 1] - edge[..., 1] * d[..., 0]) / length)


def support_edges(feet: Array) -> SupportEdges:
    """The lines between any two feet.

    `feet`: foot points [m], shape (N, F, 2 or more), in any order around the hull.
    """
    xy = feet[..., :2]
    n_feet = xy.shape[1]
    pairs = np.array([(i, j) for i in range(n_feet) for j in range(n_feet) if i != j])
    start = xy[:, pairs[:, 0]]
    edge = xy[:, pairs[:, 1]] - start
    length = np.hypot(edge[..., 0], edge[..., 1])
    used = np.ones(length.shape, dtype=np.bool_)
    for k in range(n_feet):
        used &= _left_of(start, edge, length, xy[:, k, None]) >= -_ON_EDGE
    return SupportEdges(start, edge, length, used)


def stance_and_centre(robot: Robot, segment: Segment) -> tuple[Array, Array]:
    """Standing feet (N, F, 3) and centre of mass (N, 3) from the base, world's directions [m]."""
    q = segment.configuration
    stance = [robot.leg_names.index(leg) for leg in segment.stance]
    feet = foot_positions(robot.chains, robot.leg_positions(q))[:, stance]
    rotation = robot.base_rotation(q)
    if rotation is not None:
        feet = np.einsum("nij,nfj->nfi", rotation, feet)
    data = robot.model.createData()
    return feet, np.array([pin.centerOfMass(robot.model, data, row) for row in q]) - q[:, :3]


def support_margin(feet: Array, point: Array) -> Array:
    """Distance of a point from the nearest edge of the feet's convex hull, seen from above.

    `feet`: foot points [m], shape (N, F, 3), the same order around the hull at every sample not
    being required. `point`: projected point [m], shape (N, 2). Returns margin [m], shape (N,);
    negative outside the hull.
    """
    edges = support_edges(feet)
    margin: Array = np.where(edges.used, edges.distance(point), np.inf).min(axis=1)
    return margin


def stability_margins(robot: Robot, segment: Segment) -> Array:
    """Margin of static stability of a robot with a floating base along a segment.

    The distance of the centre of mass's vertical projection from the nearest edge of the support
    polygon [m], shape (N,); negative outside.
    """
    feet, centre = stance_and_centre(robot, segment)
    return support_margin(feet, centre[:, :2])


def standing_posture(robot: Robot, feet: tuple[str, ...] | None = None) -> Segment:
    """Standing still with every foot at mid-stroke; legs that do not stand are lifted.

    The lifted ones hold the middle of their transfer, as if the gait had stopped at mid-support
    (section II.C of the paper). Height, shift and tilt of the body and the slope of the ground are
    those of ``[gait]``.

    `feet`: legs that stand; the robot file's by default.

    Raises:
        OutOfReachError: A foot target lies outside a leg's reach.
        GaitError: Fewer than three feet stand, or a joint's limits forbid it.
    """
    spec = robot.spec
    stance = spec.standing_feet if feet is None else feet
    if len(stance) < LEAST_FEET:
        raise GaitError(
            f"{spec.path}: standing.feet: the robot stands on {len(stance)} feet; a statically "
            f"stable stance needs at least {LEAST_FEET}"
        )
    table = gait_table(spec)
    ground, body = Ground(table.slope_forward, table.slope_left), body_rotation(table)
    target = neutral_feet(table, spec)
    start = start_postures(robot, target @ body)
    lifted = [i for i, leg in enumerate(robot.leg_names) if leg not in stance]
    if lifted:
        target[lifted, 2] += lifts(table, spec)[lifted]
    time = np.zeros(1)
    in_base = (target @ body)[None]
    q = solve_positions(robot.chains, in_base, start, time)
    refuse_beyond_limits(robot, robot.joint_positions(q), time)
    still = robot.tangent(np.zeros((1, len(robot.joints))))
    base = np.hstack([np.zeros((1, 3)), base_quaternions(ground, body, time)])
    return Segment(
        name="standing on " + ", ".join(stance),
        time=time,
        configuration=robot.configuration(robot.joint_positions(q), base),
        velocity=still,
        acceleration=still,
        stance=stance,
        ground_normal=ground.normal,
        foot_target=in_base,
    )
