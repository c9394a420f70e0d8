"""How far time stamps are off, judged by positions: a stamp late by dt reads speed times dt wrong.

Each sample is compared with the cubic through its four neighbours at their stamps. What it differs
by has a variance of c (s_q^2 + s_t^2 v^2), with the encoder's noise s_q, the stamps' error s_t and
c from the cubic's weights: a straight line over v^2.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from actuators.arrays import Array

#: Groups of rows by speed through which the line is laid.
_GROUPS: Final = 12
#: Median of a squared normal variable.
_MEDIAN_SQUARE: Final = 0.4549364
_LEAST_ROWS: Final = 200


def stamp_error(time: Array, q: Array, gap: float) -> tuple[float, float]:
    """Standard deviation of the stamps' errors and its standard error [s]; zeros if none tells.

    Args:
        time: Strictly increasing, shape (N,) [s].
        q: Positions, shape (N, J) [rad].
        gap: Steps longer than this are none to compare across [s].
    """
    if time.size < _LEAST_ROWS:
        return 0.0, 0.0
    with np.errstate(all="ignore"):  # numbers no clock shows leave no finite row
        return _over_joints(time, q, gap)


def _over_joints(time: Array, q: Array, gap: float) -> tuple[float, float]:
    weights = _lagrange(time)
    scatter = 1.0 + (weights**2).sum(axis=0)
    close = np.diff(time) <= gap
    inside = close[:-3] & close[1:-2] & close[2:-1] & close[3:]
    squares, errors = [], []
    for j in range(q.shape[1]):
        x = q[:, j]
        guess = sum(w * x[k : x.size - 4 + k] for w, k in zip(weights, (0, 1, 3, 4), strict=True))
        rest = (x[2:-2] - guess) ** 2 / scatter
        speed = ((x[3:-1] - x[1:-3]) / (time[3:-1] - time[1:-3])) ** 2
        good = inside & np.isfinite(rest) & np.isfinite(speed)
        seen = _slope(speed[good], rest[good])
        if seen is not None and seen[1] > 0:
            squares.append(seen[0])
            errors.append(seen[1])
    if not squares:
        return 0.0, 0.0
    # By the most certain one: variances of variances are small numbers.
    finest = min(errors)
    weight = (finest / np.array(errors)) ** 2
    square = float(np.average(squares, weights=weight))
    error = finest / float(np.sqrt(weight.sum()))
    size = float(np.sqrt(max(square, 0.0)))
    return size, error / (2.0 * size) if size > 0 else float(np.sqrt(error))


def _lagrange(time: Array) -> Array:
    """Weights of the cubic through four neighbours at the sample between, shape (4, N - 4)."""
    n = time.size - 4
    t = [time[k : k + n] - time[2 : 2 + n] for k in (0, 1, 3, 4)]
    rows = []
    for a in range(4):
        w = np.ones(n)
        for b in range(4):
            if b != a:
                w = w * (-t[b]) / (t[a] - t[b])
        rows.append(w)
    return np.stack(rows)


def _slope(speed: Array, rest: Array) -> tuple[float, float] | None:
    """Slope of squared misfit over squared speed and its standard error; None without motion."""
    if speed.size < _LEAST_ROWS or speed.max() <= 0:
        return None
    order = np.argsort(speed, kind="stable")
    groups = np.array_split(order, _GROUPS)
    x = np.array([speed[g].mean() for g in groups])
    y = np.array([np.median(rest[g]) / _MEDIAN_SQUARE for g in groups])
    # A median of n squares scatters by about 2.3 / sqrt(n) of itself.
    sigma = 2.3 * np.maximum(y, 1e-300) / np.sqrt([g.size for g in groups])
    design = np.stack([np.ones_like(x), x], axis=1) / sigma[:, None]
    if np.ptp(x) <= 0:
        return None
    scale = np.abs(design).max(axis=0)
    if not np.isfinite(scale).all() or not np.isfinite(y / sigma).all():
        return None  # numbers whose squares are beyond any
    covariance = np.linalg.pinv((design / scale).T @ (design / scale))
    solution = covariance @ ((design / scale).T @ (y / sigma)) / scale
    return float(solution[1]), float(np.sqrt(covariance[1, 1]) / scale[1])
