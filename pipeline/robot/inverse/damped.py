"""Joint positions by damped least squares: any leg, all samples at once.

A step is ``J^T (J J^T + m^2 1)^-1 e`` with the error e of the foot and a damping m that falls with
it (Nakamura and Hanafusa 1986; Wampler 1986): near a singular posture steps stay small, near the
target the iteration is Newton's. Paths are followed from coarse to fine: a few samples are solved
from the start posture, those between start from a spline through them.
"""

from __future__ import annotations

import numpy as np

from actuators.arrays import Array
from pipeline.robot.kinematics import cross, foot_positions, samples_last, swept
from pipeline.robot.leg_chains import LegChains

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
        q = np.where((off < _NEAR * chains.reach)[..., None], guess, q)
    return _iterated(chains, target, q)


def _iterated(chains: LegChains, target: Array, start: Array) -> tuple[Array, Array]:
    q, goal = samples_last(start), np.array(target.transpose(2, 1, 0), order="C")
    left = np.empty(goal.shape[1:])
    busy = np.arange(goal.shape[2])  # samples that are not there yet
    for iteration in range(_ITERATIONS + 1):
        own = q[..., busy]
        legs = swept(chains, own.copy())
        error = goal[..., busy] - legs.tip
        size = left[:, busy] = np.sqrt((error**2).sum(axis=0))
        going = (size > _CONVERGED).any(axis=0)
        if iteration == _ITERATIONS or not going.any():
            break
        columns = legs.columns
        if not going.all():
            busy, own, size = busy[going], own[..., going], size[:, going]
            columns, error = columns[..., going], error[..., going]
        step = damped_step(columns, error, np.minimum(_DAMPING, 0.1 * size))
        step *= np.minimum(1.0, _MAX_STEP / np.maximum(np.abs(step).max(axis=0), 1e-300))
        q[..., busy] = own + step.transpose(1, 0, 2)
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
    normal = np.einsum("ikln,jkln->ijln", columns, columns)
    normal[range(3), range(3)] += damping**2
    return np.einsum("ikln,iln->kln", columns, square_solve(normal, error)[0])


def square_solve(columns: Array, wanted: Array) -> tuple[Array, Array]:
    """Solve equations of three unknowns for many legs and samples, by Cramer's rule.

    Args:
        columns: Of the matrices, shape (3, 3 columns, L, N).
        wanted: Right-hand sides, shape (3, L, N).

    Returns:
        Shape (3 unknowns, L, N), and the condition number in the Frobenius norm, (L, N).
    """
    one, two, three = columns[:, 0], columns[:, 1], columns[:, 2]
    rows = np.stack([cross(two, three), cross(three, one), cross(one, two)])  # of the adjugate
    determinant = (one * rows[0]).sum(0)
    determinant[determinant == 0] = 1e-300
    size = np.sqrt((columns**2).sum((0, 1)) * (rows**2).sum((0, 1)))
    with np.errstate(over="ignore", invalid="ignore"):
        solved: Array = (rows * wanted).sum(1) / determinant
        return solved, size / np.abs(determinant)
