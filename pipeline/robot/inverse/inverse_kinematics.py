"""Joint positions, velocities and accelerations from a prescribed foot path.

Positions come from damped least squares; where a leg has more or fewer joints than a foot has
coordinates, on to least motion or least miss (`pipeline.robot.inverse.least_motion`). Velocities
and accelerations follow exactly, from ``x_dot = J q_dot`` and ``x_ddot = J q_ddot + J_dot q_dot``.

How well legs can follow their feet: directions they lack, distance from the path, singularity. A
leg of two joints cannot put its foot where it likes; it puts it as near as it gets
(`pipeline.robot.inverse`). What that costs is reported here.

The posture from which every leg's inverse kinematics starts: it names the knee's branch. A leg of
three joints reaches a point in several postures. Which one is meant stands in the robot file, as
``start_posture``; zero is taken where it does not. Where the iteration does not come from there to
the neutral foot inside the joints' limits, every branch is sought, so that a branch that is merely
not named is not called a foot out of reach.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.robot.inverse.least_motion import Freedom, LeastMotion, approach, freedoms, spread
from pipeline.robot.kinematics import foot_jacobians, foot_positions
from pipeline.robot.leg_chains import LegChains
from pipeline.robot.robot import Robot

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
        LegwattError: A target is not reached; names leg, instant and how far it is off.
    """
    q, miss = reach(chains, target, start)
    if miss.max() > ACCEPTED:
        sample, leg = np.unravel_index(int(miss.argmax()), miss.shape)
        raise beyond_reach(
            chains.names[leg], target[sample, leg], float(miss.max()), float(time[sample])
        )
    return q


