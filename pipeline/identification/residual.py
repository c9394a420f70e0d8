"""The one noise floor, and what a model leaves of the gap by joint and channel, in words.

The floor is of the sensors in the band, with what the model's own inputs make of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.effects.base import CHANNEL_UNITS
from pipeline.identification import results as limits
from pipeline.identification.fit import Fit, independent
from pipeline.identification.results import Residual
from pipeline.identification.settings import COLOURED
from pipeline.identification.tolerances import Slope
from pipeline.identification.where import gap_of
from pipeline.logs.log import TEST, TRAIN, VALIDATION, Log
from pipeline.simulation.equations import is_on_legs, motion_noise
from pipeline.simulation.predict import Prediction

_BINS: Final = 12
#: Share of the remaining variance that a variable's curve explains, to be worth a word.
_TELLING: Final = 0.08
#: What is said of a remainder that depends on nothing.
NO_VARIABLE: Final = "depends on no single variable of the motion"


def floor_of(measurements: Sequence[Log], *parts: int) -> Array:
    """Standard deviation of the noise, shape (J, C), of the logs with rows in some parts.

    Args:
        measurements: One per log.
        parts: Training and validation rows by default: test logs have no say, in this neither.
    """
    own = [m for m in measurements if np.isin(m.part, parts or (TRAIN, VALIDATION)).any()]
    return np.asarray(np.sqrt(np.mean([m.noise**2 for m in own or measurements], axis=0)))


def noise_left(fit: Fit, floor: Array) -> tuple[Array, Array]:
    """Noise of torque and motion, and what the estimates leave open, each (J, C).

    Args:
        fit: What is told.
        floor: Sensors' noise, shape (J, C).
    """
    logs = [d.measurement for d in fit.design.data_sets]
    # On legs that of the motion stands in the rows' covariances and not in the sensors' noise.
    moved = [motion_noise(fit.design.model, m) for m in logs if is_on_legs(fit.design.model, m)]
    noise = np.hypot(floor, np.mean(moved, axis=0)) if moved else floor
    open_ = np.zeros_like(floor)
    stated = np.zeros(fit.design.size, dtype=np.bool_)
    for t, columns in zip(fit.design.terms, fit.design.columns, strict=True):
        stated[columns] = bool(t.block) and t.bound == 1.0 and not isinstance(t.effect, Slope)
    for e in fit.design.equations:
        if e.joint >= len(floor):  # a base
            continue
        # Test rows, where there are any: another motion may ask for what the first did not show.
        rows = e.chunk < 0 if (e.chunk < 0).any() else e.chunk >= 0
        live, at = fit.among(e.ids)
        told = ~stated[e.ids[live]]
        X, at = e.X[live[told]][:, rows], at[told]
        grow = (fit.spread[fit.active] / np.sqrt(np.diag(fit.covariance)))[at]
        own = fit.covariance[np.ix_(at, at)] * np.outer(grow, grow)
        # What the file does not hold is as unsure as its stated size.
        rest = np.flatnonzero(stated[e.ids] & np.isin(e.ids, fit.offered))
        tolerated = fit.design.unit[e.ids[rest]] ** 2 @ e.X[rest][:, rows] ** 2
        open_[e.joint, e.channel] = np.sqrt(np.mean(np.sum(X * (own @ X), axis=0) + tolerated))
    return noise, open_


def residuals(
    measurements: Sequence[Log], predictions: Sequence[Prediction]
) -> tuple[Residual, ...]:
    """What a model leaves, by joint and channel, described where it is significant.

    On test rows or on those that were learnt from, whichever is more against its noise: a test that
    does not go where the model fails does not make it true.

    Args:
        measurements: One per log.
        predictions: Of the model, one per log.
    """
    first, out = measurements[0], []
    part, q, v, a, time = (
        np.concatenate([getattr(m, name) for m in measurements])
        for name in ("part", "q", "v", "a", "time")
    )
    sides = [(which, floor_of(measurements, *which)) for which in ((TEST,), (TRAIN, VALIDATION))]
    load = np.concatenate([p.torque for p in predictions])
    for j, joint in enumerate(first.joints):
        series = {"position": q[:, j], "time": time, "load": load[:, j]}
        against = {f"{name}, as friction does": x for name, x in series.items()}
        series |= {"velocity": v[:, j], "acceleration": a[:, j]}
        for k, other in enumerate(first.joints if len(first.joints) <= 8 else ()):
            if k != j:
                series |= {f"position of {other}": q[:, k], f"velocity of {other}": v[:, k]}
        for c, channel in enumerate(first.channels):
            pairs = zip(measurements, predictions, strict=True)
            rest = np.concatenate([gap_of(m, p, c)[:, j] for m, p in pairs])
            known = np.isfinite(rest)
            own = [rest[known & np.isin(part, which)] for which, _ in sides]
            sizes = [float(np.sqrt(np.mean(x**2))) if x.size else 0.0 for x in own]
            errors = zip(sizes, (float(floor[j, c]) for _, floor in sides), strict=True)
            error, level = max(errors, key=lambda pair: pair[0] / max(pair[1], 1e-300))
            text = ""
            if error > limits.UNEXPLAINED * level:
                both = (rest, series), (rest * np.sign(v[:, j]), against)
                every = ((explained(x, one), name) for x, of in both for name, one in of.items())
                share, variable = max(every)
                if share >= _TELLING:
                    text = f"depends on the {variable} ({100 * share:.0f} % of it)"
                elif error > COLOURED * level:
                    text = NO_VARIABLE
            text = f"what is left in {joint} {text}" if text else ""
            unit = CHANNEL_UNITS[channel]
            out.append(Residual(joint, channel, error, level, unit, bool(text), text, own[0].size))
    return tuple(out)


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
