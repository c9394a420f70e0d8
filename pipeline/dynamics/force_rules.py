"""Rules by which the ground's forces are chosen among those that carry the robot, and who tips.

The paper's rule is the least sum of squared tangential forces (`contact_forces`). What its closed
form does not give (feet that would slide, least joint torques) is one quadratic programme in the
forces of one sample: the wrench on the robot stays, no foot pulls, none leaves its friction cone.
It goes to quadprog (the dual method of Goldfarb and Idnani) through qpsolvers, row by row.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
import pinocchio as pin

from actuators.arrays import Array, Mask
from actuators.errors import StanceError
from pipeline.motion.gait import gait_of
from pipeline.motion.motion import Segment
from pipeline.motion.support import burdens, stability_margins
from pipeline.robot.robot import Robot

LEAST_TANGENTIAL, LEAST_TORQUE = "least_tangential", "least_torque"
#: Share of the largest force below which a violated bound is rounding.
_TOLERANCE: Final = 1e-10
#: The same for a friction cone, where so much is left of a light foot's coefficient.
_CONE_TOLERANCE: Final = 1e-13
#: Weight of normal beside tangential forces: what the least tangential forces leave open.
_NORMAL_WEIGHT: Final = 1e-8
#: Weight of the distance from the least tangential forces beside the torques: it decides between
#: forces that take the same.
_TIE: Final = 1e-9
_ROUNDS: Final = 60  # of tangent planes; a handful is usual
_ENOUGH: Final = 6  # rounds after which `_TOLERANCE` will do
#: Share of the largest force: a foot that is exactly unloaded (a tripod at the edge of its
#: stability) still stands, and one on its cone's surface still holds.
_ROUNDING: Final = 1e-9


@dataclass(frozen=True)
class GroundForces:
    """How the ground's forces are chosen."""

    rule: str = LEAST_TANGENTIAL  #: Or `LEAST_TORQUE`.
    #: Greatest tangential over normal force [1]; None for no limit.
    friction_coefficient: float | None = None


PAPER: Final = GroundForces()


def out_of_bounds(force: Array, friction_coefficient: float | None) -> Mask:
    """Samples at which a foot pulls or leaves its friction cone, shape (N,), beyond rounding.

    `force`: z along the ground's normal [N], shape (N, F, 3). `friction_coefficient`: None for no
    limit.
    """
    slack = _TOLERANCE * np.abs(force).max(axis=(1, 2), keepdims=True)[..., 0]
    outside = force[..., 2] < -slack
    if friction_coefficient is not None:
        tangential = np.hypot(force[..., 0], force[..., 1])
        outside |= tangential > friction_coefficient * force[..., 2] + slack
    return np.asarray(outside.any(axis=1))


def least_within_bounds(
    start: Array,
    feet: Array,
    friction_coefficient: float | None,
    metric: Array | None = None,
    gradient: Array | float = 0.0,
) -> Array | None:
    """Forces f of one sample that minimise f' metric f / 2 + gradient' f; None where none will do.

    They have the wrench of `start`, no foot pulls, and each holds within its friction cone: planes
    tangent to a cone at a force that was found outside it are added until every force is inside, so
    that what comes out is the minimum over the cone itself, and a sample for which there is none
    over the planes has none over the cone.

    `start`: forces that meet the wrench [N], shape (F, 3). `feet`: points [m], shape (F, 3).
    `friction_coefficient`: greatest tangential over normal force [1]; None for no limit. `metric`:
    positive definite, shape (3 F, 3 F), that of least tangential forces by default. `gradient`:
    shape (3 F,). Returns force [N], shape (F, 3).
    """
    import qpsolvers  # a tenth of a second, for motions that need it

    if metric is None:
        metric = np.diag(np.tile([1.0, 1.0, _NORMAL_WEIGHT], len(feet)))
    count, size, unit = len(feet), float(np.abs(start).max()), float(np.trace(metric)) / start.size
    linear = np.full(start.size, gradient) / (unit * size)
    arm = feet - feet.mean(axis=0)
    arm = arm / np.abs(arm).max()  # newtons beside newton-metres: only the wrench's rows count
    wrench = np.vstack([np.tile(np.eye(3), count), np.hstack([pin.skew(p) for p in arm])])
    _, scale, same = np.linalg.svd(wrench, full_matrices=False)
    same = same[scale > 1e-9 * scale[0]]  # orthonormal; two feet have no moment along their line
    asked = same @ start.ravel() / size
    rows, limits = -np.eye(3 * count)[2::3], np.full(count, _TOLERANCE / 2)
    for done in range(_ROUNDS):
        found = qpsolvers.solve_qp(
            metric / unit, linear, rows, limits, same, asked, solver="quadprog"
        )
        if found is None:
            return None
        force = (found - same.T @ (same @ found - asked)).reshape(count, 3)
        mu = np.inf if friction_coefficient is None else friction_coefficient
        tangential = np.hypot(force[:, 0], force[:, 1])
        slack = _CONE_TOLERANCE if done < _ENOUGH else _TOLERANCE
        out = np.flatnonzero(tangential > mu * np.maximum(force[:, 2], _TOLERANCE) + slack)
        if not out.size:
            unloaded = np.abs(force[:, 2]) < 2 * _TOLERANCE  # and so holds nothing
            force[unloaded, 2] = 0.0
            force[unloaded & (np.abs(force[:, :2]).max(axis=1) < 1e2 * _TOLERANCE)] = 0.0
            return np.asarray(force * size)
        planes = np.zeros((out.size, count, 3))
        planes[np.arange(out.size), out, :2] = force[out, :2] / tangential[out, None]
        planes[np.arange(out.size), out, 2] = -mu
        rows = np.vstack([rows, planes.reshape(out.size, -1)])
        limits = np.append(limits, np.full(out.size, _CONE_TOLERANCE / 2))
    return None


