"""Forces of the feet against each other, which leave the wrench on the robot as it is.

All foot forces that meet one wrench are one of them plus a combination z of internal forces, which
span the null space of the six equations of balance. What no closed form gives (feet that would pull
or slide, other rules than the least tangential forces) is then a small problem in z alone, and
balance holds to rounding whatever z comes out. A quadratic in z within bounds goes to quadprog (the
dual method of Goldfarb and Idnani) through qpsolvers, row by row and only where a bound is active.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: Weight of normal beside tangential forces: what the least tangential forces leave open.
NORMAL_WEIGHT = 1e-8
#: Share of the largest force below which a violated bound is rounding.
TOLERANCE = 1e-10
_ROUNDS = 100  # of tangent planes; a handful is usual
_HALVINGS = 40
_MOST_FRICTION = 1e3  # beyond this no coefficient is looked for


def internal_basis(feet: Array) -> Array:
    """Orthonormal basis of the forces that add up to no force and no moment.

    Args:
        feet: Foot points [m], shape (N, F, 3), F >= 3, not in one line.

    Returns:
        Shape (N, F, 3, D) with D = 3 F - 6.
    """
    n, count, _ = feet.shape
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


def tangential_metric(basis: Array) -> Array:
    """Matrix of the sum of squared tangential forces in z, normals weighted little.

    Args:
        basis: Shape (..., F, 3, D).

    Returns:
        Shape (..., D, D).
    """
    weight = np.array([1.0, 1.0, NORMAL_WEIGHT])[:, None]
    flat = basis.reshape(*basis.shape[:-3], -1, basis.shape[-1])
    weighted = (basis * weight).reshape(flat.shape)
    return np.asarray(np.swapaxes(flat, -1, -2) @ weighted)


def out_of_bounds(force: Array, friction_coefficient: float | None) -> NDArray[np.bool_]:
    """Samples at which a foot pulls or leaves its friction cone, shape (N,), beyond rounding.

    Args:
        force: z along the ground's normal [N], shape (N, F, 3).
        friction_coefficient: None for no limit.
    """
    slack = TOLERANCE * np.abs(force).max(axis=(1, 2), keepdims=True)[..., 0]
    normal = force[..., 2]
    outside = normal < -slack
    if friction_coefficient is not None:
        tangential = np.hypot(force[..., 0], force[..., 1])
        outside = outside | (tangential > friction_coefficient * normal + slack)
    return np.asarray(outside.any(axis=1))


def bounded_minimum(
    metric: Array, gradient: Array, start: Array, basis: Array, friction_coefficient: float | None
) -> Array | None:
    """Forces of one sample that minimise z' metric z / 2 + gradient' z within the feet's bounds.

    No foot pulls, and with a friction coefficient each force lies in its circular cone: planes
    tangent to it at the force found are added until every force is inside, so that what comes out
    is the minimum over the cone itself, and a sample for which there is none over the planes has
    none over the cone.

    Args:
        metric: Positive definite, shape (D, D).
        gradient: At z = 0, shape (D,).
        start: Force at z = 0 [N], shape (F, 3).
        basis: Shape (F, 3, D).
        friction_coefficient: Greatest tangential over normal force [1]; None for no limit.

    Returns:
        Force [N], shape (F, 3); None where no force is within the bounds.
    """
    import qpsolvers  # a tenth of a second, for motions that need it

    size = float(np.abs(start).max())
    unit = float(np.trace(metric)) / metric.shape[0]
    metric, gradient = metric / unit, gradient / (unit * size)
    at_zero = start / size
    # Rows of  G z <= h: first that no foot pulls, then tangent planes of the cones.
    rows = [_cleaned(-basis[:, 2])]
    limits = [at_zero[:, 2] + TOLERANCE / 2]
    for _ in range(_ROUNDS):
        z = qpsolvers.solve_qp(
            metric, gradient, np.vstack(rows), np.concatenate(limits), solver="quadprog"
        )
        if z is None:
            return None
        force = at_zero + basis @ z
        tangential = np.hypot(force[:, 0], force[:, 1])
        if friction_coefficient is None:
            break
        outside = tangential > friction_coefficient * force[:, 2] + TOLERANCE
        if not outside.any():
            break
        toward = force[outside, :2] / tangential[outside, None]
        across = np.einsum("fi,fid->fd", toward, basis[outside, :2])
        rows.append(_cleaned(across - friction_coefficient * basis[outside, 2]))
        limits.append(
            friction_coefficient * at_zero[outside, 2]
            - np.einsum("fi,fi->f", toward, at_zero[outside, :2])
            + TOLERANCE / 2
        )
    else:
        return None
    unloaded = np.abs(force[:, 2]) < 2 * TOLERANCE
    force[unloaded, 2] = 0.0
    force[unloaded & (np.abs(force[:, :2]).max(axis=1) < 1e2 * TOLERANCE)] = 0.0
    return np.asarray(force * size)


def _cleaned(rows: Array) -> Array:
    """Without what rounding leaves of forces that do not act on a bound at all."""
    return np.where(np.abs(rows) < 1e-12, 0.0, rows)


def held_by_friction(start: Array, basis: Array, friction_coefficient: float) -> Array | None:
    """Least tangential forces of one sample within the friction cones; None where there are none.

    Args:
        start: Forces that meet the wrench [N], shape (F, 3).
        basis: Shape (F, 3, D).
        friction_coefficient: Greatest tangential over normal force [1].
    """
    metric = tangential_metric(basis)
    weighted = start * np.array([1.0, 1.0, NORMAL_WEIGHT])
    gradient = np.einsum("fi,fid->d", weighted, basis)
    return bounded_minimum(metric, gradient, start, basis, friction_coefficient)


def least_friction(start: Array, basis: Array, enough: float) -> float:
    """The least friction coefficient with which any forces meet the wrench of one sample.

    Args:
        start: Forces that meet the wrench [N], shape (F, 3).
        basis: Shape (F, 3, D).
        enough: A coefficient that suffices; infinite where none is known.
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
