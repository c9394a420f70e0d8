"""A stance to stand and walk about: from a pose that is known, else from a search.

The search draws postures of every leg inside its limits, keeps those that stand (the foot below
every joint of its leg, away from singular postures and from limits), and of feet on one level takes
those of the best mark, a product of four marks from 0 to 1 of which none may be bad:

- torque: 1 / (1 + (lever / (height / 2))^2), with the lever of a weight on the foot about the
  joints that turn (root of the sum of squares) and the height of the hip over the foot. A foot
  under its joints has 1; the largest margin for itself would put feet as far out as legs reach;
- limits: the joint nearest to a limit, in half ranges from it;
- singularity: the smallest singular value of the foot's Jacobian over the largest that the leg has;
- margin of static stability: s / (1 + s), with s its share of that of feet below their hips.

Legs are chosen one after the other, each against the margin that the others leave, twice round.

Right legs mirror left ones where their hips do. Postures drawn by chance stand a little before or
behind their hips: where front hips mirror rear ones, each foot moves to the middle between its
place and the mirror image of its counterpart's, if the legs reach it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.robot.inverse.inverse_kinematics import ACCEPTED, reach
from pipeline.robot.inverse.least_motion import freedoms, spread
from pipeline.robot.kinematics import foot_jacobians, foot_positions
from pipeline.robot.leg_chains import LegChains
from pipeline.robot.robot import Robot

#: Feet (1, F, 3) and a point (1, 2) to the point's margin in their hull [m], (1,).
Margin = Callable[[Array, Array], Array]
_POSTURES = 4000  # drawn for each leg
_HEIGHTS = 25
_CLEAR = 0.1  # share of a joint's range kept from either limit
_ENDLESS = np.pi / 2  # [rad] a joint without limits is searched this far either way
_BELOW = 0.05  # of the leg's reach, by which a foot is lower than its leg's joints
_SINGULAR = 0.25  # of the largest smallest singular value that the leg has
_LEVEL = 0.03  # of the reach: feet within that are of one height, before they are levelled
_MIRRORED = 0.02  # of the reach
_ROUNDS = 2  # over the legs, at each height
_SLACK = 1e-6  # beyond a limit [rad, m]
_SIDEWAYS = np.array([1.0, -1.0, 1.0])  # what mirrors left and right
_REASON = (
    "level feet under their joints, clear of limits and singular postures, that stand firmly and "
    f"leave a stroke: the best of a search of {_POSTURES} postures of each leg"
)


@dataclass(frozen=True)
class Stance:
    """Where the robot stands."""

    feet: Array  #: In the base frame, on one level [m], shape (L, 3).
    posture: Array  #: Of the legs, shape (L, K) [rad, m].
    margin: float  #: Static stability [m].
    levelled: float  #: By how much a foot was raised or lowered to be level [m].
    reason: str  #: Where it is from.


@dataclass(frozen=True)
class _Drawn:
    """Postures that were drawn, M of each leg."""

    q: Array  #: Shape (M, L, K) [rad, m].
    feet: Array  #: Shape (M, L, 3) [m].
    origins: Array  #: Of their joints, shape (M, L, K, 3) [m].
    #: For torque, limits and singularity, shape (M, L); negative where one does not stand.
    marks: Array


@dataclass(frozen=True)
class Standing:
    """A robot whose stance is sought."""

    robot: Robot  #: With a floating base; of its file only joints, feet and the path are known.
    margin: Margin  #: Of static stability.

    @property
    def chains(self) -> LegChains:
        """Its legs."""
        return self.robot.chains

    @cached_property
    def _limited(self) -> tuple[NDArray[np.bool_], Array, Array]:
        """Which joints have limits that are any, and these within a turn, each (L, K)."""
        lower, upper = self.robot.leg_limits
        limited = np.isfinite(lower) & np.isfinite(upper) & (upper - lower < 4 * np.pi)
        limited &= upper > lower
        return limited, np.maximum(lower, -np.pi), np.minimum(upper, np.pi)

    @cached_property
    def _range(self) -> tuple[Array, Array]:
        """Where postures are drawn, each (L, K)."""
        limited, lower, upper = self._limited
        far = np.where(self.chains.slides.T, 0.2 * self.chains.reach[:, None], _ENDLESS)
        low, high = np.where(limited, lower, -far), np.where(limited, upper, far)
        clear = _CLEAR * (high - low)
        return low + clear, high - clear

    @cached_property
    def _pairs(self) -> dict[int, int]:
        """Right legs whose hip mirrors an earlier leg's, and that leg."""
        hips, size = self.chains.offset[0], self.chains.reach
        pairs: dict[int, int] = {}
        for leg, near in enumerate(_MIRRORED * size):
            for other in range(leg if hips[leg, 1] != 0 else 0):
                apart = np.linalg.norm(hips[leg] * _SIDEWAYS - hips[other])
                if apart <= near and abs(size[leg] - size[other]) <= near:
                    pairs[leg] = other
        return pairs

    def of_pose(self, posture: Array, reason: str) -> Stance | None:
        """The stance of a pose, its feet levelled; None where that is out of reach or limits."""
        feet = foot_positions(self.chains, posture[None])[0]
        level = feet.copy()
        level[:, 2] = feet[:, 2].mean()
        return self._reached(level, posture, reason, float(np.abs(feet - level).max()))

    def candidates(self) -> Iterator[Stance]:
        """Stances among the postures drawn, those of the best mark first.

        Raises:
            LegwattError: A leg has no posture that stands.
        """
        drawn, least = self._drawn()
        stands = drawn.marks >= 0
        heights = np.where(stands, drawn.feet[..., 2], np.nan)
        lowest, highest = np.nanmin(heights, axis=0).max(), np.nanmax(heights, axis=0).min()
        found = []
        for height in np.linspace(lowest, highest, _HEIGHTS):
            near = np.abs(drawn.feet[..., 2] - height) <= _LEVEL * self.chains.reach
            near &= drawn.marks > 0
            if near.any(axis=0).all():
                found.append(self._best(drawn, near, float(height)))
        for _, level, posture in sorted(found, key=lambda one: one[0], reverse=True):
            for feet in (self._balanced(level), level):
                stance = self._reached(feet, posture, _REASON, 0.0)
                if stance and (self._smallest(stance.posture[None])[0] >= least).all():
                    yield stance
                    break

    def _reached(self, feet: Array, start: Array, reason: str, levelled: float) -> Stance | None:
        q, miss = reach(replace(self.chains, nominal=start), feet[None], start)
        (posture,), (lower, upper) = q, self.robot.leg_limits
        inside = (posture >= lower - _SLACK) & (posture <= upper + _SLACK)
        if miss.max() > ACCEPTED or not inside.all():
            return None
        stood = foot_positions(self.chains, q)
        margin = float(self.margin(stood, self._centre(posture)[None, :2])[0])
        return Stance(stood[0], posture, margin, levelled, reason) if margin > 0 else None

    def _centre(self, posture: Array) -> Array:
        """Centre of mass in the base frame [m], shape (3,)."""
        robot = self.robot
        (q,) = robot.configuration(robot.joint_positions(posture[None]))
        return np.array(pin.centerOfMass(robot.model, robot.model.createData(), q))

    def _drawn(self) -> tuple[_Drawn, Array]:
        """Postures of every leg, and the least singular value that is not singular, (L,)."""
        chains, (limited, lower, upper), (low, high) = self.chains, self._limited, self._range
        q = low + (high - low) * spread(_POSTURES, chains.depth)[:, None, :]
        q = np.where(chains.real, q, 0.0)
        inner = (
            replace(chains.shortened(j), foot=chains.offset[j]) for j in range(1, chains.depth)
        )
        outer = [foot_positions(each, q[..., : each.depth]) for each in inner]
        first = np.broadcast_to(chains.offset[0], (q.shape[0], *chains.offset[0].shape))
        feet, origins = foot_positions(chains, q), np.stack([first, *outer], axis=2)
        smallest = self._smallest(q)
        least = _SINGULAR * smallest.max(axis=0)
        height = origins[..., 2].min(axis=2) - feet[..., 2]
        stands = (height >= _BELOW * chains.reach) & (smallest >= least)
        if not stands.any(axis=0).all():
            leg = chains.names[int(stands.any(axis=0).argmin())]
            raise LegwattError(
                f"{self.robot.spec.path}: no posture of leg '{leg}' within its limits puts its "
                "foot below its joints and under the hip; name other feet with --foot, or give a "
                "pose 'standing' in an SRDF beside the URDF"
            )
        hips = np.maximum(chains.offset[0, :, 2] - feet[..., 2], 1e-9)
        rise = foot_jacobians(chains, q)[1][..., 2, :]  # of the foot by every joint, (M, L, K)
        lever = np.linalg.norm(np.where(chains.slides.T, 0.0, rise), axis=-1)
        half = np.where(limited, (upper - lower) / 2, 1.0)
        room = np.where(limited, np.minimum(q - lower, upper - q) / half, 1.0).min(axis=-1)
        marks = np.clip(room, 0.0, 1.0) * (smallest / smallest.max(axis=0))
        marks /= 1 + (lever / (hips / 2)) ** 2
        return _Drawn(q, feet, origins, np.where(stands, marks, -1.0)), least

    @cached_property
    def _usual(self) -> tuple[Array, float]:
        """Centre of mass of legs in the middle (2,), and the margin of feet below hips [m]."""
        low, high = self._range
        centre = self._centre(np.where(self.chains.real, (low + high) / 2, 0.0))[:2]
        hips = float(self.margin(self.chains.offset[0][None], centre[None])[0])
        return centre, max(hips, _LEVEL * self.chains.reach.min())  # hips may surround no area

    def _smallest(self, q: Array) -> Array:
        """Smallest singular value among the directions that a leg has, shape (M, L)."""
        values = np.linalg.svd(foot_jacobians(self.chains, q)[1], compute_uv=False)
        last = [own.directions - 1 for own in freedoms(self.chains)]
        return np.asarray(values[:, range(len(last)), last])

    def _best(
        self, drawn: _Drawn, near: NDArray[np.bool_], height: float
    ) -> tuple[float, Array, Array]:
        """The postures of the best mark with feet at a height."""
        pairs, n_legs, marks = self._pairs, near.shape[1], drawn.marks
        centre, usual = self._usual
        chosen = np.where(near, marks, -1.0).argmax(axis=0)
        level = drawn.feet[chosen, range(n_legs)]
        for leg, other in pairs.items():
            level[leg] = level[other] * _SIDEWAYS
        level[:, 2] = height
        mark = 0.0
        for leg in [leg for leg in range(n_legs) if leg not in pairs] * _ROUNDS:
            own = np.flatnonzero(near[:, leg])
            tried = np.repeat(level[None], own.size, axis=0)
            tried[:, leg, :2] = drawn.feet[own, leg, :2]
            for other in (k for k, first in pairs.items() if first == leg):
                tried[:, other, :2] = drawn.feet[own, leg, :2] * _SIDEWAYS[:2]
            share = np.maximum(self.margin(tried, np.tile(centre, (own.size, 1))) / usual, 0.0)
            rest = [k for k in range(n_legs) if k != leg and pairs.get(k) != leg]
            logs = np.log(marks[chosen[rest], rest]).sum()
            logs = logs + (n_legs - len(rest)) * np.log(marks[own, leg])
            all_marks = np.exp(logs / n_legs) * share / (1 + share)
            best = int(all_marks.argmax())
            mark, chosen[leg], level = float(all_marks[best]), own[best], tried[best]
        for leg, other in pairs.items():  # in the mirror image of the left leg, knee and all
            own, k = np.flatnonzero(near[:, leg]), chosen[other]
            bent = drawn.origins[own, leg] - _SIDEWAYS * drawn.origins[k, other]
            foot = drawn.feet[own, leg] - _SIDEWAYS * drawn.feet[k, other]
            apart = np.linalg.norm(bent, axis=-1).sum(-1) + np.linalg.norm(foot, axis=-1)
            chosen[leg] = own[int(apart.argmin())]
        return mark, level, drawn.q[chosen, range(n_legs)]

    def _balanced(self, feet: Array) -> Array:
        """Feet with front and rear as mirror images, shape (L, 3) [m]; as they are without such."""
        hips, size = self.chains.offset[0], self.chains.reach
        there, back = np.array([2.0 * hips[:, 0].mean(), 0.0, 0.0]), [-1.0, 1.0, 1.0]
        apart = np.linalg.norm((there + hips * back)[:, None] - hips, axis=-1)
        other = apart.argmin(axis=1)
        off = np.maximum(apart.min(axis=1), np.abs(size - size[other]))
        if (off > _MIRRORED * size).any() or (other[other] != np.arange(other.size)).any():
            return feet
        return np.asarray((feet + there + feet[other] * back) / 2)
