"""Joint positions, velocities and accelerations from a prescribed foot path.

Positions come from a damped Newton iteration on the batched kinematics, so that any leg of three
revolute joints is served; velocities and accelerations then follow exactly from
``x_dot = J q_dot`` and ``x_ddot = J q_ddot + J_dot q_dot``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import OutOfReachError
from pipeline.robot.kinematics import foot_jacobian_rates, foot_jacobians
from pipeline.robot.leg_chains import LegChains

Array = NDArray[np.float64]
_ITERATIONS = 60
_MAX_STEP = 0.35  # [rad] per iteration, keeps the knee on the branch of the start posture
_CONVERGED = 1e-12  # [m]
ACCEPTED = 1e-9  # [m]


def approach(chains: LegChains, target: Array, start: Array) -> tuple[Array, Array]:
    """Joint positions that bring the feet as close to their targets as the iteration gets.

    Args:
        chains: The legs.
        target: Foot positions in the base frame [m], shape (N, L, 3).
        start: Posture that names the branch (knee up or down) [rad, m], shape (L, K) or (N, L, K).

    Returns:
        Joint positions [rad, m], shape (N, L, K), and what is left to the targets [m], (N, L).
    """
    q = np.broadcast_to(start, (*target.shape[:2], chains.depth)).copy()
    damping = 1e-2  # [m], relaxed as the iteration comes close
    for _ in range(_ITERATIONS):
        foot, jacobian = foot_jacobians(chains, q)
        error = target - foot
        size = np.abs(error).max()
        if size < _CONVERGED:
            break
        damping = min(1e-2, 0.1 * float(size))
        normal = jacobian @ jacobian.swapaxes(-1, -2) + damping**2 * np.eye(3)
        step = jacobian.swapaxes(-1, -2) @ np.linalg.solve(normal, error[..., None])
        largest = np.abs(step).max(axis=(-1, -2), keepdims=True)
        q += (step * np.minimum(1.0, _MAX_STEP / np.maximum(largest, 1e-300)))[..., 0]
    foot, _ = foot_jacobians(chains, q)
    return q, np.linalg.norm(target - foot, axis=-1)


def solve_positions(chains: LegChains, target: Array, start: Array, time: Array) -> Array:
    """Joint positions that bring the feet to their targets.

    Args:
        chains: The legs.
        target: Foot positions in the base frame [m], shape (N, L, 3).
        start: Posture that names the branch (knee up or down) [rad, m], shape (L, K).
        time: For messages [s], shape (N,).

    Returns:
        Joint positions [rad, m], shape (N, L, K).

    Raises:
        OutOfReachError: A target is not reached; names leg, instant and how far it is off.
    """
    q, miss = approach(chains, target, start)
    if miss.max() > ACCEPTED:
        sample, leg = np.unravel_index(int(miss.argmax()), miss.shape)
        raise beyond_reach(
            chains.names[leg], target[sample, leg], float(miss.max()), float(time[sample])
        )
    return q


def beyond_reach(leg: str, target: Array, miss: float, time: float) -> OutOfReachError:
    """What to say of a target that no posture reaches.

    Args:
        leg: Its name.
        target: Of its foot in the base frame [m], shape (3,).
        miss: What is left [m].
        time: In the motion [s].
    """
    x, y, z = target
    return OutOfReachError(
        f"leg '{leg}' at t = {time:.4g} s: the foot target "
        f"({x:.3f}, {y:.3f}, {z:.3f}) m in the base frame lies {1e3 * miss:.1f} mm "
        "beyond its reach; shorten the stroke or the lift, or move the neutral foot"
    )


def solve_rates(
    chains: LegChains, q: Array, foot_velocity: Array, foot_acceleration: Array, time: Array
) -> tuple[Array, Array]:
    """Joint velocities and accelerations that move the feet as prescribed.

    Args:
        chains: The legs.
        q: Joint positions [rad], shape (N, L, 3).
        foot_velocity: In the base frame, relative to the base [m/s], shape (N, L, 3).
        foot_acceleration: Likewise [m/s^2], shape (N, L, 3).
        time: For messages [s], shape (N,).

    Returns:
        Joint velocities [rad/s] and accelerations [rad/s^2], each (N, L, 3).

    Raises:
        OutOfReachError: The leg is stretched (singular) at a sample.
    """
    _, jacobian = foot_jacobians(chains, q)
    singular = np.linalg.cond(jacobian) > 1e8
    if singular.any():
        sample, leg = np.unravel_index(int(singular.argmax()), singular.shape)
        raise OutOfReachError(
            f"leg '{chains.names[leg]}' is stretched or folded to a singular posture at "
            f"t = {time[sample]:.4g} s; shorten the stroke or move the neutral foot"
        )
    velocity = np.asarray(
        np.linalg.solve(jacobian, foot_velocity[..., None])[..., 0], dtype=np.float64
    )
    bias = foot_jacobian_rates(chains, q, velocity)
    acceleration = np.linalg.solve(jacobian, (foot_acceleration - bias)[..., None])[..., 0]
    return velocity, np.asarray(acceleration, dtype=np.float64)
