"""The posture that every leg starts from, limits of joints, and how well feet follow their path.

A leg of three joints reaches a point in several postures. Which one is meant stands in the robot
file, as ``start_posture``; zero is taken where it does not. Where inverse kinematics does not come
from there to the neutral foot inside the joints' limits, every branch is sought, so that a branch
that is merely not named is not called a foot out of reach.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.robot.inverse_kinematics import (
    ACCEPTED,
    beyond_reach,
    freedoms,
    reach,
    solve_positions,
    spread,
)
from pipeline.robot.kinematics import LegChains, foot_jacobians, foot_positions
from pipeline.robot.robot import Robot

_TRIES = 125  # postures of a leg from which its branches are sought
_OTHER = 0.02  # [rad] two postures closer than this are one
_NEAR = 1e-4  # [m]
_SHOWN = 2  # postures offered per leg
_REMEDY = "change the stroke, the neutral foot or the limits"


def neutral_postures(robot: Robot) -> Array:
    """Joint positions with every foot at mid-stroke [rad, m], shape (L, K), each on its branch.

    Raises:
        LegwattError: No posture of a leg reaches its neutral foot. Only other branches than that of
            ``start_posture`` do, or only beyond a joint's limits; offers postures to choose from.
    """
    target = np.array([leg.neutral_foot for leg in robot.spec.legs])
    q, miss = reach(robot.chains, target[None], robot.start_posture)
    lost = np.flatnonzero((miss[0] > ACCEPTED) | (_beyond(robot, q[0]).max(axis=1) > ACCEPTED))
    if lost.size:
        raise _explained(robot, target, lost)
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
    if beyond.max() <= ACCEPTED:
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


def _beyond(robot: Robot, q: Array) -> Array:
    """How far joints lie beyond their limits, shape (..., L, K); zero inside."""
    lower, upper = robot.leg_limits
    return np.asarray(np.maximum(np.maximum(q - upper, lower - q), 0.0))


def _explained(robot: Robot, target: Array, lost: NDArray[np.intp]) -> LegwattError:
    """Why legs, by index, do not stand on their neutral feet (L, 3), with postures to choose."""
    offers = []
    for i in lost:
        leg = robot.spec.legs[i]
        found, least = _branches(robot, int(i), target[i])
        if not len(found):
            return beyond_reach(leg.name, target[i], least, 0.0)
        beyond = np.array([_beyond(robot, q)[i] for q in found])
        good = found[beyond.max(axis=1) <= 0.0]
        if not len(good):
            best = int(beyond.max(axis=1).argmin())
            worst = int(beyond[best].argmax())
            far = _too_far(robot, int(robot.leg_columns[i, worst]), found[best, worst])
            words = f"leg '{leg.name}': to stand on its neutral foot {far}; {_REMEDY}"
            return LegwattError(words)
        written = (", ".join(f"{x:.2f}" for x in q[: len(leg.joints)]) for q in good[:_SHOWN])
        offers.append(f"legs.{leg.name}: " + " or ".join(f"[{numbers}]" for numbers in written))
    stated = all(robot.spec.legs[i].start_posture for i in lost)
    what = "start_posture lies on another branch" if stated else "start_posture is missing"
    return LegwattError(
        f"{robot.spec.path}: {what}: from {'there' if stated else 'zero'} the inverse kinematics "
        "does not come to the neutral foot within the limits; these postures do, choose the knee's "
        f"branch: {'; '.join(offers)} [rad]"
    )


def _branches(robot: Robot, leg: int, target: Array) -> tuple[Array, float]:
    """Postures of one leg that reach a point, those nearest to the middle of the limits first.

    Returns shape (B, K) and the least that is left to the point [m].
    """
    chains, count = robot.chains.of([leg]), len(robot.spec.legs[leg].joints)
    low, high = (limit[leg, :count].copy() for limit in robot.leg_limits)
    wide = ~(high - low <= 2 * np.pi) | (high <= low)  # searched over one turn
    low[wide], high[wide] = -np.pi, np.pi
    starts = low + (high - low) * spread(_TRIES, count)
    q, miss = reach(chains, np.broadcast_to(target, (_TRIES, 1, 3)), starts[:, None])
    off = np.linalg.norm(foot_positions(chains, q)[:, 0] - target, axis=-1)
    # Whole turns lead to the same posture; take the one inside the limits.
    middle = (low + high) / 2
    turns = np.where(chains.slides[0], 0.0, np.round((q[:, 0] - middle) / (2 * np.pi)))
    own = q[:, 0] - 2 * np.pi * turns
    near = (off < off.min() + _NEAR) & (miss[:, 0] <= ACCEPTED)
    found: list[Array] = []
    for posture in sorted(own[near], key=lambda x: float(np.abs(x - middle).sum())):
        if all(np.abs(posture - other[:count]).max() > _OTHER for other in found):
            found.append(np.pad(posture, (0, robot.leg_columns.shape[1] - count)))
    return np.array(found), float(off.min())


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
    time, q, target = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
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
