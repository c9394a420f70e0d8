"""A stance to stand and walk about: from a pose that is known, else from one search.

The search puts feet on one level at heights and distances from their hips in rows, sideways or away
from the middle, alike for all legs, and takes of the stances that legs reach within their limits
those of the best mark, a product of four from 0 to 1 of which none may be bad:

- torque: 1 / (1 + (lever / (height / 2))^2), with the lever of a weight on the foot about the
  joints that turn (root of the sum of squares) and the height of the hip over the foot;
- limits: the joint nearest to a limit, in half ranges from it;
- singularity: the smallest singular value of the foot's Jacobian over the largest that the leg has;
- margin of static stability: s / (1 + s), with s its share of that of feet below their hips.

The pace is the longest stroke that the legs can do about the stance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.robot.inverse_kinematics import ACCEPTED, freedoms, reach, spread
from pipeline.robot.kinematics import LegPosture, foot_positions, leg_posture
from pipeline.robot.robot import Robot

#: Feet (1, F, 3) and a point (1, 2) to the point's margin in their hull [m], (1,).
Margin = Callable[[Array, Array], Array]
_POSTURES = 1000  # drawn for each leg, to start inverse kinematics from
_HEIGHTS = np.linspace(0.3, 0.95, 14)  # of the hips, over the mean reach
_AWAY = np.linspace(0.0, 0.7, 8)  # of the feet from their hips, over the mean reach
_CLEAR = 0.1  # share of a joint's range kept from either limit
_ENDLESS = np.pi / 2  # [rad] a joint without limits is searched this far either way
_BELOW = 0.05  # of the leg's reach, by which a foot is lower than its hip
_SINGULAR = 0.25  # of the largest smallest singular value that the leg has
_MIRRORED = 0.02  # of the reach, by which hips may differ from mirror images
_SLACK = 1e-6  # beyond a limit [rad, m]
_SIDEWAYS = np.array([1.0, -1.0, 1.0])  # what mirrors left and right
_REASON = (
    "level feet under their joints, clear of limits and singular postures, that stand firmly and "
    "leave a stroke: the best of a search"
)
_FIRST, _SHRINK, _TRIES = 0.3, 0.85, 20  # strokes over the height of the hips, if the legs allow
_SIDE = 0.25  # room to the sides, over the stroke: the body sways
#: Over the stroke: how far the foot of a leg that lacks a direction may leave its path.
_ASTRAY = 0.25
_PERIOD, _HEIGHT = 2.0, 0.3  # [s] of a robot whose hips are so high [m]


@dataclass(frozen=True)
class Stance:
    """Where the robot stands."""

    feet: Array  #: In the base frame, on one level [m], shape (L, 3).
    posture: Array  #: Of the legs, shape (L, K) [rad, m].
    margin: float  #: Static stability [m].
    levelled: float  #: By how much a foot was raised or lowered to be level [m].
    reason: str  #: Where it is from.


@dataclass(frozen=True)
class Pace:
    """Numbers of a walk."""

    stroke: float  #: Of the feet [m].
    lift: float  #: Of the feet [m].
    period: float  #: [s].


def stance_of_pose(robot: Robot, margin: Margin, posture: Array, reason: str) -> Stance | None:
    """The stance of a pose (L, K), its feet levelled; None where that is out of reach or limits."""
    (feet,) = foot_positions(robot.chains, posture[None])
    level = feet.copy()
    level[:, 2] = feet[:, 2].mean()
    (q,), (miss,) = reach(replace(robot.chains, nominal=posture), level[None], posture)
    if miss.max() > ACCEPTED or not _inside(robot, q):
        return None
    return _stood(robot, margin, q, float(np.abs(feet - level).max()), reason)


def _inside(robot: Robot, q: Array) -> bool:
    lower, upper = robot.leg_limits
    return bool(((q >= lower - _SLACK) & (q <= upper + _SLACK)).all())


def _stood(robot: Robot, margin: Margin, q: Array, levelled: float, reason: str) -> Stance | None:
    (feet,) = foot_positions(robot.chains, q[None])
    held = float(margin(feet[None], _centre(robot, q)[None])[0])
    return Stance(feet, q, held, levelled, reason) if held > 0 else None


def _centre(robot: Robot, posture: Array) -> Array:
    """Centre of mass seen from above, from the base [m], shape (2,)."""
    (q,) = robot.configuration(robot.joint_positions(posture[None]))
    return np.array(pin.centerOfMass(robot.model, robot.model.createData(), q)[:2])


def stances(robot: Robot, margin: Margin) -> Iterator[Stance]:
    """Stances on level feet, those of the best mark first.

    `robot`: with a floating base; of its file only joints, feet and the path are known.

    Raises:
        LegwattError: A leg has no posture that stands.
    """
    chains, (low, high) = robot.chains, _range(robot)
    clear = _CLEAR * (high - low)
    shares = spread(_POSTURES, low.shape[1])[:, None]
    drawn = np.where(chains.real, low + clear + (high - low - 2 * clear) * shares, 0.0)
    legs = leg_posture(chains, drawn)
    largest = _smallest(robot, legs).max(axis=0)
    stands = _marks(robot, drawn, legs, largest) > 0
    if not stands.any(axis=0).all():
        leg = chains.names[int(stands.any(axis=0).argmin())]
        raise LegwattError(
            f"{robot.spec.path}: no posture of leg '{leg}' within its limits puts its foot below "
            "its hip; name other feet with --foot, or give a pose 'standing' in an SRDF beside "
            "the URDF"
        )
    target = _targets(chains.hips, float(chains.reach.mean()))
    chosen = np.array([_nearest(robot, legs, stands, each) for each in target])
    start = np.take_along_axis(drawn, chosen[..., None], axis=0)
    middle = np.where(chains.real, (low + high) / 2, 0.0)
    q, miss = reach(replace(chains, nominal=middle), target, start)
    marks = _marks(robot, q, leg_posture(chains, q), largest)
    marks[miss > ACCEPTED] = 0.0
    centre = _centre(robot, middle)
    usual = max(float(margin(chains.hips[None], centre[None])[0]), 0.03 * chains.reach.min())
    found = []
    for posture, mark in zip(q, np.prod(marks, axis=1) ** (1 / len(chains.names)), strict=True):
        stance = _stood(robot, margin, posture, 0.0, _REASON) if mark > 0 else None
        if stance is not None and _inside(robot, posture):
            share = stance.margin / usual
            found.append((mark * share / (1 + share), stance))
    yield from (stance for _, stance in sorted(found, key=lambda one: -one[0]))


def _range(robot: Robot) -> tuple[Array, Array]:
    """Where postures are sought, each (L, K)."""
    chains, (lower, upper) = robot.chains, robot.leg_limits
    far = np.where(chains.slides, 0.2 * chains.reach[:, None], _ENDLESS)
    low, high = np.maximum(lower, -np.pi), np.minimum(upper, np.pi)
    return np.where(_limited(robot), low, -far), np.where(_limited(robot), high, far)


def _limited(robot: Robot) -> NDArray[np.bool_]:
    """Which joints have limits that are any, shape (L, K)."""
    lower, upper = robot.leg_limits
    return np.asarray((upper > lower) & (upper - lower < 4 * np.pi))


def _smallest(robot: Robot, legs: LegPosture) -> Array:
    """Smallest singular value among the directions that a leg has, shape (M, L)."""
    values = np.linalg.svd(legs.columns, compute_uv=False)
    last = [own.directions - 1 for own in freedoms(robot.chains)]
    return np.asarray(values[:, range(len(last)), last])


def _marks(robot: Robot, q: Array, legs: LegPosture, largest: Array) -> Array:
    """For torque, limits and singularity of each leg, shape (M, L); zero of one that stands not.

    `q`: postures, shape (M, L, K). `largest`: the smallest singular value at its best, (L,).
    """
    chains, (low, high) = robot.chains, _range(robot)
    half = np.where(_limited(robot), (high - low) / 2, 1.0)
    room = np.where(_limited(robot), np.minimum(q - low, high - q) / half, 1.0)
    height = np.maximum(chains.hips[:, 2] - legs.feet[..., 2], 1e-9)
    lever = np.linalg.norm(np.where(chains.slides, 0.0, legs.columns[..., 2]), axis=-1)
    share = _smallest(robot, legs) / largest
    marks = np.clip(room.min(axis=-1), 0.0, 1.0) * share / (1 + (lever / (height / 2)) ** 2)
    return np.where((share >= _SINGULAR) & (height >= _BELOW * chains.reach), marks, 0.0)


def _targets(hips: Array, size: float) -> Array:
    """Feet on one level, in the base frame [m], shape (M, L, 3)."""
    sideways = np.sign(np.round(hips[:, 1:2] / size, 3)) * [0.0, 1.0, 0.0]
    apart = (hips - hips.mean(axis=0)) * [1.0, 1.0, 0.0]
    apart /= np.maximum(np.linalg.norm(apart, axis=1, keepdims=True), 1e-9)
    out = []
    for height, away, way in product(_HEIGHTS, _AWAY, (sideways, apart)):
        feet = hips + away * size * way
        feet[:, 2] = hips[:, 2].mean() - height * size
        out.append(feet)
    return np.array(out)


def _nearest(robot: Robot, legs: LegPosture, stands: NDArray[np.bool_], target: Array) -> list[int]:
    """The drawn posture of every leg that is nearest to feet (L, 3); right as left, knee and all.

    Which way a knee bends shows in J J^T, which a mirror image has with other signs.
    """
    chains = robot.chains
    flip, gram = np.diag(_SIDEWAYS), legs.columns.swapaxes(-1, -2) @ legs.columns
    chosen: list[int] = []
    for leg, reached in enumerate(chains.reach):
        off = np.linalg.norm(legs.feet[:, leg] - target[leg], axis=-1) / reached
        for other in range(leg):
            if np.linalg.norm(target[leg] - target[other] * _SIDEWAYS) <= _MIRRORED * reached:
                mirrored = flip @ gram[chosen[other], other] @ flip
                off += np.linalg.norm(gram[:, leg] - mirrored, axis=(1, 2)) / reached**2
        chosen.append(int(np.where(stands[:, leg], off, np.inf).argmin()))
    return chosen


def find_pace(robot: Robot, stance: Stance) -> Pace | None:
    """The longest stroke of a row of shorter and shorter ones that every leg can do.

    Returns None where the legs cannot take even the shortest.
    """
    chains = replace(robot.chains, nominal=stance.posture)
    height = float((chains.hips[:, 2] - stance.feet[:, 2]).mean())
    follows = np.array([not own.lacks for own in freedoms(chains)])
    room = np.where(follows[:, None], 1.0, [1.0, 0.0, 1.0])  # which corners a leg is to reach
    corners = np.array(list(product((-1, 0, 1), (-1, 0, 1), (0, 1))))[:, None]
    # A leg that lacks a direction leaves its path when it lifts its foot: less lift, less of that.
    shares = (0.4,) if follows.all() else (0.4, 0.2, 0.1)
    for k, share in product(range(_TRIES), shares):
        stroke = _rounded(_FIRST * height * _SHRINK**k)
        lift = _rounded(share * stroke)
        target = stance.feet + corners * [stroke / 2, _SIDE * stroke, lift] * room
        q, miss = reach(chains, target, stance.posture)
        off = np.linalg.norm(foot_positions(chains, q) - target, axis=-1)
        if miss.max() <= ACCEPTED and off.max() <= _ASTRAY * stroke and _inside(robot, q):
            # Robots of one shape walk alike where the period goes with the root of height.
            return Pace(stroke, lift, _rounded(_PERIOD * (height / _HEIGHT) ** 0.5))
    return None


def _rounded(value: float) -> float:
    """Two significant digits."""
    return float(f"{value:.2g}")
