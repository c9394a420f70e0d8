"""Joint positions, velocities and accelerations from a prescribed foot path.

Positions come in closed form where a leg has one (`pipeline.robot.inverse.closed_form`), from
damped least squares where it has three joints of another build, and of least motion or least miss
where it has more or fewer joints than a foot has coordinates. Velocities and accelerations follow
exactly, from ``x_dot = J q_dot`` and ``x_ddot = J q_ddot + J_dot q_dot``.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from actuators.arrays import Array
from pipeline.errors import OutOfReachError
from pipeline.robot.inverse.closed_form import closed_form, closed_form_legs
from pipeline.robot.inverse.damped import approach, square_solve
from pipeline.robot.inverse.least_motion import Freedom, LeastMotion, freedoms
from pipeline.robot.kinematics import (
    bias_acceleration,
    foot_jacobians,
    foot_positions,
    samples_last,
    swept,
)
from pipeline.robot.leg_chains import LegChains

ACCEPTED = 1e-9  # [m]
_SINGULAR = 1e8  # condition number of a leg's Jacobian that is none any more
_JUMP = 0.2  # [rad] between two samples that no velocity explains
_PATH = 16  # samples; fewer are too coarse for velocities to predict the next position


def reach(chains: LegChains, target: Array, start: Array) -> tuple[Array, Array]:
    """Joint positions that bring the feet as close to their targets as their legs get.

    Args:
        chains: The legs.
        target: Foot positions in the base frame [m], shape (N, L, 3).
        start: Posture that names the branch (knee up or down) [rad, m], shape (L, K).

    Returns:
        Joint positions [rad, m], shape (N, L, K), and by how much a foot misses what its leg
        should reach [m], shape (N, L): all of the way to the target where the leg moves its foot
        in every direction, nothing where it lacks one and stands as near as it gets.
    """
    n_samples, n_legs = target.shape[:2]
    q = np.zeros((n_samples, n_legs, chains.depth))
    miss = np.zeros((n_samples, n_legs))
    direct = closed_form_legs(chains, start)
    if direct.size:
        found = closed_form(chains, direct, target[:, direct], start)
        reached = np.isfinite(found).all(axis=(0, 2))
        direct = direct[reached]  # the iteration finds how far the others are off
    if direct.size:
        q[:, direct, :3] = found[:, reached]
        feet = foot_positions(chains.of(direct.tolist()), q[:, direct])
        miss[:, direct] = np.linalg.norm(target[:, direct] - feet, axis=-1)
    for freedom, legs in _groups(chains, set(direct.tolist())):
        own, n = chains.of(legs).shortened(freedom.joints), freedom.joints
        if freedom.square:
            q[:, legs, :n], miss[:, legs] = approach(own, target[:, legs], start[legs, :n])
        else:
            least = LeastMotion(own, freedom)
            q[:, legs, :n], left = least.positions(target[:, legs], start[legs, :n])
            miss[:, legs] = 0.0 if freedom.lacks else left
    return q, miss


def solve_positions(chains: LegChains, target: Array, start: Array, time: Array) -> Array:
    """Joint positions that bring the feet to their targets.

    Args:
        chains: The legs.
        target: Foot positions in the base frame [m], shape (N, L, 3).
        start: Posture that names the branch (knee up or down) [rad, m], shape (L, K).
        time: For messages [s], shape (N,).

    Returns:
        Joint positions [rad, m], shape (N, L, K). A leg that lacks a direction puts its foot as
        near as it gets; `pipeline.robot.inverse.foot_tracking` says how near.

    Raises:
        OutOfReachError: A target is not reached; names leg, instant and how far it is off.
    """
    q, miss = reach(chains, target, start)
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
    chains: LegChains,
    q: Array,
    foot_velocity: Array,
    foot_acceleration: Array,
    time: Array,
    target: Array | None = None,
) -> tuple[Array, Array]:
    """Joint velocities and accelerations that move the feet as prescribed.

    Args:
        chains: The legs.
        q: Joint positions from `solve_positions` [rad, m], shape (N, L, K).
        foot_velocity: In the base frame, relative to the base [m/s], shape (N, L, 3).
        foot_acceleration: Likewise [m/s^2], shape (N, L, 3).
        time: For messages [s], shape (N,).
        target: Where the feet should be [m], shape (N, L, 3); where they are by default. A leg
            that lacks a direction needs it: how it turns depends on how far it is off.

    Returns:
        Joint velocities [rad/s, m/s] and accelerations [rad/s^2, m/s^2], each (N, L, K).

    Raises:
        OutOfReachError: The leg is stretched (singular) at a sample.
    """
    velocity, acceleration = np.zeros(q.shape), np.zeros(q.shape)
    goal = foot_positions(chains, q) if target is None else target
    for freedom, legs in _groups(chains, set()):
        own, n = chains.of(legs).shortened(freedom.joints), freedom.joints
        posture = q[:, legs, :n]
        moved = foot_velocity[:, legs], foot_acceleration[:, legs]
        if freedom.square:
            parts = _square_rates(own, posture, *moved, time)
        else:
            _refuse_singular(own, freedom, posture, time)
            parts = LeastMotion(own, freedom).rates(posture, *moved, goal[:, legs])
        velocity[:, legs, :n], acceleration[:, legs, :n] = parts
    _refuse_jumps(chains, q, velocity, time)
    return velocity, acceleration


def _refuse_jumps(chains: LegChains, q: Array, velocity: Array, time: Array) -> None:
    """Between samples a joint goes as far as its velocities say, or it changed its branch.

    Raises:
        OutOfReachError: One did not.
    """
    step = np.diff(time)[:, None, None]
    if time.size < _PATH or step.min() <= 0:
        return
    gone = np.diff(q, axis=0)
    expected = 0.5 * step * (velocity[1:] + velocity[:-1])
    # What the trapezoid leaves out grows with the step, as the change of velocity does.
    jump = np.abs(gone - expected) - 0.5 * step * np.abs(np.diff(velocity, axis=0))
    if jump.max() > _JUMP:
        sample, leg, joint = np.unravel_index(int(jump.argmax()), jump.shape)
        raise OutOfReachError(
            f"leg '{chains.names[leg]}', joint {joint + 1}: its position jumps by "
            f"{gone[sample, leg, joint]:.3g} rad at t = {time[sample]:.4g} s, from one branch of "
            "its inverse kinematics to another; keep the foot away from the axis of joint 1 and "
            "the leg from being stretched, or state another start_posture"
        )


def _groups(chains: LegChains, but: set[int]) -> Iterator[tuple[Freedom, list[int]]]:
    """Legs of the same freedom, without some."""
    free = freedoms(chains)
    for kind in dict.fromkeys(free):
        legs = [i for i, own in enumerate(free) if own == kind and i not in but]
        if legs:
            yield kind, legs


def _square_rates(
    chains: LegChains, q: Array, foot_velocity: Array, foot_acceleration: Array, time: Array
) -> tuple[Array, Array]:
    """Of legs with three joints that move their feet in every direction, each (N, M, 3)."""
    columns = swept(chains, samples_last(q)).columns
    rate, condition = square_solve(columns, foot_velocity.transpose(2, 1, 0))
    _refuse(chains, condition, time)
    bias = bias_acceleration(chains, samples_last(q), rate.transpose(1, 0, 2))
    faster, _ = square_solve(columns, foot_acceleration.transpose(2, 1, 0) - bias)
    return rate.transpose(2, 1, 0), faster.transpose(2, 1, 0)


def _refuse_singular(chains: LegChains, freedom: Freedom, q: Array, time: Array) -> None:
    values = np.linalg.svd(foot_jacobians(chains, q)[1], compute_uv=False)
    with np.errstate(divide="ignore"):
        _refuse(chains, (values[..., 0] / values[..., freedom.directions - 1]).T, time)


def _refuse(chains: LegChains, condition: Array, time: Array) -> None:
    singular = ~(condition < _SINGULAR)
    if singular.any():
        leg, sample = np.unravel_index(int(singular.argmax()), singular.shape)
        raise OutOfReachError(
            f"leg '{chains.names[leg]}' is stretched or folded to a singular posture at "
            f"t = {time[sample]:.4g} s; shorten the stroke or move the neutral foot"
        )
