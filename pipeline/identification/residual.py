"""What a model leaves of the gap, by joint and channel, and what it depends on, in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.effects.base import CHANNEL_UNITS
from pipeline.identification import results as limits
from pipeline.identification.fit import independent
from pipeline.identification.results import Residual
from pipeline.identification.settings import COLOURED
from pipeline.identification.where import gap_of
from pipeline.logs.log import TEST, TRAIN, VALIDATION, Log
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
    first = measurements[0]
    out = []
    for c, channel in enumerate(first.channels):
        rests = [gap_of(m, p, c) for m, p in zip(measurements, predictions, strict=True)]
        for j, joint in enumerate(first.joints):
            held = _known(measurements, rests, j, TEST)
            # Where there is no test row, those that were fitted are better than none.
            seen = held if held.size else _known(measurements, rests, j, TRAIN, VALIDATION)
            error = float(np.sqrt(np.mean(seen**2))) if seen.size else 0.0
            if proved is not None and np.isfinite(proved[j, c]):
                error = float(proved[j, c])
            level = float(floor[j, c])
            text = ""
            if error > limits.UNEXPLAINED * level:
                text = _describe(measurements, predictions, rests, j)
            significant = bool(text) and (error > COLOURED * level or NO_VARIABLE not in text)
            text = text if significant else ""
            unit = CHANNEL_UNITS[channel]
            out.append(
                Residual(joint, channel, error, level, unit, significant, text, int(held.size))
            )
    return tuple(sorted(out, key=lambda r: first.joints.index(r.joint)))


def _known(measurements: Sequence[Log], rests: Sequence[Array], j: int, *parts: int) -> Array:
    """What is left of one joint on some parts, masked rows left out."""
    pairs = zip(measurements, rests, strict=True)
    every = np.concatenate([rest[np.isin(m.part, parts), j] for m, rest in pairs])
    return np.asarray(every[np.isfinite(every)])


def variables(m: Log, joint: int, load: Array) -> dict[str, Array]:
    """Series on which a remainder may depend, by name in words, each (N,)."""
    out = {
        "position": m.q[:, joint],
        "velocity": m.v[:, joint],
        "acceleration": m.a[:, joint],
        "load": load,
        "load in the direction of motion": load * np.sign(m.v[:, joint]),
        "time": m.time,
    }
    for other, name in enumerate(m.joints):
        if other != joint and len(m.joints) <= 8:
            out[f"position of {name}"] = m.q[:, other]
            out[f"velocity of {name}"] = m.v[:, other]
    return out


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


def _describe(
    measurements: Sequence[Log],
    predictions: Sequence[Prediction],
    rests: Sequence[Array],
    j: int,
) -> str:
    """In words: what the remainder depends on most."""
    series: dict[str, list[Array]] = {}
    for m, prediction in zip(measurements, predictions, strict=True):
        for name, x in variables(m, j, prediction.torque[:, j]).items():
            series.setdefault(name, []).append(x)
    y = np.concatenate([rest[:, j] for rest in rests])
    shares = {name: explained(y, np.concatenate(x)) for name, x in series.items()}
    best = max(shares, key=lambda name: shares[name])
    joint = measurements[0].joints[j]
    if shares[best] < _TELLING:
        return f"what is left in {joint} {NO_VARIABLE}"
    return f"what is left in {joint} depends on the {best} ({100 * shares[best]:.0f} % of it)"