def beyond_reach(leg: str, target: Array, miss: float, time: float) -> LegwattError:
    """What to say of a target that no posture reaches.

    `target`: of its foot in the base frame [m], shape (3,). `miss`: what is left [m]. `time`: in
    the motion [s].
    """
    x, y, z = target
    return LegwattError(
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
        LegwattError: The leg is stretched (singular) at a sample, or changes its branch.
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
        raise LegwattError(
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


_STARTS = 5  # per joint of a leg of three, inside its limits
_TRIES = _STARTS**3
_OTHER = 0.02  # [rad] two postures closer than this are one
_NEAR = 1e-4  # [m]
_SHOWN = 2  # postures offered per leg
_REMEDY = "change the stroke, the neutral foot or the limits"
_UNLIMITED = 2 * np.pi  # [rad] a range beyond this is searched over one turn


def neutral_postures(robot: Robot) -> Array:
    """Joint positions with every foot at mid-stroke [rad, m], shape (L, K), each on its branch.

    Raises:
        LegwattError: No posture of a leg reaches its neutral foot. Only other branches than that of
            ``start_posture`` do, or only beyond a joint's limits; offers postures to choose from.
    """
    spec = robot.spec
    target = np.array([leg.neutral_foot for leg in spec.legs])[None]
    q, miss = reach(robot.chains, target, robot.start_posture)
    lower, upper = robot.leg_limits
    inside = ((q[0] >= lower - ACCEPTED) & (q[0] <= upper + ACCEPTED)).all(axis=1)
    lost = np.flatnonzero((miss[0] > ACCEPTED) | ~inside)
    if lost.size:
        raise _explained(robot, target[0], lost, miss[0])
    return q[0]


def start_postures(robot: Robot, target: Array) -> Array:
    """Joint positions with every foot at mid-support, each leg on its own branch [rad], (L, 3).

    `target`: feet at mid-support in the base frame [m], shape (L, 3).

    Raises:
        LegwattError: A foot is not reached. Only on another branch than the robot file names.
    """
    start = neutral_postures(robot)
    if np.array_equal(target, [leg.neutral_foot for leg in robot.spec.legs]):
        return start
    q: Array = solve_positions(robot.chains, target[None], start, np.zeros(1))[0]
    return q


def refuse_beyond_limits(robot: Robot, q: Array, time: Array, remedy: str = _REMEDY) -> None:
    """Refuse joint positions outside the URDF's limits.

    `q`: joint positions [rad, m], shape (N, J). `time`: for messages [s], shape (N,).

    Raises:
        LegwattError: One lies beyond; names joint, instant and limits.
    """
    lower, upper = robot.limits
    beyond = np.maximum(q - upper, lower - q)
    if beyond.max() <= 1e-9:
        return
    sample, joint = np.unravel_index(int(beyond.argmax()), beyond.shape)
    at = f" at t = {time[sample]:.4g} s"
    raise LegwattError(f"{_too_far(robot, int(joint), q[sample, joint], at)}; {remedy}")


def _too_far(robot: Robot, joint: int, there: float, at: str = "") -> str:
    """That a joint, by its place in `Robot.joints`, would leave its limits."""
    scale, digits, unit = (1.0, 4, "m") if robot.sliding[joint] else (180 / np.pi, 1, "deg")
    numbers = (there, *(limit[joint] for limit in robot.limits))
    reached, low, high = (f"{scale * float(x):.{digits}f}" for x in numbers)
    return (
        f"joint '{robot.joints[joint]}' would have to reach {reached} {unit}{at}, its limits are "
        f"{low} to {high} {unit}"
    )


def _explained(robot: Robot, target: Array, lost: NDArray[np.intp], miss: Array) -> Exception:
    lower, upper = robot.leg_limits
    offers = []
    for i in lost:
        leg = robot.spec.legs[i]
        found, least = _branches(robot, int(i), target[i])
        if not found:
            return beyond_reach(leg.name, target[i], min(least, float(miss[i])), 0.0)
        low, high = lower[i, : len(leg.joints)], upper[i, : len(leg.joints)]
        good = [q for q in found if ((q >= low) & (q <= high)).all()]
        if not good:
            best = min(found, key=lambda q: float(_beyond(q, low, high).max()))
            worst = int(_beyond(best, low, high).argmax())
            far = _too_far(robot, int(robot.leg_columns[i, worst]), best[worst])
            words = f"leg '{leg.name}': to stand on its neutral foot {far}; {_REMEDY}"
            return LegwattError(words)
        written = (", ".join(f"{float(x):.2f}" for x in q) for q in good[:_SHOWN])
        shown = " or ".join(f"[{numbers}]" for numbers in written)
        offers.append(f"legs.{leg.name}: {shown}")
    stated = all(robot.spec.legs[i].start_posture for i in lost)
    what = "start_posture lies on another branch" if stated else "start_posture is missing"
    return LegwattError(
        f"{robot.spec.path}: {what}: from {'there' if stated else 'zero'} the inverse kinematics "
        "does not come to the neutral foot within the limits; these postures do, choose the knee's "
        f"branch: {'; '.join(offers)} [rad]"
    )


def _beyond(q: Array, lower: Array, upper: Array) -> Array:
    out: Array = np.maximum(np.maximum(q - upper, lower - q), 0.0)
    return out


def _branches(robot: Robot, leg: int, target: Array) -> tuple[list[Array], float]:
    """Postures of one leg that reach a point, those nearest to the middle of the limits first."""
    count = len(robot.spec.legs[leg].joints)
    lower, upper = (limit[leg] for limit in robot.leg_limits)
    wide = ~np.isfinite(upper - lower) | (upper - lower > _UNLIMITED) | (upper <= lower)
    low, high = np.where(wide, -np.pi, lower), np.where(wide, np.pi, upper)
    shares = spread(_TRIES, low.size)
    if low.size <= 3:  # in rows for few joints
        rows = (np.arange(_STARTS) + 0.5) / _STARTS
        shares = np.array(list(itertools.product(rows, repeat=3)))[:, : low.size]
    starts = np.zeros((_TRIES, low.size))
    starts[:, :count] = (low + (high - low) * shares)[:, :count]
    chains = robot.chains.of([leg])
    points = np.broadcast_to(target, (len(starts), 1, 3))
    # A start that never arrives keeps the damping of all up; those that come close go on alone.
    near, left = approach(chains, points, starts[:, None])
    least = float(left.min()) if freedoms(chains)[0].lacks else 0.0
    found: list[Array] = []
    for start in near[left[:, 0] < least + _NEAR]:
        q, miss = reach(chains, target[None, None], start)
        if miss[0, 0] > ACCEPTED:
            continue
        # Whole turns lead to the same posture; take the one inside the limits.
        turns = np.where(chains.slides[:, 0], 0.0, (q[0, 0] - (low + high) / 2) / (2 * np.pi))
        own = (q[0, 0] - 2 * np.pi * np.round(turns))[:count]
        if all(np.abs(own - other).max() > _OTHER for other in found):
            found.append(own)
    middle = ((low + high) / 2)[:count]
    return sorted(found, key=lambda q: float(np.abs(q - middle).sum())), float(left.min())
