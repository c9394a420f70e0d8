"""What a model leaves of the gap, by joint and channel, and what it depends on, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.effects.base import CHANNEL_UNITS
from pipeline.identification import results as limits
from pipeline.identification.fit import independent
from pipeline.identification.results import Residual
from pipeline.identification.settings import COLOURED
from pipeline.identification.where import gap_of
from pipeline.logs.log import TEST, TRAIN, Log
from pipeline.simulation.predict import Prediction

_BINS: Final = 12
#: Share of the remaining variance that a variable's curve explains, to be worth a word.
_TELLING: Final = 0.08
#: What is said of a remainder that depends on nothing.
NO_VARIABLE: Final = "depends on no single variable of the motion"


def residuals(
    measurements: Sequence[Log],
    predictions: Sequence[Prediction],
    floor: Array,
    proved: Array | None = None,
) -> tuple[Residual, ...]:
    """What a model leaves on test rows, by joint and channel, described where it is significant.

    Of a joint without rows there it is what is left on training and validation rows.

    Args:
        measurements: One per log.
        predictions: Of the model, one per log.
        floor: Standard deviation of the noise, shape (J, C).
        proved: Root mean square on test rows by joint and channel, shape (J, C), NaN without a row,
            where it is known from more rows than the measurements hold.
    """
    first, out = measurements[0], []
    part, q, v, a, time = (
        np.concatenate([getattr(m, name) for m in measurements])
        for name in ("part", "q", "v", "a", "time")
    )
    load = np.concatenate([p.torque for p in predictions])
    for j, joint in enumerate(first.joints):
        series = {"position": q[:, j], "velocity": v[:, j], "acceleration": a[:, j], "time": time}
        series |= {
            "load": load[:, j],
            "load in the direction of motion": load[:, j] * np.sign(v[:, j]),
        }
        for k, other in enumerate(first.joints if len(first.joints) <= 8 else ()):
            if k != j:
                series |= {f"position of {other}": q[:, k], f"velocity of {other}": v[:, k]}
        for c, channel in enumerate(first.channels):
            pairs = zip(measurements, predictions, strict=True)
            rest = np.concatenate([gap_of(m, p, c)[:, j] for m, p in pairs])
            held = rest[(part == TEST) & np.isfinite(rest)]
            # Where there is no test row, those that were fitted are better than none.
            seen = held if held.size else rest[(part >= TRAIN) & np.isfinite(rest)]
            error, level = (
                float(np.sqrt(np.mean(seen**2))) if seen.size else 0.0,
                float(floor[j, c]),
            )
            if proved is not None and np.isfinite(proved[j, c]):
                error = float(proved[j, c])
            text = ""
            if error > limits.UNEXPLAINED * level:
                variable, share = _most_telling(rest, series)
                if variable:
                    text = f"depends on the {variable} ({100 * share:.0f} % of it)"
                elif error > COLOURED * level:
                    text = NO_VARIABLE
            text = f"what is left in {joint} {text}" if text else ""
            unit = CHANNEL_UNITS[channel]
            out.append(
                Residual(joint, channel, error, level, unit, bool(text), text, int(held.size))
            )
    return tuple(out)


def _most_telling(rest: Array, series: Mapping[str, Array]) -> tuple[str, float]:
    """The series on which a remainder (N,) depends most, and its share; no name where on none."""
    shares = {name: explained(rest, x) for name, x in series.items()}
    best = max(shares, key=lambda name: shares[name])
    return (best if shares[best] >= _TELLING else ""), shares[best]


def explained(rest: Array, variable: Array) -> float:
    """Share of a remainder's variance that a step curve over a variable explains, adjusted.

    Adjusted as a coefficient of determination is, by the independent samples of what it leaves.
    """
    good = np.isfinite(rest) & np.isfinite(variable)
    y, x = rest[good], variable[good]
    if y.size < 5 * _BINS or np.ptp(x) == 0:
        return 0.0
    edges = np.unique(np.quantile(x, np.linspace(0, 1, _BINS + 1)[1:-1]))
    index = np.searchsorted(edges, x)
    counts = np.maximum(np.bincount(index, minlength=edges.size + 1), 1)
    left = y - (np.bincount(index, y, edges.size + 1) / counts)[index]
    # Of what the curve leaves: a remainder that hangs on a slow variable is slow itself.
    samples = y.size * independent(left)
    if samples <= _BINS + 1:
        return 0.0
    adjusted = float(left @ left) * (samples - 1.0) / (samples - _BINS)
    return 1.0 - adjusted / max(float(np.sum((y - y.mean()) ** 2)), 1e-300)
