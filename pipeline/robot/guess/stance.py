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

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.errors import RobotFileError
from pipeline.robot.inverse.least_motion import freedoms
from pipeline.robot.inverse.start_posture import spread
from pipeline.robot.inverse_kinematics import ACCEPTED, reach
from pipeline.robot.kinematics import foot_jacobians, foot_positions
from pipeline.robot.leg_chains import LegChains
from pipeline.robot.leg_columns import LegColumns

Array = NDArray[np.float64]
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


@dataclass(frozen=True)
class Stance:
    """Where the robot stands.

    Attributes:
        feet: In the base frame, on one level [m], shape (L, 3).
        posture: Of the legs, shape (L, K) [rad, m].
        margin: Static stability [m].
        levelled: By how much a foot was raised or lowered to be level [m].
        reason: Where it is from.
    """

    feet: Array
    posture: Array
    margin: float
    levelled: float
    reason: str


class Standing:
    """A robot whose stance is sought.

    Args:
        model: With a floating base.
        chains: Its legs.
        layout: Their joints among the columns.
        columns: Of the joints in Pinocchio's configuration, shape (J,).
        held: Positions of all joints for those outside the legs, shape (J,) [rad, m].
        margin: Of static stability.
        where: File, for messages.
    """

    def __init__(
        self,
        model: pin.Model,
        chains: LegChains,
        layout: LegColumns,
        columns: NDArray[np.intp],
        held: Array,
        margin: Margin,
        where: str,
    ) -> None:
        self.model, self.chains, self.layout = model, chains, layout
        self.columns, self.held, self.margin, self.where = columns, held, margin, where
        lower, upper = model.lowerPositionLimit[columns], model.upperPositionLimit[columns]
        self.lower, self.upper = (layout.by_leg(x[None])[0] for x in (lower, upper))

    def of_pose(self, posture: Array, reason: str) -> Stance | None:
        """The stance of a pose, its feet levelled; None where that is out of reach or limits."""
        feet = foot_positions(self.chains, posture[None])[0]
        level = feet.copy()
        level[:, 2] = feet[:, 2].mean()
        return self._reached(level, posture, reason, float(np.abs(feet - level).max()))

    def _reached(self, feet: Array, start: Array, reason: str, levelled: float) -> Stance | None:
        chains = replace(self.chains, nominal=start)
        q, miss = reach(chains, feet[None], start)
        posture = q[0]
        slack = 1e-6
        inside = (posture >= self.lower - slack) & (posture <= self.upper + slack)
        if miss.max() > ACCEPTED or not (inside | ~self.layout.real).all():
            return None
        stood = foot_positions(self.chains, q)[0]
        margin = self._margin(stood, posture)
        if margin <= 0:
            return None
        return Stance(stood, posture, margin, levelled, reason)

    def _margin(self, feet: Array, posture: Array) -> float:
        return float(self.margin(feet[None], self._centre(posture)[None, :2])[0])

    def _centre(self, posture: Array) -> Array:
        """Centre of mass in the base frame [m], shape (3,)."""
        q = pin.neutral(self.model)
        q[self.columns] = self.layout.by_joint(posture[None], self.held)[0]
        return np.array(pin.centerOfMass(self.model, self.model.createData(), q))

    def candidates(self) -> Iterator[Stance]:
        """Stances among the postures drawn, those of the best mark first.

        Raises:
            RobotFileError: A leg has no posture that stands.
        """
        chains, n_legs = self.chains, len(self.chains.names)
        low, high = self._range()
        q = low + (high - low) * spread(_POSTURES, chains.depth)[:, None, :]
        q = np.where(chains.real, q, 0.0)
        origins = _origins(chains, q)  # (M, L, K, 3)
        feet = foot_positions(chains, q)
        smallest = self._smallest(q)
        regular = _SINGULAR * smallest.max(axis=0)
        stands = self._stands(feet, origins) & (smallest >= regular)
        if not stands.any(axis=0).all():
            raise self._no_posture(int(stands.any(axis=0).argmin()))
        marks = np.where(stands, self._marks(q, feet, smallest / smallest.max(axis=0)), -1.0)
        heights = np.where(stands, feet[..., 2], np.nan)
        lowest, highest = np.nanmin(heights, axis=0).max(), np.nanmax(heights, axis=0).min()
        centre = self._centre(np.where(chains.real, (low + high) / 2, 0.0))
        hips = float(self.margin(chains.offset[0][None], centre[None, :2])[0])
        usual = max(hips, _LEVEL * chains.reach.min())  # hips may surround no area
        found: list[tuple[float, Array, Array]] = []
        for height in np.linspace(lowest, highest, _HEIGHTS):
            stood = self._best(feet, origins, marks, float(height), (centre, usual))
            if stood is not None:
                mark, chosen, level = stood
                found.append((mark, level, q[chosen, range(n_legs)]))
        reason = (
            "level feet under their joints, clear of limits and singular postures, that stand "
            f"firmly and leave a stroke: the best of a search of {_POSTURES} postures of each leg"
        )
        for _, level, posture in sorted(found, key=lambda one: one[0], reverse=True):
            for feet in (self._balanced(level), level):
                stance = self._reached(feet, posture, reason, 0.0)
                if stance and (self._smallest(stance.posture[None])[0] >= regular).all():
                    yield stance
                    break

    def _marks(self, q: Array, feet: Array, regular: Array) -> Array:
        """Of postures by leg: torque, limits and singularity, shape (M, L)."""
        chains = self.chains
        hips = np.maximum(chains.offset[0, :, 2] - feet[..., 2], 1e-9)
        rise = foot_jacobians(chains, q)[1][..., 2, :]  # of the foot by every joint, (M, L, K)
        lever = np.linalg.norm(np.where(chains.slides.T, 0.0, rise), axis=-1)
        limited, low, high = self._limited()
        half = np.where(limited, (high - low) / 2, 1.0)
        clear = np.where(limited, np.minimum(q - low, high - q) / half, 1.0).min(axis=-1)
        marks: Array = np.clip(clear, 0.0, 1.0) * regular / (1 + (lever / (hips / 2)) ** 2)
        return marks

    def _no_posture(self, leg: int) -> RobotFileError:
        return RobotFileError(
            f"{self.where}: no posture of leg '{self.chains.names[leg]}' within its limits puts "
            "its foot below its joints and under the hip; name other feet with --foot, or give a "
            "pose 'standing' in an SRDF beside the URDF"
        )

    def _limited(self) -> tuple[NDArray[np.bool_], Array, Array]:
        """Which joints have limits that are any, and these within a turn, each (L, K)."""
        lower, upper = self.lower, self.upper
        limited = np.isfinite(lower) & np.isfinite(upper) & (upper - lower < 4 * np.pi)
        limited &= upper > lower
        return limited, np.maximum(lower, -np.pi), np.minimum(upper, np.pi)

    def _range(self) -> tuple[Array, Array]:
        """Where postures are drawn, each (L, K)."""
        limited, lower, upper = self._limited()
        far = np.where(self.chains.slides.T, 0.2 * self.chains.reach[:, None], _ENDLESS)
        lower, upper = np.where(limited, lower, -far), np.where(limited, upper, far)
        clear = _CLEAR * (upper - lower)
        return lower + clear, upper - clear

    def _stands(self, feet: Array, origins: Array) -> NDArray[np.bool_]:
        """Which postures of which legs have the foot below all of the leg, shape (M, L)."""
        height = origins[..., 2].min(axis=2) - feet[..., 2]
        return np.asarray(height >= _BELOW * self.chains.reach)

    def _smallest(self, q: Array) -> Array:
        """Smallest singular value among the directions that a leg has, shape (M, L)."""
        values = np.linalg.svd(foot_jacobians(self.chains, q)[1], compute_uv=False)
        last = [own.directions - 1 for own in freedoms(self.chains)]
        return np.asarray(values[:, range(len(last)), last])

    def _best(
        self,
        feet: Array,
        origins: Array,
        marks: Array,
        height: float,
        about: tuple[Array, float],
    ) -> tuple[float, NDArray[np.intp], Array] | None:
        """The postures of the best mark with feet at a height; None where a leg has none.

        Args:
            feet: Of all postures, shape (M, L, 3) [m].
            origins: Of their joints, shape (M, L, K, 3) [m].
            marks: Of the postures by leg, shape (M, L); negative where they do not stand.
            height: Of the feet in the base frame [m].
            about: Centre of mass and margin of feet below their hips [m].

        Returns:
            The mark, of every leg a posture's index, and their feet, levelled (L, 3) [m].
        """
        chains, pairs = self.chains, self._pairs()
        n_legs = len(chains.names)
        near = (np.abs(feet[..., 2] - height) <= _LEVEL * chains.reach) & (marks > 0)
        if not near.any(axis=0).all():
            return None
        centre, usual = about
        chosen = np.where(near, marks, -1.0).argmax(axis=0)
        level = self._mirror(feet[chosen, range(n_legs)])
        level[:, 2] = height
        mark = 0.0
        for leg in [leg for leg in range(n_legs) if leg not in pairs] * _ROUNDS:
            own = np.flatnonzero(near[:, leg])
            tried = np.repeat(level[None], own.size, axis=0)
            tried[:, leg, :2] = feet[own, leg, :2]
            for other in (k for k, first in pairs.items() if first == leg):
                tried[:, other, :2] = feet[own, leg, :2] * [1, -1]
            share = self.margin(tried, np.repeat(centre[None, :2], own.size, axis=0)) / usual
            share = np.maximum(share, 0.0)
            rest = [k for k in range(n_legs) if k != leg and pairs.get(k) != leg]
            others = np.log(marks[chosen[rest], rest]).sum()
            legs = np.exp((others + (n_legs - len(rest)) * np.log(marks[own, leg])) / n_legs)
            best = int((legs * share / (1 + share)).argmax())
            mark = float((legs * share / (1 + share))[best])
            chosen[leg], level = own[best], tried[best]
        return mark, self._partners(chosen, feet, origins, near), level

    def _partners(
        self, chosen: NDArray[np.intp], feet: Array, origins: Array, near: NDArray[np.bool_]
    ) -> NDArray[np.intp]:
        """Right legs in the mirror image of their left ones, knee and all."""
        flip = np.array([1.0, -1.0, 1.0])
        out = chosen.copy()
        for leg, partner in self._pairs().items():
            own, k = np.flatnonzero(near[:, leg]), out[partner]
            apart = np.linalg.norm(origins[own, leg] - flip * origins[k, partner], axis=-1).sum(-1)
            apart += np.linalg.norm(feet[own, leg] - flip * feet[k, partner], axis=-1)
            out[leg] = own[int(apart.argmin())]
        return out

    def _pairs(self) -> dict[int, int]:
        """Right legs whose hip mirrors an earlier leg's, and that leg."""
        chains, hips = self.chains, self.chains.offset[0]
        pairs: dict[int, int] = {}
        for leg in range(len(chains.names)):
            for other in range(leg):
                apart = np.linalg.norm(hips[leg] * [1, -1, 1] - hips[other])
                alike = (
                    abs(chains.reach[leg] - chains.reach[other]) <= _MIRRORED * chains.reach[leg]
                )
                if apart <= _MIRRORED * chains.reach[leg] and alike and hips[leg, 1] != 0:
                    pairs[leg] = other
        return pairs

    def _mirror(self, feet: Array) -> Array:
        """Feet of mirrored legs at mirrored places."""
        out = feet.copy()
        for leg, other in self._pairs().items():
            out[leg] = out[other] * [1, -1, 1]
        return out

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


def _origins(chains: LegChains, q: Array) -> Array:
    """Origins of the joints in the base frame [m], shape (M, L, K, 3)."""
    origins = np.repeat(chains.offset[0][None, :, None], q.shape[0], axis=0)
    parts = [origins]
    for j in range(1, chains.depth):
        inner = replace(chains.shortened(j), foot=chains.offset[j])
        parts.append(foot_positions(inner, q[..., :j])[:, :, None])
    return np.concatenate(parts, axis=2)
