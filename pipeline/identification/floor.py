"""The one noise floor: of the sensors in the band, with what the model's own inputs make of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.identification.design import Equation
from pipeline.identification.fit import Fit, saturated
from pipeline.identification.tolerances import Slope
from pipeline.logs.log import TRAIN, VALIDATION, Log

#: Triples of neighbouring rows below which they do not give the noise.
_FOLLOWING: Final = 50


def floor_of(measurements: Sequence[Log], *parts: int) -> Array:
    """Standard deviation of the noise, shape (J, C), of the logs with rows in some parts.

    Args:
        measurements: One per log.
        parts: Training and validation rows by default: test logs have no say, in this neither.
    """
    own = [m for m in measurements if np.isin(m.part, parts or (TRAIN, VALIDATION)).any()]
    return np.asarray(np.sqrt(np.mean([m.noise**2 for m in own or measurements], axis=0)))


def with_noise(
    measurements: Sequence[Log], noise: Mapping[str, Mapping[str, float]]
) -> tuple[Log, ...]:
    """Measurements whose noise is at least that of a model file, channel to joint to value."""
    out = []
    for m in measurements:
        level = m.noise.copy()
        for c, channel in enumerate(m.channels):
            for j, joint in enumerate(m.joints):
                level[j, c] = max(level[j, c], noise.get(channel, {}).get(joint, 0.0))
        out.append(replace(m, noise=level))
    return tuple(out)


def noise_left(fit: Fit, first: Fit, floor: Array) -> tuple[Array, Array]:
    """Noise that no motion makes, and what the estimates leave open, each (J, C).

    Args:
        fit: What is told.
        first: Blocks alone on a design of everything that was offered.
        floor: Sensors' noise, shape (J, C).
    """
    noise, open_ = floor.copy(), np.zeros_like(floor)
    kernel = fit.design.data_sets[0].measurement.kernel
    for e in first.design.equations:
        fast = fast_noise(e, kernel)
        if np.isfinite(fast):
            noise[e.joint, e.channel] = max(noise[e.joint, e.channel], fast)
    stated = np.zeros(fit.design.size, dtype=np.bool_)
    for t, columns in zip(fit.design.terms, fit.design.columns, strict=True):
        stated[columns] = bool(t.block) and t.bound == 1.0 and not isinstance(t.effect, Slope)
    for e in fit.design.equations:
        # Test rows, where there are any: another motion may ask for what the first did not show.
        rows = e.chunk < 0 if (e.chunk < 0).any() else e.chunk >= 0
        where = np.full(fit.design.size, -1)
        where[fit.active] = np.arange(fit.active.size)
        mine = np.flatnonzero(where[e.ids] >= 0)
        at = where[e.ids[mine]]
        grow = (fit.spread[fit.active] / np.sqrt(np.diag(fit.covariance)))[at]
        own = fit.covariance[np.ix_(at, at)] * np.outer(grow, grow)
        # What the file does not hold is as unsure as its stated size.
        rest = stated[fit.active][at]
        own[rest] = own[:, rest] = 0.0
        own[rest, rest] = fit.design.unit[fit.active][at][rest] ** 2
        X = e.X[mine][:, rows]
        open_[e.joint, e.channel] = np.sqrt(np.mean(np.sum(X * (own @ X), axis=0)))
    return noise, open_


def fast_noise(e: Equation, kernel: Array | None) -> float:
    """Noise by second differences of what a fit of everything leaves.

    What goes with the motion changes little from row to row, so that of it next to nothing is left
    in r[k-1] - 2 r[k] + r[k+1]; of noise that is white up to the cut-off, with the correlation rho
    of neighbours that the low-pass gives it, the variance is (6 - 8 rho_1 + 2 rho_2) sigma^2.
    """
    known = e.chunk >= 0
    r, row = (e.r - saturated(e) @ e.X)[known], e.row[known]
    if row.size < 3:
        return float("nan")
    step = int(np.median(np.diff(row)))
    rho = _correlation(kernel, step)
    follows = np.diff(row) == step
    inner = follows[:-1] & follows[1:]
    second = (r[:-2] - 2.0 * r[1:-1] + r[2:])[inner]
    gain = 6.0 - 8.0 * rho[0] + 2.0 * rho[1]
    return float(np.sqrt(np.mean(second**2) / gain)) if second.size > _FOLLOWING else float("nan")


def _correlation(kernel: Array | None, step: int) -> tuple[float, float]:
    """Correlation of white noise behind a low-pass over one and two steps."""
    if kernel is None:
        return 0.0, 0.0
    full = np.correlate(kernel, kernel, "full") / float(kernel @ kernel)
    middle = kernel.size - 1
    one, two = (full[middle + k * step] if k * step <= middle else 0.0 for k in (1, 2))
    return float(one), float(two)
