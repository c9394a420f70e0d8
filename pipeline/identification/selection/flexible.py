"""Shapes that have no name: friction over speed, load and travel, torque over position.

Where they explain something in addition to all that was named, the law there is not in the
catalogue; a name that they make superfluous is no more than an approximation of it. Sensors, bodies
and delays are told from them by what they do at other joints and accelerations.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.identification.regression.design_matrix import Bench
from pipeline.identification.regression.problem import Problem
from pipeline.logs.prepared.measurement import Measurement
from pipeline.simulation.predict import Prediction

Array = NDArray[np.float64]
#: Knots over speed, at quantiles of what occurs; over travel since the last reversal [rad].
_SPEEDS: Final = (0.05, 0.3, 0.55, 0.8, 0.98)
_TRAVELS: Final = (0.003, 0.01, 0.03, 0.1, 0.3)
_HARMONICS: Final = 5


def flexible_columns(problem: Problem, joint: int) -> list[list[dict[int, Array]]]:
    """Columns of the shapes of one joint, whitened, per log and column."""
    m = problem.benches[0].measurement
    speed = np.abs(m.v[:, joint])
    knots = np.unique(np.quantile(speed[speed > 0], _SPEEDS)) if (speed > 0).any() else np.empty(0)
    q = np.concatenate([b.measurement.q[:, joint] for b in problem.benches])
    span = (float(q.min()), float(np.ptp(q)))
    out = []
    for bench, prediction in zip(problem.benches, problem.predictions(), strict=True):
        shapes = _shapes(bench.measurement, prediction, joint, knots, span)
        out.append([_whitened(bench, shape, joint, problem.sigma) for shape in shapes])
    return out


def _shapes(
    m: Measurement, prediction: Prediction, joint: int, knots: Array, span: tuple[float, float]
) -> list[Array]:
    """Series (N,) of the shapes of one joint."""
    q, v = m.q[:, joint], m.v[:, joint]
    sense = np.tanh(v / m.rest_speed[joint])
    load = np.abs(prediction.torque[:, joint])
    out = []
    for hat in _hats(np.abs(v), knots):
        out += [hat * sense, hat * sense * load, hat]
    since = np.concatenate([_travel(q[p], v[p]) for p in m.pieces])
    out += [sense * np.exp(-since / length) for length in _TRAVELS]
    if span[1] > 0.0:
        angle = 2.0 * np.pi * (q - span[0]) / (2.0 * span[1])
        for k in range(1, _HARMONICS + 1):
            out += [np.cos(k * angle), np.sin(k * angle)]
        out += [np.cos(angle) * sense, np.sin(angle) * sense]
    return out


def _hats(x: Array, knots: Array) -> list[Array]:
    """Piecewise linear functions that sum to one."""
    if knots.size < 2:
        return [np.ones_like(x)]
    rows = np.eye(knots.size)
    return [np.interp(x, knots, row) for row in rows]


def _travel(q: Array, v: Array) -> Array:
    """Distance since the last reversal, (N,)."""
    turned = np.flatnonzero(np.signbit(v[1:]) != np.signbit(v[:-1])) + 1
    start = np.zeros(q.size, dtype=np.intp)
    start[turned] = turned
    return np.abs(q - q[np.maximum.accumulate(start)])


def _whitened(bench: Bench, series: Array, joint: int, sigma: Array) -> dict[int, Array]:
    channels = len(bench.measurement.channels)
    values = np.repeat(series[:, None, None], channels, axis=2)
    return bench.whitened(values, [joint], sigma)
