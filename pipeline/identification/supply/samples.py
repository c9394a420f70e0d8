"""What the supply gave, sample by sample, at the pace at which it was logged."""

from __future__ import annotations

from typing import Final

import numpy as np
from pandas import DataFrame

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.logs.log import Recording

#: Share of equal neighbours from which on a column holds its last value between samples.
_REPEATED: Final = 0.5


def supply_samples(log: Recording, shortest: float) -> DataFrame:
    """The supply's samples of one log, each the mean over the time since the one before.

    Columns ``begin``, ``end`` [s], ``power`` [W], ``voltage`` [V], NaN where it is not known.

    Args:
        log: As read; the supply's columns may be empty or hold their value between samples.
        shortest: Samples closer together than this [s] are averaged.

    Raises:
        LegwattError: There is no power at the supply, or it cannot be one.
    """
    voltage, current, power = (
        _sampled(log.time, log.of(name)) for name in ("supply", "supply_current", "supply_power")
    )
    measured = power or current
    if measured is None or (power is None and voltage is None):
        have = "a voltage alone" if voltage else "a current alone" if current else "no column"
        raise LegwattError(
            f"{log.name}: {have} of the supply; log supply__power_W, or supply__current_A with "
            "supply__voltage_V, which [constants] of a mapping file can state"
        )
    at = measured[0]
    u = np.full(at.size, np.nan) if voltage is None else np.interp(at, *voltage)
    p = power[1] if power is not None else u * measured[1]
    wrong = ""
    if voltage is not None and (voltage[1] <= 0.0).any():
        wrong = (
            f"'s voltage falls to {voltage[1].min():.4g} V; expected a positive one, leave cells "
            "empty where it was not measured"
        )
    elif np.ptp(p) == 0.0:
        wrong = f" gives {p[0]:.4g} W in every sample: a dead sensor, or a stated value"
    elif np.median(p) <= 0.0:
        wrong = (
            f" gives {np.median(p):.4g} W at the middle sample; expected power out of it to be "
            "positive; flip the column in a mapping file"
        )
    if wrong:
        raise LegwattError(f"{log.name}: the supply{wrong}")
    place = np.floor((at - at[0]) / shortest * (1.0 + 1e-9))
    group = np.concatenate([[0], np.cumsum(np.diff(place) > 0)])
    end = at[np.flatnonzero(np.diff(np.append(group, group[-1] + 1)))]
    p, u = (np.bincount(group, x) / np.bincount(group) for x in (p, u))
    return DataFrame({"begin": end[:-1], "end": end[1:], "power": p[1:], "voltage": u[1:]})


def _sampled(time: Array, values: Array | None) -> tuple[Array, Array] | None:
    """Instants and values of a column where it has samples of its own; None without any."""
    if values is None or not np.isfinite(values).any():
        return None
    time, values = time[np.isfinite(values)], values[np.isfinite(values)]
    changes = np.flatnonzero(np.diff(values)) + 1
    if 1 < changes.size < (1.0 - _REPEATED) * values.size:
        # Repeated between samples, which come every so many rows.
        every = max(1, int(np.quantile(np.diff(changes), 0.05)))
        rows = np.arange(changes[0] % every, values.size, every)
        time, values = time[rows], values[rows]
    return time, values
