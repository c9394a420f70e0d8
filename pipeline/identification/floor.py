"""The one noise floor: of the sensors in the band, with what the model's own inputs make of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.identification.fit import Fit
from pipeline.identification.tolerances import Slope
from pipeline.logs.log import TRAIN, VALIDATION, Log
from pipeline.machine.machine import MachineModel
from pipeline.simulation.on_legs import is_on_legs, motion_noise
from pipeline.simulation.predict import Simulator

_SEED: Final = 7


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
    """Noise of torque, speed and acceleration, and what the estimates leave open, each (J, C).

    Args:
        fit: What is told.
        floor: Sensors' noise, shape (J, C).
    """
    rates = [rate_noise(d.measurement, fit.design.model) for d in fit.design.data_sets]
    noise, open_ = np.hypot(floor, np.mean(rates, axis=0)), np.zeros_like(floor)
    stated = np.zeros(fit.design.size, dtype=np.bool_)
    for t, columns in zip(fit.design.terms, fit.design.columns, strict=True):
        stated[columns] = bool(t.block) and t.bound == 1.0 and not isinstance(t.effect, Slope)
    for e in fit.design.equations:
        if e.joint == len(floor):  # a base
            continue
        # Test rows, where there are any: another motion may ask for what the first did not show.
        rows = e.chunk < 0 if (e.chunk < 0).any() else e.chunk >= 0
        mine, at = fit.among(e.ids)
        grow = (fit.spread[fit.active] / np.sqrt(np.diag(fit.covariance)))[at]
        own = fit.covariance[np.ix_(at, at)] * np.outer(grow, grow)
        # What the file does not hold is as unsure as its stated size.
        rest = stated[fit.active][at]
        own[rest] = own[:, rest] = 0.0
        own[rest, rest] = fit.design.unit[fit.active][at][rest] ** 2
        X = e.X[mine][:, rows]
        open_[e.joint, e.channel] = np.sqrt(np.mean(np.sum(X * (own @ X), axis=0)))
    return noise, open_


def rate_noise(m: Log, model: MachineModel) -> Array:
    """Noise of the prediction by that of speed and acceleration, in the band, shape (J, C)."""
    if is_on_legs(model, m):
        return motion_noise(model, m)
    if m.rate_noise is None:
        return np.zeros_like(m.noise)
    drawn = np.random.default_rng(_SEED).standard_normal((2, *m.q.shape))
    drawn = np.stack([m.smooth(x) for x in drawn])
    drawn = drawn / np.maximum(drawn.std(axis=1, keepdims=True), 1e-300)
    off = drawn * m.rate_noise[:, None]
    simulated = [
        Simulator(x).predict(model).effort for x in (m, replace(m, v=m.v + off[0], a=m.a + off[1]))
    ]
    change = m.smooth(simulated[1] - simulated[0])
    return np.asarray(change.std(axis=0))
