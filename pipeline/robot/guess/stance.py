"""A stance to stand and walk about: from a pose that is known, else from a search.

The search draws postures of every leg inside its limits, keeps those that stand (the foot below
every joint of its leg, within a cone under the hip, away from singular postures and from limits),
and of feet on one level takes those with the largest margin of static stability. Right legs mirror
left ones where their hips do.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.errors import RobotFileError
from pipeline.robot.inverse.least_motion import freedoms
from pipeline.robot.inverse_kinematics import ACCEPTED, reach
from pipeline.robot.kinematics import foot_jacobians, foot_positions
from pipeline.robot.leg_chains import LegChains
from pipeline.robot.leg_columns import LegColumns
from pipeline.robot.start_posture import spread

Array = NDArray[np.float64]
#: Feet (1, F, 3) and a point (1, 2) to the point's margin in their hull [m], (1,).
Margin = Callable[[Array, Array], Array]
_POSTURES = 4000  # drawn for each leg
_HEIGHTS = 25
_CLEAR = 0.1  # share of a joint's range kept from either limit
_ENDLESS = np.pi / 2  # [rad] a joint without limits is searched this far either way
_BELOW = 0.05  # of the leg's reach, by which a foot is lower than its leg's joints
_CONES = (1.0, 0.75, 0.5, 0.25)  # horizontal over vertical distance of a foot from its hip
_SINGULAR = 0.25  # of the largest smallest singular value that the leg has
_LEVEL = 0.03  # of the reach: feet within that are of one height, before they are levelled
_MIRRORED = 0.02  # of the reach


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
        """Stances among the postures drawn, those with the largest margin first.

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
        found: list[tuple[float, float, Array, Array]] = []
        centre = self._centre(np.where(chains.real, (low + high) / 2, 0.0))
        for cone in _CONES:
            stands = self._stands(feet, origins, cone) & (smallest >= regular)
            if not stands.any(axis=0).all():
                if cone == _CONES[0]:
                    raise self._no_posture(int(stands.any(axis=0).argmin()))
                break
            heights = np.where(stands, feet[..., 2], np.nan)
            lowest, highest = np.nanmin(heights, axis=0).max(), np.nanmax(heights, axis=0).min()
            for height in np.linspace(lowest, highest, _HEIGHTS):
                chosen = self._outermost(feet, stands, origins, float(height), centre)
                if chosen is None:
                    continue
                posture = q[chosen, range(n_legs)]
                level = feet[chosen, range(n_legs)].copy()
                level[:, 2] = height
                level = self._mirror(level)
                found.append((self._margin(level, posture), -float(height), level, posture))
        reason = (
            "the largest margin of static stability among level feet that leave a stroke, in a "
            f"search of {_POSTURES} postures of each leg, {100 * _CLEAR:g} % clear of its limits"
        )
        for _, _, level, posture in sorted(found, key=lambda one: one[:2], reverse=True):
            stance = self._reached(level, posture, reason, 0.0)
            if stance is not None and (self._smallest(stance.posture[None])[0] >= regular).all():
                yield stance

    def _no_posture(self, leg: int) -> RobotFileError:
        return RobotFileError(
            f"{self.where}: no posture of leg '{self.chains.names[leg]}' within its limits puts "
            "its foot below its joints and under the hip; name other feet with --foot, or give a "
            "pose 'standing' in an SRDF beside the URDF"
        )

    def _range(self) -> tuple[Array, Array]:
        """Where postures are drawn, each (L, K)."""
        lower, upper = self.lower, self.upper
        limited = np.isfinite(lower) & np.isfinite(upper) & (upper - lower < 4 * np.pi)
        limited &= upper > lower
        far = np.where(self.chains.slides.T, 0.2 * self.chains.reach[:, None], _ENDLESS)
        lower = np.where(limited, np.maximum(lower, -np.pi), -far)
        upper = np.where(limited, np.minimum(upper, np.pi), far)
        clear = _CLEAR * (upper - lower)
        return lower + clear, upper - clear

    def _stands(self, feet: Array, origins: Array, cone: float) -> NDArray[np.bool_]:
        """Which postures of which legs have the foot below the leg and the hip, shape (M, L)."""
        height = origins[..., 2].min(axis=2) - feet[..., 2]
        hip = origins[:, :, 0] - feet
        under = np.linalg.norm(hip[..., :2], axis=-1) <= cone * hip[..., 2]
        return np.asarray((height >= _BELOW * self.chains.reach) & under)

    def _smallest(self, q: Array) -> Array:
        """Smallest singular value among the directions that a leg has, shape (M, L)."""
        values = np.linalg.svd(foot_jacobians(self.chains, q)[1], compute_uv=False)
        last = [own.directions - 1 for own in freedoms(self.chains)]
        return np.asarray(values[:, range(len(last)), last])

    def _outermost(
        self,
        feet: Array,
        stands: NDArray[np.bool_],
        origins: Array,
        height: float,
        centre: Array,
    ) -> NDArray[np.intp] | None:
        """Of every leg the posture whose foot is furthest out at a height; None without one."""
        chains, hips = self.chains, self.chains.offset[0]
        flip = np.array([1.0, -1.0, 1.0])
        chosen = np.zeros(len(chains.names), dtype=np.intp)
        done: dict[int, int] = self._pairs()
        for leg in range(chosen.size):
            at_height = np.abs(feet[:, leg, 2] - height) <= _LEVEL * chains.reach[leg]
            own = np.flatnonzero(stands[:, leg] & at_height)
            if own.size == 0:
                return None
            if leg in done:  # the mirror image of its partner, knee and all
                partner = done[leg]
                k = chosen[partner]
                apart = np.linalg.norm(origins[own, leg] - flip * origins[k, partner], axis=-1)
                apart = apart.sum(-1) + np.linalg.norm(
                    feet[own, leg] - flip * feet[k, partner], axis=-1
                )
                chosen[leg] = own[int(apart.argmin())]
                continue
            out = hips[leg, :2] - centre[:2]
            out /= max(float(np.linalg.norm(out)), 1e-9)
            chosen[leg] = own[int((feet[own, leg, :2] @ out).argmax())]
        return chosen

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


def _origins(chains: LegChains, q: Array) -> Array:
    """Origins of the joints in the base frame [m], shape (M, L, K, 3)."""
    origins = np.repeat(chains.offset[0][None, :, None], q.shape[0], axis=0)
    parts = [origins]
    for j in range(1, chains.depth):
        inner = LegChains(
            chains.names,
            chains.rotation[:j],
            chains.offset[:j],
            chains.axis[:j],
            chains.slides[:j],
            chains.offset[j],
            chains.nominal[:, :j],
        )
        parts.append(foot_positions(inner, q[..., :j])[:, :, None])
    return np.concatenate(parts, axis=2)
