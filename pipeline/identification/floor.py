"""The one noise floor: of the sensors in the band, with what the model's own inputs make of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from actuators.arrays import Array
from pipeline.identification.fit import Fit
from pipeline.identification.tolerances import Slope
from pipeline.logs.log import TRAIN, VALIDATION, Log
from pipeline.simulation.on_legs import is_on_legs, motion_noise


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
    first = measurements[0]
    stated = [[noise.get(c, {}).get(j, 0.0) for c in first.channels] for j in first.joints]
    return tuple(replace(m, noise=np.maximum(m.noise, stated)) for m in measurements)


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
