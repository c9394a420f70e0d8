"""Joint positions, velocities and accelerations from a prescribed foot path.

Positions come from damped least squares; where a leg has more or fewer joints than a foot has
coordinates, on to least motion or least miss (`pipeline.robot.inverse.least_motion`). Velocities
and accelerations follow exactly, from ``x_dot = J q_dot`` and ``x_ddot = J q_ddot + J_dot q_dot``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from actuators.arrays import Array
from pipeline.errors import OutOfReachError
from pipeline.robot.inverse.least_motion import Freedom, LeastMotion, freedoms
from pipeline.robot.kinematics import foot_jacobians, foot_positions
from pipeline.robot.leg_chains import LegChains

ACCEPTED = 1e-9  # [m]
_JUMP = 0.2  # [rad] between two samples that no velocity explains
_PATH = 16  # samples; fewer are too coarse for velocities to predict the next position


def reach(chains: LegChains, target: Array, start: Array) -> tuple[Array, Array]:
    """Joint positions that bring the feet as close to their targets as their legs get.

    `target`: foot positions in the base frame [m], shape (N, L, 3). `start`: posture that names the
    branch (knee up or down) [rad, m], shape (L, K). Returns joint positions [rad, m], shape (N, L,
    K), and by how much a foot misses what its leg should reach [m], shape (N, L): all of the way to
    the target where the leg moves its foot in every direction, nothing where it lacks one and
    stands as near as it gets.
    """
    n_samples, n_legs = target.shape[:2]
    q = np.zeros((n_samples, n_legs, chains.depth))
    miss = np.zeros((n_samples, n_legs))
    for problem, legs in _problems(chains):
        n = problem.freedom.joints
        q[:, legs, :n], left = problem.positions(target[:, legs], start[legs, :n])
        miss[:, legs] = 0.0 if problem.freedom.lacks else left
    return q, miss


def solve_positions(chains: LegChains, target: Array, start: Array, time: Array) -> Array:
    """Joint positions that bring the feet to their targets.

    `target`: foot positions in the base frame [m], shape (N, L, 3). `start`: posture that names the
    branch (knee up or down) [rad, m], shape (L, K). `time`: for messages [s], shape (N,). Returns
    joint positions [rad, m], shape (N, L, K). A leg that lacks a direction puts its foot as near as
    it gets; `foot_tracking` says how near.

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

    `target`: of its foot in the base frame [m], shape (3,). `miss`: what is left [m]. `time`: in
    the motion [s].
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

    `q`: joint positions from `solve_positions` [rad, m], shape (N, L, K). `foot_velocity`: in the
    base frame, relative to the base [m/s], shape (N, L, 3). `foot_acceleration`: likewise [m/s^2],
    shape (N, L, 3). `time`: for messages [s], shape (N,). `target`: where the feet should be [m],
    shape (N, L, 3); where they are by default. A leg that lacks a direction needs it: how it turns
    depends on how far it is off. Returns joint velocities [rad/s, m/s] and accelerations [rad/s^2,
    m/s^2], each (N, L, K).

    Raises:
        OutOfReachError: The leg is stretched (singular) at a sample, or changes its branch.
    """
    velocity, acceleration = np.zeros(q.shape), np.zeros(q.shape)
    goal = foot_positions(chains, q) if target is None else target
    for problem, legs in _problems(chains):
        n = problem.freedom.joints
        path = goal[:, legs], foot_velocity[:, legs], foot_acceleration[:, legs]
        parts = problem.rates(q[:, legs, :n], *path, time)
        velocity[:, legs, :n], acceleration[:, legs, :n] = parts
    step = np.diff(time)[:, None, None]
    if time.size < _PATH or step.min() <= 0:
        return velocity, acceleration
    # Between samples a joint goes as far as its velocities say, or it changed its branch. What the
    # trapezoid leaves out grows with the step, as the change of velocity does.
    gone = np.diff(q, axis=0)
    jump = np.abs(gone - 0.5 * step * (velocity[1:] + velocity[:-1]))
    jump -= 0.5 * step * np.abs(np.diff(velocity, axis=0))
    if jump.max() > _JUMP:
        sample, leg, joint = np.unravel_index(int(jump.argmax()), jump.shape)
        raise OutOfReachError(
            f"leg '{chains.names[leg]}', joint {joint + 1}: its position jumps by "
            f"{gone[sample, leg, joint]:.3g} rad at t = {time[sample]:.4g} s, from one branch of "
            "its inverse kinematics to another; keep the foot away from the axis of joint 1 and "
            "the leg from being stretched, or state another start_posture"
        )
    return velocity, acceleration


@lru_cache
def _problems(chains: LegChains) -> tuple[tuple[LeastMotion, list[int]], ...]:
    """Legs of the same freedom, and what they are to do."""
    alike: dict[Freedom, list[int]] = {}
    for leg, freedom in enumerate(freedoms(chains)):
        alike.setdefault(freedom, []).append(leg)
    return tuple(
        (LeastMotion(chains.of(legs).shortened(freedom.joints), freedom), legs)
        for freedom, legs in alike.items()
    )


Vector = tuple[float, float, float]


@dataclass(frozen=True)
class FootTracking:
    """What one leg does with its foot's path."""

    leg: str  #: Its name.
    joints: int  #: Number of its joints.
    directions: int  #: In how many directions they move the foot.
    #: Unit vectors in the base frame along which they do not, at the first sample.
    cannot_move: tuple[Vector, ...]
    deviation: float  #: Largest distance of the foot from its path [m].
    deviation_time: float  #: When [s]; not a number where the foot follows.
    #: Of the Jacobian, among as many as there are directions [m/rad]: the smaller, the nearer to a
    #: stretched or folded leg.
    least_singular_value: float
    singular_time: float  #: When it is that small [s].


def foot_tracking(
    chains: LegChains, pieces: Sequence[tuple[Array, Array, Array]]
) -> tuple[FootTracking, ...]:
    """Judge a motion leg by leg.

    `pieces`: stretches of the motion: time (N,) [s], joint positions (N, L, K) [rad, m], and where
    the feet should be in the base frame (N, L, 3) [m].
    """
    time = np.concatenate([t for t, _, _ in pieces])
    q = np.concatenate([position for _, position, _ in pieces])
    target = np.concatenate([goal for _, _, goal in pieces])
    feet, jacobian = foot_jacobians(chains, q)
    off = np.linalg.norm(feet - target, axis=-1)
    left, values, _ = np.linalg.svd(jacobian)
    out = []
    for i, (name, own) in enumerate(zip(chains.names, freedoms(chains), strict=True)):
        smallest = values[:, i, own.directions - 1]
        far, near = int(off[:, i].argmax()), int(smallest.argmin())
        lacking: list[Vector] = []
        for direction in left[0, i, :, own.directions :].T:  # its largest component positive
            sign = np.sign(direction[int(np.abs(direction).argmax())])
            x, y, z = (float(round(sign * c, 9)) + 0.0 for c in direction)  # rounding is none
            lacking.append((x, y, z))
        out.append(
            FootTracking(
                leg=name,
                joints=own.joints,
                directions=own.directions,
                cannot_move=tuple(lacking),
                deviation=float(off[far, i]),
                deviation_time=float(time[far]) if off[far, i] > ACCEPTED else float("nan"),
                least_singular_value=float(smallest[near]),
                singular_time=float(time[near]),
            )
        )
    return tuple(out)
