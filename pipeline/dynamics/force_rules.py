"""Rules by which the ground's forces are chosen among those that carry the robot.

The paper's rule is the least sum of squared tangential forces (`contact_forces`). The other starts
from its forces and adds internal forces to them, which change joint torques and leave the robot's
motion as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import closest
from pipeline.errors import GaitError

#: Weight of normal beside tangential forces: what the least tangential forces leave open.
NORMAL_WEIGHT = 1e-8
#: Share of the largest force below which a violated bound is rounding.
TOLERANCE = 1e-10
#: The same for a friction cone, where so much is left of a light foot's coefficient.
_CONE_TOLERANCE = 1e-13
_ROUNDS = 60  # of tangent planes; a handful is usual
_ENOUGH = 6  # rounds after which `TOLERANCE` will do
_HALVINGS = 40
_MOST_FRICTION = 1e3  # beyond this no coefficient is looked for


def internal_basis(feet: Array) -> Array:
    """Orthonormal basis of the forces that add up to no force and no moment.

    `feet`: foot points [m], shape (N, F, 3), F >= 3, not in one line; or two. Returns shape (N, F,
    3, D) with D = 3 F - 6; for two feet 1, a squeeze along their line.
    """
    n, count, _ = feet.shape
    if count == 2:
        along = feet[:, 1] - feet[:, 0]
        along /= np.sqrt(2.0) * np.linalg.norm(along, axis=1)[:, None]
        return np.stack([along, -along], axis=1)[..., None]
    arm = feet - feet.mean(axis=1, keepdims=True)
    arm = arm / np.abs(arm).max()  # newtons beside newton-metres: only the null space counts
    balance = np.zeros((n, count, 3, 6))
    balance[..., :3] = np.eye(3)
    for axis in range(3):
        after, last = (axis + 1) % 3, (axis + 2) % 3
        balance[:, :, last, 3 + axis] = arm[..., after]
        balance[:, :, after, 3 + axis] = -arm[..., last]
    q, _ = np.linalg.qr(balance.reshape(n, 3 * count, 6), mode="complete")
    return np.asarray(q[..., 6:]).reshape(n, count, 3, -1)


def out_of_bounds(force: Array, friction_coefficient: float | None) -> NDArray[np.bool_]:
    """Samples at which a foot pulls or leaves its friction cone, shape (N,), beyond rounding.

    `force`: z along the ground's normal [N], shape (N, F, 3). `friction_coefficient`: None for no
    limit.
    """
    slack = TOLERANCE * np.abs(force).max(axis=(1, 2), keepdims=True)[..., 0]
    normal = force[..., 2]
    outside = normal < -slack
    if friction_coefficient is not None:
        tangential = np.hypot(force[..., 0], force[..., 1])
        outside = outside | (tangential > friction_coefficient * normal + slack)
    return np.asarray(outside.any(axis=1))


def least_within_bounds(
    metric: Array, gradient: Array, start: Array, basis: Array, friction_coefficient: float | None
) -> Array | None:
    """Forces of one sample that minimise z' metric z / 2 + gradient' z; None where none will do.

    No foot pulls, and each holds within its friction cone: planes tangent to a cone at a force that
    was found outside it are added until every force is inside, so that what comes out is the
    minimum over the cone itself, and a sample for which there is none over the planes has none over
    the cone.

    `metric`: positive definite, shape (D, D). `gradient`: at z = 0, shape (D,). `start`: force at
    z = 0 [N], shape (F, 3). `basis`: of the internal forces, shape (F, 3, D).
    `friction_coefficient`: greatest tangential over normal force [1]; None for no limit. Returns
    force [N], shape (F, 3).
    """
    import qpsolvers  # a tenth of a second, for motions that need it

    size = float(np.abs(start).max())
    unit = float(np.trace(metric)) / metric.shape[0]
    metric, gradient, at_zero = metric / unit, gradient / (unit * size), start / size
    # Rows of  G z <= h: that no foot pulls, then tangent planes; with what rounding needs.
    rows, limits = _cleaned(-basis[:, 2]), at_zero[:, 2] + TOLERANCE / 2
    for done in range(_ROUNDS):
        z = qpsolvers.solve_qp(metric, gradient, rows, limits, solver="quadprog")
        if z is None:
            return None
        force = at_zero + basis @ z
        feet = np.empty(0, dtype=np.intp)
        if friction_coefficient is not None:
            tangential = np.hypot(force[:, 0], force[:, 1])
            slack = _CONE_TOLERANCE if done < _ENOUGH else TOLERANCE
            feet = np.flatnonzero(tangential > friction_coefficient * force[:, 2] + slack)
        if not feet.size:
            unloaded = np.abs(force[:, 2]) < 2 * TOLERANCE  # and so holds nothing
            force[unloaded, 2] = 0.0
            force[unloaded & (np.abs(force[:, :2]).max(axis=1) < 1e2 * TOLERANCE)] = 0.0
            return np.asarray(force * size)
        toward = force[feet, :2] / tangential[feet, None]
        across = np.einsum("pi,pid->pd", toward, basis[feet, :2])
        along = np.einsum("pi,pi->p", toward, at_zero[feet, :2])
        inside = friction_coefficient * at_zero[feet, 2] - along + _CONE_TOLERANCE / 2
        rows = np.vstack([rows, _cleaned(across - friction_coefficient * basis[feet, 2])])
        limits = np.concatenate([limits, inside])
    return None


def _cleaned(rows: Array) -> Array:
    """Without what rounding leaves of forces that do not act on a bound at all."""
    return np.where(np.abs(rows) < 1e-12, 0.0, rows)


def held_by_friction(start: Array, basis: Array, friction_coefficient: float) -> Array | None:
    """Least tangential forces of one sample within the friction cones; None where there are none.

    `start`: forces that meet the wrench [N], shape (F, 3). `basis`: shape (F, 3, D).
    `friction_coefficient`: greatest tangential over normal force [1].
    """
    weight = np.array([1.0, 1.0, NORMAL_WEIGHT])
    flat = (start.size, basis.shape[-1])
    metric = basis.reshape(flat).T @ (basis * weight[:, None]).reshape(flat)
    gradient = np.einsum("fi,fid->d", start * weight, basis)
    return least_within_bounds(metric, gradient, start, basis, friction_coefficient)


def least_friction(start: Array, basis: Array, enough: float) -> float:
    """The least friction coefficient with which any forces meet the wrench of one sample.

    `start`: forces that meet the wrench [N], shape (F, 3). `basis`: shape (F, 3, D). `enough`: a
    coefficient that suffices; infinite where none is known.
    """
    low, high = 0.0, enough
    if not np.isfinite(enough):
        high = 1.0
        while held_by_friction(start, basis, high) is None:
            high *= 2.0
            if high > _MOST_FRICTION:
                return np.inf
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if held_by_friction(start, basis, middle) is None:
            low = middle
        else:
            high = middle
    return high


LEAST_TANGENTIAL, LEAST_TORQUE = "least_tangential", "least_torque"
RULES = (LEAST_TANGENTIAL, LEAST_TORQUE)
#: Weight of the distance from the least tangential forces beside the torques: it decides between
#: forces that take the same.
_TIE = 1e-9


@dataclass(frozen=True)
class GroundForces:
    """How the ground's forces are chosen.

    Raises:
        GaitError: No such rule, or a friction coefficient that no ground has.
    """

    rule: str = LEAST_TANGENTIAL  #: One of `RULES`.
    #: Greatest tangential over normal force [1]; None for no limit.
    friction_coefficient: float | None = None

    def __post_init__(self) -> None:
        if self.rule not in RULES:
            raise GaitError(f"--forces {self.rule}: no such rule; {closest(self.rule, RULES)}")
        mu = self.friction_coefficient
        if mu is not None and not (0 < mu < np.inf):
            raise GaitError(f"friction coefficient {mu:g}: expected a finite number above 0")


PAPER = GroundForces()


def least_torque_forces(
    start: Array,
    feet: Array,
    torque: Array,
    unit_torque: Array,
    foot: NDArray[np.intp],
    friction_coefficient: float | None = None,
) -> Array:
    """Forces on K feet for the least sum of squared torques of the Q joints that they load.

    All are in a frame whose z axis is the ground's normal.

    Args:
        start: Forces that carry the robot, which those found are nearest to where torques are the
            same [N], shape (N, K, 3). Samples that break a bound keep theirs.
        feet: Points [m], shape (N, K, 3).
        torque: What the joints must apply without the ground [N*m], shape (N, Q).
        unit_torque: What a force of 1 N on its foot along each axis puts into a joint, shape (N,
            Q, 3) [N*m/N].
        foot: Which of the K feet loads each joint, shape (Q,).
        friction_coefficient: Greatest tangential over normal force [1]; None for no limit.

    Returns:
        Forces within the bounds [N], shape (N, K, 3).
    """
    force = np.array(start)
    rows = np.flatnonzero(~out_of_bounds(start, friction_coefficient))
    start, basis = start[rows], internal_basis(feet)[rows]
    needed = torque[rows] - np.einsum("nqi,nqi->nq", unit_torque[rows], start[:, foot])
    effect = -np.einsum("nqi,nqid->nqd", unit_torque[rows], basis[:, foot])
    metric = effect.transpose(0, 2, 1) @ effect
    mean = np.trace(metric, axis1=1, axis2=2) / metric.shape[-1]
    tie = _TIE * np.maximum(mean, np.finfo(float).tiny)
    metric += tie[:, None, None] * np.eye(metric.shape[-1])
    gradient = np.einsum("nqd,nq->nd", effect, needed)
    z = -np.linalg.solve(metric, gradient[..., None])[..., 0]
    found = start + np.einsum("nkid,nd->nki", basis, z)
    for i in np.flatnonzero(out_of_bounds(found, friction_coefficient)):
        bounded = least_within_bounds(
            metric[i], gradient[i], start[i], basis[i], friction_coefficient
        )
        found[i] = start[i] if bounded is None else bounded
    force[rows] = found
    return force
