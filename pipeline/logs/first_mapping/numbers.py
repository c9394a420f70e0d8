"""What a column's numbers say: the clock's unit, angles in degrees, whose velocity this is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from actuators.arrays import Array

#: Rates at which robots log [Hz].
_RATES: Final = (5.0, 20_000.0)
#: Correlation from which a column is a derivative, ...
DERIVATIVE: Final = 0.95
#: ... and below which it is none, whatever its name says.
NO_DERIVATIVE: Final = 0.8
#: Relative distance from a factor that has a name.
_NEAR: Final = 0.1
#: Share by which a motion may leave the limits that a robot's file states.
_BEYOND: Final = 0.1
#: A joint of no known limits turns no further [rad], ...
_TURNS: Final = 4.0 * np.pi
#: ... and shows no more degrees.
_DEGREES: Final = 720.0
#: Units of angles [rad].
ANGLES: Final = {"rad": 1.0, "deg": float(np.radians(1.0))}
#: Velocity's unit by the factor between it and the derivative of a position in radians.
_FACTORS: Final = {
    "rad/s": 1.0,
    "deg/s": float(np.radians(1.0)),
    "rpm": 2.0 * np.pi / 60.0,
}


def clock_units(time: Array) -> list[str]:
    """Units in which a column may be a clock, the likeliest first."""
    step = np.diff(time[np.isfinite(time)])
    if step.size < 2 or not (step >= 0).all() or not (step > 0).any():
        return []
    typical = float(np.median(step[step > 0]))
    seconds = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
    return [u for u, f in seconds.items() if _RATES[0] <= 1.0 / (typical * f) <= _RATES[1]]


def angle_units(x: Array, lower: float, upper: float) -> list[str]:
    """Units in which a column may be a joint's angle, the likeliest first; none where none is.

    Limits are the joint's [rad], infinite where they are not known.
    """
    low, high = float(np.nanmin(x)), float(np.nanmax(x))
    if np.isfinite(lower) and np.isfinite(upper):
        margin = _BEYOND * (upper - lower)
        fits = {
            unit: lower - margin <= low * f and high * f <= upper + margin
            for unit, f in ANGLES.items()
        }
    else:
        most = max(abs(low), abs(high))
        fits = {"rad": most <= _TURNS, "deg": most <= _DEGREES}
    if fits["rad"] and high - low < 0.2:  # as degrees it would hardly move
        return ["rad"]
    return [unit for unit, fit in fits.items() if fit]


@dataclass(frozen=True)
class Follows:
    """How a column follows the derivative of another."""

    position: str  #: The other.
    correlation: float  #: Between the derivative and the column.
    factor: float  #: Derivative over column.

    def units(self, angle: str, stated: str) -> list[str]:
        """Units of the velocity that make the position one in this unit; none where none does.

        Args:
            angle: ``"rad"`` or ``"deg"``.
            stated: The velocity's unit where the file says it, else empty.
        """
        factor = abs(self.factor) * ANGLES[angle]
        return [
            unit
            for unit, f in _FACTORS.items()
            if abs(factor / f - 1.0) < _NEAR and stated in ("", unit)
        ]

    def of(self, stated: str) -> float:
        """What one of the velocity's unit is [rad/s]; 1 where the file does not say it."""
        return _FACTORS.get(stated, 1.0)


def follows(x: Array, rates: Mapping[str, Array]) -> list[Follows]:
    """How a column (N,) follows derivatives of positions, (N,) by name; the closest first."""
    out = []
    for name, rate in rates.items():
        good = np.isfinite(x) & np.isfinite(rate)
        if good.sum() < 20 or np.ptp(x[good]) == 0 or np.ptp(rate[good]) == 0:
            continue
        a, b = x[good] - x[good].mean(), rate[good] - rate[good].mean()
        product = float(a @ b)
        r = product / float(np.sqrt((a @ a) * (b @ b)))
        out.append(Follows(name, r, product / float(a @ a)))
    return sorted(out, key=lambda f: -abs(f.correlation))


def mean_of(time: Array, x: Array) -> Array:
    """A column averaged over as many rows as `rate_of` differentiates over, so that both agree."""
    whole = np.full(x.size, np.nan)
    good = np.isfinite(x) & np.isfinite(time)
    steps = 0.5 * (x[good][1:] + x[good][:-1]) * np.diff(time[good])
    whole[good] = np.concatenate([[0.0], np.cumsum(steps)])[: int(good.sum())]
    return rate_of(time, whole)


def rate_of(time: Array, x: Array) -> Array:
    """Derivative of a column, over so many rows that the encoder's steps do not drown it.

    Shape (N,), centred, NaN at both ends.
    """
    out = np.full(x.size, np.nan)
    good = np.flatnonzero(np.isfinite(x) & np.isfinite(time))
    if good.size < 50:
        return out
    t, q = time[good], x[good]
    half = max(1, min(good.size // 100, round(0.01 / max(float(np.median(np.diff(t))), 1e-9))))
    span = t[2 * half :] - t[: -2 * half]
    middle = good[half:-half]
    out[middle] = np.where(span > 0, (q[2 * half :] - q[: -2 * half]) / np.maximum(span, 1e-12), 0)
    return out
