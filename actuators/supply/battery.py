"""A battery: voltage behind a resistance, how long it lasts, and what it takes back.

Its open-circuit voltage falls in proportion to the charge drawn, from `full` to `empty`, with mean
E; behind it stands a constant internal resistance (Plett, Battery Management Systems I, section 2.2
and 2.3). Terminal power P is positive out of the battery:

    V = E(s) - R I,    P = V I    =>    I = 2 P / (E + sqrt(E^2 - 4 R P))
    ds/dt = -I / Q   (I > 0)    or   -returned I / Q   (I < 0),    Q = energy / E

The power is greatest, E^2 / 4R, where half of the voltage is left; it is not to be had beyond.
Discharge ends at s = 0, or where the terminals of the mode that draws most fall below a cut-off,
at an open-circuit voltage of U + R P / U.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np

from actuators.arrays import Array, Numbers, require

#: Nodes of Gauss and Legendre over the charge; the integrand is smooth above the greatest power.
_NODES, _WEIGHTS = (np.asarray(a) for a in np.polynomial.legendre.leggauss(24))
HOUR: Final = 3600.0  # [s]


@dataclass(frozen=True)
class Battery(Numbers):
    """One battery.

    Raises:
        UnphysicalElementError: A number is negative or not finite, nothing is in it, or it is
            emptier than full.
    """

    rules: ClassVar = {"energy": "positive"}
    name: str  #: Of the part.
    energy: float  #: From full to empty at a small current [J].
    full: float  #: Open-circuit voltage when full [V].
    empty: float  #: Open-circuit voltage when it counts as empty [V].
    resistance: float = 0.0  #: Internal [ohm].
    returned: float = 1.0  #: Share of the charge fed into it that can be drawn again [1].
    mass: float = 0.0  #: [kg]; no law uses it.

    def __post_init__(self) -> None:
        super().__post_init__()
        require(0.0 < self.empty <= self.full, self.name, "0 < empty <= full voltage must hold")
        require(self.returned <= 1.0, self.name, "returned must not be above 1")

    @property
    def charge(self) -> float:
        """From full to empty [A*s]."""
        return self.energy / (0.5 * (self.full + self.empty))

    def open_voltage(self, charged: Array) -> Array:
        """Return the voltage without current at a share of charge (...) that is left, (...) [V]."""
        return self.empty + (self.full - self.empty) * np.asarray(charged)

    def current(self, power: Array, charged: Array) -> Array:
        """Return the current out of the battery, (...) [A]; NaN where it cannot give the power.

        Args:
            power: At the terminals, positive out, (...) [W].
            charged: Share of the charge that is left, (...) in [0, 1].
        """
        voltage, power = self.open_voltage(charged), np.asarray(power, dtype=float)
        left = voltage * voltage - 4.0 * self.resistance * power
        root = np.sqrt(np.where(left >= 0.0, left, np.nan))
        return np.asarray(2.0 * power / (voltage + root))

    def charge_at_end(self, power: Array, cut_off: float = 0.0) -> Array:
        """Return the share of charge that stays, (...) in [0, 1]; 1 where it cannot even begin.

        Args:
            power: The greatest at the terminals, (...) [W].
            cut_off: Least voltage at the terminals that drivers work with [V].
        """
        power = np.maximum(power, 0.0)
        # The branch above half of the voltage; below it the greatest power is the bound.
        limit = np.maximum(cut_off, np.sqrt(self.resistance * power))
        drop = np.divide(self.resistance * power, limit, out=np.zeros_like(limit), where=limit > 0)
        needed = limit + drop
        if self.full == self.empty:
            return np.where(needed <= self.full, 0.0, 1.0)
        return np.clip((needed - self.empty) / (self.full - self.empty), 0.0, 1.0)

    def hours(
        self,
        power: Array,
        shares: Array,
        *,
        peak: Array | None = None,
        cut_off: float = 0.0,
    ) -> Array:
        """Return how long a full battery lasts, (...) [h]; infinite where nothing is drawn.

        The modes alternate so quickly that the charge hardly changes in one round of them.

        Args:
            power: Of each mode at the terminals, hotel load and drivers included, positive out,
                (..., M) [W]. Samples of one mode may stand for it where its power varies.
            shares: Of the time in each mode, (M,), which sum to one.
            peak: Greatest power within a mode, (...) [W]; that of the modes by default.
            cut_off: Least voltage at the terminals that drivers work with [V].

        Raises:
            UnphysicalElementError: The shares are negative or do not sum to one.
        """
        power, shares = np.asarray(power, dtype=float), np.asarray(shares, dtype=float)
        require(shares >= 0.0, self.name, "shares must not be negative")
        require(math.isclose(shares.sum(), 1.0, abs_tol=1e-6), self.name, "shares must sum to 1")
        peak = np.maximum(np.max(power, axis=-1), -np.inf if peak is None else peak)
        last = self.charge_at_end(peak, cut_off)
        half = 0.5 * (1.0 - last)
        charged = (last + half)[..., None] + half[..., None] * _NODES  # (..., 24)
        current = self.current(power[..., None, :], charged[..., None])  # (..., 24, M)
        drawn = np.where(current < 0.0, self.returned * current, current) @ shares  # [A]
        able = half > 0.0  # else it cannot even begin, and lasts no time
        with np.errstate(divide="ignore"):
            pace = np.where(able[..., None] & ~(drawn > 0.0), np.inf, 1.0 / drawn)  # [1/A]
        lasting = np.where(able, np.where(able, half, 1.0) * (pace @ _WEIGHTS), 0.0)
        return np.asarray(self.charge * lasting / HOUR)
