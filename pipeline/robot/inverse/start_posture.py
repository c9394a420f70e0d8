"""The posture from which every leg's inverse kinematics starts: it names the knee's branch.

A leg of three joints reaches a point in several postures. Which one is meant stands in the robot
file, as ``start_posture``; zero is taken where it does not. Where the iteration does not come from
there to the neutral foot inside the joints' limits, every branch is sought, so that a branch that
is merely not named is not called a foot out of reach.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.errors import GaitError
from pipeline.robot.inverse.inverse_kinematics import ACCEPTED, beyond_reach, reach, solve_positions
from pipeline.robot.inverse.least_motion import approach, freedoms, spread
from pipeline.robot.robot import Robot

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
        OutOfReachError: No posture of a leg reaches its neutral foot.
        GaitError: Only other branches than that of ``start_posture`` do, or only beyond a joint's
            limits; offers postures to choose from.
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
        OutOfReachError: A foot is not reached.
        GaitError: Only on another branch than the robot file names.
    """
    start = neutral_postures(robot)
    if np.array_equal(target, [leg.neutral_foot for leg in robot.spec.legs]):
        return start
    q: Array = solve_positions(robot.chains, target[None], start, np.zeros(1))[0]
    return q


def refuse_beyond_limits(
    robot: Robot,
    q: Array,
    time: Array,
    remedy: str = _REMEDY,
) -> None:
    """Refuse joint positions outside the URDF's limits.

    `q`: joint positions [rad, m], shape (N, J). `time`: for messages [s], shape (N,).

    Raises:
        GaitError: One lies beyond; names joint, instant and limits.
    """
    lower, upper = robot.limits
    beyond = np.maximum(q - upper, lower - q)
    if beyond.max() <= 1e-9:
        return
    sample, joint = np.unravel_index(int(beyond.argmax()), beyond.shape)
    at = f" at t = {time[sample]:.4g} s"
    raise GaitError(f"{_too_far(robot, int(joint), q[sample, joint], at)}; {remedy}")


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
            return GaitError(words)
        written = (", ".join(f"{float(x):.2f}" for x in q) for q in good[:_SHOWN])
        shown = " or ".join(f"[{numbers}]" for numbers in written)
        offers.append(f"legs.{leg.name}: {shown}")
    stated = all(robot.spec.legs[i].start_posture for i in lost)
    what = "start_posture lies on another branch" if stated else "start_posture is missing"
    return GaitError(
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
