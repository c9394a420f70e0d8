"""Joint positions by damped least squares: any leg, all samples at once.

A step is ``J^T (J J^T + m^2 1)^-1 e`` with the error e of the foot and a damping m that falls with
it (Nakamura and Hanafusa 1986; Wampler 1986): near a singular posture steps stay small, near the
target the iteration is Newton's. Paths are followed from coarse to fine: a few samples are solved
from the start posture, those between start from a spline through them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.robot.kinematics import cross, foot_positions, swept
from pipeline.robot.leg_chains import LegChains

Array = NDArray[np.float64]
_ITERATIONS = 60
_MAX_STEP = 0.35  # [rad] per iteration, keeps the knee on the branch of the start posture
_CONVERGED = 1e-12  # [m]
_DAMPING = 1e-2  # [m], relaxed as the iteration comes close
_STRIDE = 16  # samples of a path between those that are solved first
#: Share of a leg's reach within which a spline's guess is trusted to lie on the path's branch.
_NEAR = 5e-3


def approach(chains: LegChains, target: Array, start: Array) -> tuple[Array, Array]:
    """Joint positions that bring the feet as close to their targets as the iteration gets.

    Args:
        chains: The legs.
        target: Foot positions in the base frame [m], shape (N, L, 3).
        start: Posture that names the branch (knee up or down) [rad, m], shape (L, K) or (N, L, K).

    Returns:
        Joint positions [rad, m], shape (N, L, K), and what is left to the targets [m], (N, L).
    """
    n = target.shape[0]
    q = np.broadcast_to(start, (*target.shape[:2], chains.depth)).copy()
    if start.ndim == 2 and n > 4 * _STRIDE:
        from scipy.interpolate import CubicSpline

        knots = np.unique(np.append(np.arange(0, n, _STRIDE), n - 1))
        q[knots] = _iterated(chains, target[knots], q[knots])[0]
        guess = CubicSpline(knots, q[knots])(np.arange(n))
        off = np.linalg.norm(foot_positions(chains, guess) - target, axis=-1)
        trusted = off < _NEAR * chains.reach
        q = np.where(trusted[..., None], guess, q)
    return _iterated(chains, target, q)


def _iterated(chains: LegChains, target: Array, start: Array) -> tuple[Array, Array]:
    q = np.array(start.transpose(1, 2, 0), order="C")  # (L, K, N)
    goal = np.array(target.transpose(2, 1, 0), order="C")  # (3, L, N)
    left = np.empty(goal.shape[1:])
    busy = np.arange(goal.shape[2])  # samples that are not there yet
    for _ in range(_ITERATIONS):
        own = q[..., busy]
        legs = swept(chains, own.copy())
        error = goal[..., busy] - legs.tip
        size = np.sqrt((error**2).sum(axis=0))
        left[:, busy] = size
        going = np.flatnonzero((size > _CONVERGED).any(axis=0))
        if going.size == 0:
            break
        if going.size < busy.size:
            busy, own, size = busy[going], own[..., going], size[:, going]
            error, columns = error[..., going], legs.columns[..., going]
        else:
            columns = legs.columns
        step = damped_step(columns, error, np.minimum(_DAMPING, 0.1 * size))
        largest = np.abs(step).max(axis=0)
        step *= np.minimum(1.0, _MAX_STEP / np.maximum(largest, 1e-300))
        q[..., busy] = own + step.transpose(1, 0, 2)
    else:
        legs = swept(chains, q[..., busy].copy())
        left[:, busy] = np.sqrt(((goal[..., busy] - legs.tip) ** 2).sum(axis=0))
    return q.transpose(2, 0, 1), left.T


def damped_step(columns: Array, error: Array, damping: Array) -> Array:
    """``J^T (J J^T + m^2 1)^-1 e``, component first.

    Args:
        columns: Of the Jacobians, shape (3, K, L, N).
        error: What is left to the target [m], shape (3, L, N).
        damping: m, shape (L, N).

    Returns:
        Shape (K, L, N).
    """
    x, y, z = columns
    m2 = damping**2
    # The six entries of a symmetric matrix, and its adjugate.
    a, d, f = (x * x).sum(0) + m2, (y * y).sum(0) + m2, (z * z).sum(0) + m2
    b, c, e = (x * y).sum(0), (x * z).sum(0), (y * z).sum(0)
    aa, bb, cc = d * f - e * e, c * e - b * f, b * e - c * d
    dd, ee, ff = a * f - c * c, b * c - a * e, a * d - b * b
    determinant = np.maximum(a * aa + b * bb + c * cc, 1e-300)
    u, v, w = error / determinant
    return (
        x * (aa * u + bb * v + cc * w)
        + y * (bb * u + dd * v + ee * w)
        + (z * (cc * u + ee * v + ff * w))
    )


def square_solve(columns: Array, wanted: Array) -> tuple[Array, Array]:
    """Rates of three joints that give a foot's rates, by Cramer's rule.

    Args:
        columns: Of the Jacobians, shape (3, 3 joints, L, N).
        wanted: Shape (3, L, N).

    Returns:
        Shape (3 joints, L, N), and the condition number in the Frobenius norm, (L, N).
    """
    one, two, three = columns[:, 0], columns[:, 1], columns[:, 2]
    rows = np.stack([cross(two, three), cross(three, one), cross(one, two)])  # of the adjugate
    determinant = (one * rows[0]).sum(0)
    size = np.sqrt((columns**2).sum((0, 1)) * (rows**2).sum((0, 1)))
    with np.errstate(divide="ignore", invalid="ignore"):
        condition = size / np.abs(determinant)
        solved: Array = (rows * wanted).sum(1) / determinant
    return solved, condition
