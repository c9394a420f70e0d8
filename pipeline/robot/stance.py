"""A stance to stand and walk about: of a pose that is known, else from one search.

The search puts feet on one level at heights and distances from their hips, sideways or away from
the middle, alike for all legs, and takes of the stances that legs reach within their limits those
of the best mark, a product of four from 0 to 1 of which none may be bad:

- torque: 1 / (1 + (lever / (height / 2))^2), with the lever of a weight on the foot about the
  joints that turn (root of the sum of squares) and the height of the hip over the foot;
- limits: the joint nearest to a limit, in half ranges from it;
- singularity: the smallest singular value of the foot's Jacobian over the largest that the leg has;
- static stability: s / (1 + s), with s the margin of the centre of mass in the feet's hull over a
  fifth of the legs' reach.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.robot.kinematics import (
    ACCEPTED,
    LegPosture,
    directions,
    foot_positions,
    leg_posture,
    reach,
    support_margin,
)
from pipeline.robot.robot import Robot

_POSTURES = 1000  # drawn for each leg, to start inverse kinematics from
_HEIGHTS = np.linspace(0.3, 0.95, 14)  # of the hips, over the mean reach
_AWAY = np.linspace(0.0, 0.7, 8)  # of the feet from their hips, over the mean reach
_CLEAR = 0.1  # share of a joint's range kept from either limit
_ENDLESS = np.pi / 2  # [rad] a joint without limits is searched this far either way
_BELOW = 0.05  # of the leg's reach, by which a foot is lower than its hip
_SINGULAR = 0.25  # of the largest smallest singular value that the leg has
_MIRRORED = 0.02  # of the reach, by which hips may differ from mirror images
_SIDEWAYS = np.array([1.0, -1.0, 1.0])  # what mirrors left and right
_FIRM = 0.2  # of the mean reach: a margin of static stability that is good
_REASON = (
    "level feet under their joints, clear of limits and singular postures: the best of a search"
)


@dataclass(frozen=True)
class Stance:
    """Where the robot stands."""

    feet: Array  #: In the base frame, on one level [m], shape (L, 3).
    posture: Array  #: Of the legs, shape (L, K) [rad, m].
    reason: str  #: Where it is from.


def stance_of_pose(robot: Robot, posture: Array, reason: str) -> Stance | None:
    """The stance of a pose (L, K), its feet levelled; None where that is out of reach or limits."""
    (level,) = foot_positions(robot.chains, posture[None])
    level[:, 2] = level[:, 2].mean()
    q, miss = reach(robot.chains, level[None], posture)
    if miss.max() > ACCEPTED or not _inside(robot, q)[0]:
        return None
    return Stance(foot_positions(robot.chains, q)[0], q[0], f"{reason}, feet levelled")


def searched(robot: Robot) -> list[Stance]:
    """Stances on level feet, those of the best mark first.

    `robot`: with a floating base; of its file only joints, feet and the path are known.

    Raises:
        LegwattError: A leg has no posture that stands, or the legs none on one level.
    """
    chains, (low, high, _) = robot.chains, _range(robot)
    middle = np.where(chains.real, (low + high) / 2, 0.0)[None]
    shares = np.random.default_rng(0).uniform(_CLEAR, 1 - _CLEAR, (_POSTURES, 1, low.shape[1]))
    drawn = np.where(chains.real, low + (high - low) * shares, 0.0)
    legs = leg_posture(chains, drawn)
    largest = _smallest(robot, legs).max(axis=0)
    stands = _marks(robot, drawn, legs, largest) > 0
    remedy = "name other feet, or give a pose 'standing' in an SRDF beside the URDF"
    where = robot.spec.path
    if not stands.any(axis=0).all():
        leg = chains.names[int(stands.any(axis=0).argmin())]
        raise LegwattError(
            f"{where}: no posture of leg '{leg}' has its foot below its hip; {remedy}"
        )
    target = _targets(chains.hips, float(chains.reach.mean()))
    chosen = np.array([_nearest(robot, legs, stands, each) for each in target])
    q, miss = reach(chains, target, np.take_along_axis(drawn, chosen[..., None], axis=0))
    marks = _marks(robot, q, leg_posture(chains, q), largest)
    marks[(miss > ACCEPTED).any(axis=1) | ~_inside(robot, q)] = 0.0
    feet, (usual,) = foot_positions(chains, q), robot.configuration(robot.joint_positions(middle))
    centre = pin.centerOfMass(robot.model, robot.model.createData(), usual)[:2]
    margin = support_margin(feet, np.broadcast_to(centre, (len(feet), 2)))
    firm = np.maximum(margin, 0.0) / (_FIRM * chains.reach.mean())
    whole = np.prod(marks, axis=1) ** (1 / len(chains.names)) * firm / (1 + firm)
    best = [k for k in np.argsort(-whole, kind="stable") if whole[k] > 0]
    if not best:
        raise LegwattError(f"{where}: no stance within limits has all feet on one level; {remedy}")
    return [Stance(feet[k], q[k], _REASON) for k in best]


def _inside(robot: Robot, q: Array) -> NDArray[np.bool_]:
    """Which postures (N, L, K) keep the limits, shape (N,)."""
    lower, upper = map(robot.chains.of_legs, robot.limits)
    within = (q >= lower - ACCEPTED) & (q <= upper + ACCEPTED)
    return np.asarray(within.all(axis=(1, 2)))


def _range(robot: Robot) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Where postures are sought, each (L, K), and which joints have limits that are any."""
    lower, upper = map(robot.chains.of_legs, robot.limits)
    limited = np.asarray((upper > lower) & (upper - lower < 4 * np.pi))
    far = np.where(robot.chains.of_legs(robot.sliding), 0.2 * robot.chains.reach[:, None], _ENDLESS)
    low = np.where(limited, np.maximum(lower, -np.pi), -far)
    return low, np.where(limited, np.minimum(upper, np.pi), far), limited


def _smallest(robot: Robot, legs: LegPosture) -> Array:
    """Smallest singular value among the directions that a leg has, shape (M, L)."""
    last = directions(robot.chains) - 1
    return np.asarray(np.linalg.svd(legs.columns, compute_uv=False)[:, range(len(last)), last])


def _marks(robot: Robot, q: Array, legs: LegPosture, largest: Array) -> Array:
    """For torque, limits and singularity of each leg, shape (M, L); zero of one that stands not.

    `q`: postures, shape (M, L, K). `largest`: the smallest singular value at its best, (L,).
    """
    chains, (low, high, limited) = robot.chains, _range(robot)
    room = np.where(limited, 2 * np.minimum(q - low, high - q) / (high - low), 1.0)
    height = np.maximum(chains.hips[:, 2] - legs.feet[..., 2], 1e-9)
    slides = chains.of_legs(robot.sliding)
    lever = np.linalg.norm(np.where(slides, 0.0, legs.columns[..., 2]), axis=-1)
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