def least_torque_forces(
    start: Array, feet: Array, torque: Array, unit_torque: Array, friction_coefficient: float | None
) -> Array:
    """Forces on the feet for the least sum of squared torques of the Q joints that they load.

    In a frame whose z axis is the ground's normal. `start`: forces that carry the robot, which
    those found are nearest to where torques are the same; samples that break a bound keep theirs
    [N], shape (N, F, 3). `feet`: points [m], shape (N, F, 3). `torque`: what the joints must apply
    without the ground [N*m], shape (N, Q). `unit_torque`: what 1 N along each axis of each foot
    puts into a joint, shape (N, Q, 3 F). Returns forces within the bounds [N], shape (N, F, 3).
    """
    force = np.array(start)
    for row in np.flatnonzero(~out_of_bounds(start, friction_coefficient)):
        metric = unit_torque[row].T @ unit_torque[row]
        tie = _TIE * max(np.trace(metric) / len(metric), np.finfo(float).tiny)
        gradient = -unit_torque[row].T @ torque[row] - tie * start[row].ravel()
        metric += tie * np.eye(len(metric))
        found = least_within_bounds(start[row], feet[row], friction_coefficient, metric, gradient)
        if found is not None:
            force[row] = found
    return force


def refuse_falling(
    robot: Robot, segment: Segment, force: Array, friction_coefficient: float | None
) -> None:
    """Refuse forces that break a bound, as they do only where no forces are within them.

    `force`: on the standing feet, z along the ground's normal [N], shape (N, F, 3).
    `friction_coefficient`: None for no limit.

    Raises:
        StanceError: A foot would have to pull, or the feet would slide; names instant and foot.
    """
    normal = force[..., 2]
    lowest = float(normal.min())  # NaN where any force is
    if not np.isfinite(lowest):
        words = f"the robot tips: in '{segment.name}' the feet stand in one line"
        raise StanceError(f"{words}; stand on feet of both sides")
    slack = _ROUNDING * max(1.0, float(np.abs(normal).max()))
    if lowest < -slack:
        sample, foot = np.argwhere(normal <= lowest + slack)[0]  # the first of those alike
        margin = float(stability_margins(robot, segment)[sample])
        words = f"would have to pull with {-lowest:.1f} N, static margin {1e3 * margin:.1f} mm"
        if segment.foot_target is None:
            words += "; check which feet stand, or shift the body towards them"
        else:
            words += f"; {burdens(robot)}spread the feet, shorten the stroke, walk slower"
            sways = segment.time.size == 1 or gait_of(robot.spec).margin is not None
            words += "" if sways else ', let the body sway (gait.sway = "least")'
        raise StanceError(
            f"the robot tips at t = {segment.time[sample]:.4g} s ({segment.name}): the foot of leg "
            f"'{segment.stance[foot]}' {words}"
        )
    if friction_coefficient is None:
        return
    beyond = np.hypot(force[..., 0], force[..., 1]) - friction_coefficient * normal
    if beyond.max() > slack:
        sample, foot = np.unravel_index(int(beyond.argmax()), beyond.shape)
        raise StanceError(
            f"the robot slides at t = {segment.time[sample]:.4g} s ({segment.name}), the foot of "
            f"leg '{segment.stance[foot]}' first: no forces hold with a friction coefficient of "
            f"{friction_coefficient:g}; lessen slope or acceleration"
        )
