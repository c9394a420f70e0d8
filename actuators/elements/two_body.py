"""Temperatures of winding and housing: two bodies, two thermal resistances, copper that warms.

    C_w dT_w/dt = P (1 + a (T_w - T_ref)) - (T_w - T_h) / R_wh
    C_h dT_h/dt = H + (T_w - T_h) / R_wh - (T_h - T_a) / R_ha
    C_w = winding time constant / R_wh,    C_h = housing time constant / R_ha

with P the copper loss at the data sheet's temperature T_ref and H other heat in the housing, such
as friction (maxon, Key information on dc motor and ec motor, thermal behaviour). A constant current
keeps the system linear, x' = A x + u, so that a mode of constant losses is solved exactly by
exp(A t), whose two eigenvalues are real. In balance

    T_w - T_a = (P (1 + a (T_a - T_ref)) (R_wh + R_ha) + H R_ha) / (1 - a P (R_wh + R_ha))

and from a P (R_wh + R_ha) = 1 on there is no balance: the winding runs away. Without R_ha it is
the single node of `actuators.elements.heating`, whose coefficient of copper holds here too.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np

from actuators.arrays import Array, Scalars
from actuators.elements.heating import COPPER, REFERENCE
from actuators.parameters import Numbers

#: Temperature for which data sheets hold [K].
REFERENCE_K: Final = REFERENCE + 273.15
#: Beyond this an exponential is as good as infinite.
_LARGE: Final = 300.0


@dataclass(frozen=True, eq=False)
class Temperatures:
    """What recurring modes lead to once every round is like the one before."""

    peak: Array  #: Highest of the winding over the round, (...) [K]; infinite where it runs away.
    #: Mean of the winding over each mode, (..., M) [K]; infinite where it runs away.
    winding: Array
    housing: Array  #: Mean of the housing over each mode, (..., M) [K]; infinite likewise.

    @property
    def resistance(self) -> Array:
        """Mean resistance over the data sheet's, by mode, (..., M) [1]."""
        return 1.0 + COPPER * (self.winding - REFERENCE_K)

    @property
    def runs_away(self) -> Array:
        """Whether there is no such round, (...) boolean."""
        return ~np.isfinite(self.peak)


@dataclass(frozen=True, eq=False)
class TwoBody(Numbers):
    """The thermal model of a motor; numbers may be arrays (...) that broadcast against losses.

    Raises:
        LegwattError: A number is not positive and finite.
    """

    rules: ClassVar = dict.fromkeys(
        ("winding_to_housing", "housing_to_ambient", "winding_time", "housing_time"), "positive"
    )
    winding_to_housing: Scalars  #: R_wh [K/W].
    housing_to_ambient: Scalars  #: R_ha [K/W].
    winding_time: Scalars  #: Time constant of the winding [s].
    housing_time: Scalars  #: Time constant of the housing [s].

    def day(
        self,
        seconds: Array,
        copper: Array,
        other: Scalars = 0.0,
        *,
        ambient: float = REFERENCE_K,
    ) -> Temperatures:
        """Return what modes in this order, again and again, lead to.

        Args:
            seconds: Of each mode, (M,) [s].
            copper: Mean of R I^2 in each mode with the data sheet's R, (..., M) [W].
            other: Heat in the housing in each mode, (..., M) [W].
            ambient: [K].
        """
        copper = np.asarray(copper, dtype=float)
        other = np.broadcast_to(np.asarray(other, dtype=float), copper.shape)
        modes = [
            _Mode(self, copper[..., m], other[..., m], float(seconds[m]), ambient)
            for m in range(copper.shape[-1])
        ]
        map_, gained = modes[0].map, modes[0].gained
        for mode in modes[1:]:
            map_, gained = mode.map @ map_, _times(mode.map, gained) + mode.gained
        stable = _largest_eigenvalue(map_) < 1.0
        safe = np.where(stable[..., None, None], map_, 0.0)
        state: Array = np.asarray(
            np.linalg.solve(np.eye(2) - safe, gained[..., None])[..., 0], dtype=np.float64
        )
        peaks, means = [state[..., 0]], []
        for mode in modes:
            peaks.append(mode.turning(state))
            means.append(mode.mean(state))
            state = _times(mode.map, state) + mode.gained
            peaks.append(state[..., 0])
        mean = np.where(stable[..., None, None], np.stack(means, axis=-2), np.inf)
        peak = np.where(stable, np.max(peaks, axis=0), np.inf)
        return Temperatures(ambient + peak, ambient + mean[..., 0], ambient + mean[..., 1])


