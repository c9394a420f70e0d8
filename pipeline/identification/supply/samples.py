"""What the supply gave, sample by sample, at the pace at which it was logged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.logs.read import Recording

#: Samples that are the fewest from which terms can be separated and tested.
FEWEST: Final = 24
#: Intervals are no shorter than this many times the reach of the motion's low-pass.
SHORTEST: Final = 1.0
#: Share of equal neighbours from which on a column holds its last value between samples.
_HELD: Final = 0.5


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of the supply of one log, each the mean over the time since the one before."""

    begin: Array  #: Shape (K,) [s].
    end: Array  #: Shape (K,) [s].
    power: Array  #: Shape (K,) [W].
    voltage: Array  #: Shape (K,) [V]; NaN where it is not known.
    current: Array  #: Out of the supply, shape (K,) [A]; NaN where it is not known.
    measured: bool  #: Whether the voltage was measured and not stated.


def supply_samples(log: Recording, shortest: float) -> Samples:
    """The supply's samples of one log.

    Args:
        log: As read; the supply's columns may be empty or hold their value between samples.
        shortest: Samples closer together than this [s] are averaged.

    Raises:
        LegwattError: There is no power at the supply, or it cannot be one.
    """
    voltage, current, power = (
        _own(log, log.of(name)) for name in ("supply", "supply_current", "supply_power")
    )
    if power is None and (voltage is None or current is None):
        have = "a voltage alone" if voltage else "a current alone" if current else "no column"
        raise LegwattError(
            f"{log.name}: {have} of the supply; log supply__power_W, or supply__current_A with "
            "supply__voltage_V or with voltage under [supply] in a mapping file"
        )
    if voltage is not None and (voltage[1] <= 0.0).any():
        raise LegwattError(
            f"{log.name}: the supply's voltage falls to {voltage[1].min():.4g} V; expected a "
            "positive one, leave cells empty where it was not measured"
        )
    told = power or current
    assert told is not None
    at = told[0]
    u = np.full(at.size, np.nan) if voltage is None else np.interp(at, *voltage)
    i = np.full(at.size, np.nan) if current is None else np.interp(at, *current)
    p = u * i if power is None else power[1]
    dead = np.ptp(p) == 0.0
    if np.median(p) <= 0.0 and not (dead and p[0] == 0.0):
        raise LegwattError(
            f"{log.name}: the supply gives {np.median(p):.4g} W at the middle sample; expected "
            "power out of it to be positive; flip the column in a mapping file"
        )
    if dead:
        raise LegwattError(
            f"{log.name}: the supply gives {p[0]:.4g} W in every sample: a dead sensor, or a "
            "stated value; log what it measures"
        )
    place = np.floor((at - at[0]) / shortest * (1.0 + 1e-9))
    group = np.concatenate([[0], np.cumsum(np.diff(place) > 0)])
    end = at[np.flatnonzero(np.diff(np.append(group, group[-1] + 1)))]
    p, u, i = (np.bincount(group, x) / np.bincount(group) for x in (p, u, i))
    stated = voltage is None or np.ptp(voltage[1]) == 0.0
    return Samples(end[:-1], end[1:], p[1:], u[1:], i[1:], not stated)


def _own(log: Recording, values: Array | None) -> tuple[Array, Array] | None:
    """Instants and values of a column where it has samples of its own; None without any.

    Raises:
        LegwattError: Fewer than separate terms need.
    """
    if values is None or not np.isfinite(values).any():
        return None
    time, values = log.time[np.isfinite(values)], values[np.isfinite(values)]
    changes = np.flatnonzero(np.diff(values)) + 1
    if 0 < changes.size < (1.0 - _HELD) * values.size and changes.size > 1:
        # Held between samples, which come every so many rows.
        every = max(1, int(np.quantile(np.diff(changes), 0.05)))
        rows = np.arange(changes[0] % every, values.size, every)
        time, values = time[rows], values[rows]
    return time, values
