"""Joint positions by damped least squares: any leg, all samples at once.

A step is ``J^T (J J^T + m^2 1)^-1 e`` with the error e of the foot and a damping m that falls with
it (Nakamura and Hanafusa 1986; Wampler 1986): near a singular posture steps stay small, near the
target the iteration is Newton's. Paths are followed from coarse to fine: a few samples are solved
from the start posture, those between start from a spline through them.
"""

from __future__ import annotations

import numpy as np

from actuators.arrays import Array
from pipeline.robot.kinematics import foot_jacobians, foot_positions
from pipeline.robot.leg_chains import LegChains

_ITERATIONS = 60
_MAX_STEP = 0.35  # [rad] per iteration, keeps the knee on the branch of the start posture
_CONVERGED, _STILL = 1e-13, 1e-12  # [m], [rad] of a step: what is left is out of reach
_LEAST_DAMPING, _DAMPING = 1e-8, 1e-2  # [m], relaxed as the iteration comes close
_STRIDE = 16  # samples of a path between those that are solved first
#: Share of a leg's reach within which a spline's guess is trusted to lie on the path's branch.
_NEAR = 5e-3


def approach(chains: LegChains, target: Array, start: Array) -> tuple[Array, Array]:
    """Joint positions that bring the feet as close to their targets as the iteration gets.

    `target`: foot positions in the base frame [m], shape (N, L, 3). `start`: posture that names the
    branch (knee up or down) [rad, m], shape (L, K) or (N, L, K). Returns joint positions [rad, m],
    shape (N, L, K), and what is left to the targets [m], (N, L).
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


def _iterated(chains: LegChains, target: Array, q: Array) -> tuple[Array, Array]:
    left = np.empty(target.shape[:2])
    busy = np.arange(len(target))  # samples that are not there yet
    for iteration in range(_ITERATIONS + 1):
        feet, jacobians = foot_jacobians(chains, q[busy])
        error = target[busy] - feet
        left[busy] = np.linalg.norm(error, axis=-1)
        going = (left[busy] > _CONVERGED).any(axis=1)
        if iteration == _ITERATIONS or not going.any():
            break
        busy, own = busy[going], np.ascontiguousarray(jacobians[going])
        step = _step(own, error[going], left[busy])
        q[busy] += step
        busy = busy[np.abs(step).max(axis=(1, 2)) > _STILL]
    return q, left


def _step(jacobians: Array, error: Array, size: Array) -> Array:
    """Of shape (N, L, K), for errors (N, L, 3) of that size (N, L) [m]."""
    transposed = jacobians.swapaxes(-1, -2)
    damping = np.clip(0.1 * size, _LEAST_DAMPING, _DAMPING)[..., None, None]
    normal = jacobians @ transposed + damping**2 * np.eye(3)
    step = (transposed @ np.linalg.solve(normal, error[..., None]))[..., 0]
    largest = np.abs(step).max(axis=-1, keepdims=True)
    return np.asarray(step * np.minimum(1.0, _MAX_STEP / np.maximum(largest, 1e-300)))
