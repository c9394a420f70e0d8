"""Time shift and factor between two channels that should show the same thing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import correlate

from actuators.arrays import Array


@dataclass(frozen=True)
class Skew:
    """How one series lies against another: x(t) = factor * y(t - lag) + offset."""

    lag: float  #: Positive where x comes later [s].
    lag_error: float  #: Standard error from the residual's spread, taken as white [s].
    factor: float  #: Slope at that lag.
    correlation: float  #: At that lag, -1 to 1.


def skew(x: Array, y: Array, dt: float, *, longest: float) -> Skew | None:
    """Find lag and factor by correlation, refined by least squares on y and its rate.

    Args:
        x: Shape (N,), uniform.
        y: Shape (N,), uniform; smooth, since its rate is taken.
        dt: [s].
        longest: Largest lag looked for [s].

    Returns:
        None where either does not vary or fewer than 50 rows are finite.
    """
    reach = max(1, min(int(longest / dt), x.size // 4))
    good = np.isfinite(x) & np.isfinite(y)
    if good.sum() < 50:
        return None
    x0 = np.where(good, x - x[good].mean(), 0.0)
    y0 = np.where(good, y - y[good].mean(), 0.0)
    sx, sy = float(np.sqrt((x0**2).sum())), float(np.sqrt((y0**2).sum()))
    if sx <= 1e-12 * x.size or sy <= 1e-12 * x.size:
        return None
    product = correlate(x0, y0, method="fft")  # at lag k stands k + N - 1
    product = product[x.size - 1 - reach : x.size + reach]
    k = int(np.argmax(np.abs(product))) - reach
    # Where a neighbour is missing the rate of y is meaningless.
    rated = good.copy()
    rated[1:] &= np.isfinite(y[:-1])
    rated[:-1] &= np.isfinite(y[1:])
    # The peak of a slow signal's correlation is flat: the shift is refined by least squares, row
    # by row until less than half a row is left.
    for _ in range(20):
        a = x0[max(0, k) : x.size + min(0, k)]
        b = y0[max(0, -k) : y.size + min(0, -k)]
        both = good[max(0, k) : x.size + min(0, k)] & rated[max(0, -k) : y.size + min(0, -k)]
        columns = np.stack([b, np.gradient(b, dt), np.ones_like(b)], axis=1)[both]
        if columns.shape[0] < 50:
            return None
        solution, *_ = np.linalg.lstsq(columns, a[both], rcond=None)
        factor = float(solution[0])
        if factor == 0.0:
            return None
        fine = -float(solution[1]) / factor
        if abs(fine) <= 0.5 * dt or abs(k) >= reach:
            break
        k = int(np.clip(k + np.clip(round(fine / dt), -reach, reach), -reach, reach))
    rest = a[both] - columns @ solution
    spread = float(np.sqrt((rest**2).mean() / max((columns[:, 1] ** 2).sum(), 1e-300)))
    correlation = float(product[k + reach]) / (sx * sy)
    return Skew(k * dt + float(np.clip(fine, -dt, dt)), spread / abs(factor), factor, correlation)