class _Mode:
    """Constant losses for some time: x' = A x + u, x = warmer than the surroundings, (..., 2)."""

    def __init__(
        self, body: TwoBody, copper: Array, other: Array, seconds: float, ambient: float
    ) -> None:
        own = copper * body.winding_to_housing  # [K]
        back = body.housing_to_ambient / body.winding_to_housing / body.housing_time  # [1/s]
        terms = np.broadcast_arrays(
            (COPPER * own - 1.0) / body.winding_time,
            1.0 / np.asarray(body.winding_time),
            back,
            -back - 1.0 / np.asarray(body.housing_time),
            own * (1.0 + COPPER * (ambient - REFERENCE_K)) / body.winding_time,
            other * body.housing_to_ambient / body.housing_time,
        )
        numbers = np.stack(terms, axis=-1)
        self.rate = numbers[..., :4].reshape(*numbers.shape[:-1], 2, 2)
        self.source = numbers[..., 4:]
        largest = _largest_eigenvalue(self.rate)
        others = np.trace(self.rate, axis1=-2, axis2=-1) - largest
        self.eigenvalues = np.stack([largest, others])  # (2, ...) [1/s]
        one, two = largest[..., None, None], others[..., None, None]
        unit = np.eye(2)
        parts = (self.rate - two * unit, one * unit - self.rate)
        self.parts = np.stack([part / (one - two) for part in parts])
        self.seconds = seconds
        self.map = self._of(np.exp, seconds)
        self.gained = seconds * _times(self._of(_phi, seconds), self.source)

    def _of(self, function: Callable[[Array], Array], seconds: Scalars) -> Array:
        """A function of A t, (..., 2, 2)."""
        values = function(np.minimum(self.eigenvalues * seconds, _LARGE))
        return np.asarray((values[..., None, None] * self.parts).sum(axis=0))

    def mean(self, state: Array) -> Array:
        """Mean over the mode, (..., 2) [K]."""
        twice = _times(self._of(_phi2, self.seconds), self.source)
        return _times(self._of(_phi, self.seconds), state) + self.seconds * twice

    def turning(self, state: Array) -> Array:
        """The winding where it turns from warming to cooling, else at the begin, (...) [K]."""
        slope = _times(self.rate, state) + self.source
        one, two = (_times(part, slope)[..., 0] for part in self.parts)
        crosses = one * two < 0.0
        ratio = np.where(crosses, -two / np.where(crosses, one, 1.0), 1.0)
        turn = np.log(ratio) / (self.eigenvalues[0] - self.eigenvalues[1])
        turn = np.clip(turn, 0.0, self.seconds)
        there = _times(self._of(np.exp, turn), state)
        gained = turn[..., None] * _times(self._of(_phi, turn), self.source)
        return np.asarray((there + gained)[..., 0])


def _times(matrix: Array, vector: Array) -> Array:
    return np.asarray((matrix @ vector[..., None])[..., 0])


def _largest_eigenvalue(m: Array) -> Array:
    """Of matrices (..., 2, 2) whose off-diagonal is not negative, so that it is real."""
    apart = m[..., 0, 0] - m[..., 1, 1]
    root = np.sqrt(apart * apart + 4.0 * m[..., 0, 1] * m[..., 1, 0])
    return np.asarray(0.5 * (m[..., 0, 0] + m[..., 1, 1] + root))


def _phi(z: Array) -> Array:
    """(exp(z) - 1) / z."""
    small = np.abs(z) < 1e-9
    return np.where(small, 1.0 + 0.5 * z, np.expm1(z) / np.where(small, 1.0, z))


def _phi2(z: Array) -> Array:
    """(exp(z) - 1 - z) / z^2."""
    small = np.abs(z) < 1e-5
    safe = np.where(small, 1.0, z)
    return np.where(small, 0.5 + z / 6.0, (np.expm1(z) - z) / (safe * safe))
