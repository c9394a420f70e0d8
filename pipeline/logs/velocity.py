"""Speed and acceleration from a position and a velocity column, weighed by their noises.

A differentiated position and a measured velocity are two readings of one thing. Within the
bandwidth each has a noise: of the position s_q |h'| and s_q |h''|, of the velocity s_v |h| and
s_v |h'|, with the norms of the low-pass's kernels. They are averaged by inverse variance, speed and
acceleration each for itself. The position is the reference: the velocity column is first brought to
its factor, zero and time, and what the two still differ by beyond their noises counts as noise of
the velocity (a drive's own filter, the other side of a soft gear).
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from scipy.signal import correlate

from actuators.arrays import Array, Mask
from pipeline.logs.filters import LowPass

#: Correlation with the position's rate below which a velocity column is another thing ...
_SAME: Final = 0.9
#: ... and how far its factor may be from one.
_FACTOR: Final = 0.3
#: Standard deviations by which a difference has to exceed the noises to count as one.
_SURE: Final = 4.0
#: Lags are looked for up to this long [s].
_LONGEST_LAG: Final = 0.1


class Weighed(NamedTuple):
    """What a velocity column says of one joint."""

    column: Array  #: At the position's factor, zero and time, shape (N,) [rad/s].
    weight: Array  #: In speed and acceleration, shape (2,), 0 to 1.
    noise: Array  #: Of speed [rad/s] and acceleration [rad/s^2], averaged so, shape (2,).


def weigh(
    time: Array,
    column: Array,
    rates: tuple[Array, Array],
    ok: Mask,
    noises: tuple[float, float],
    lowpass: LowPass,
    longest: slice,
) -> Weighed | None:
    """Weigh a velocity column against the differentiated position; None where it says nothing.

    Args:
        time: Uniform within `longest`, shape (N,) [s].
        column: As measured, shape (N,) [rad/s]; NaN where it was not.
        rates: First and second derivative of the filtered position, each (N,).
        ok: Where the position's rate is good, shape (N,).
        noises: Standard deviation of a sample of position [rad] and of velocity [rad/s].
        lowpass: The filter.
        longest: The longest stretch without a gap among those that tell most.
    """
    good = ok & np.isfinite(column)
    if not np.isfinite(noises[1]) or good.mean() < 0.5:
        return None
    h0, h1, h2 = lowpass.gains
    own = np.array([h1, h2]) * np.nan_to_num(noises[0])
    filled = np.interp(time, time[good], column[good])
    smooth = lowpass.smooth(filled[longest])
    rate = np.where(ok[longest], rates[0][longest], np.nan)
    seen = skew(smooth, rate, 1.0 / lowpass.rate, longest=_LONGEST_LAG)
    if seen is None or seen.correlation < _SAME or abs(seen.factor - 1.0) > _FACTOR:
        return None
    late = seen.lag if abs(seen.lag) > 4.0 * seen.lag_error else 0.0
    straight = np.interp(time + late, time, filled) / seen.factor
    straight -= float(np.mean((straight - rates[0])[good]))
    theirs = np.array([h0, h1]) * noises[1] / seen.factor
    # So much may the scatter of a stretch exceed the noise by chance, at `_SURE` deviations.
    size = longest.stop - longest.start
    sure = 1.0 + _SURE * float(np.sqrt(2.0 / max(2.0 * lowpass.cutoff * size / lowpass.rate, 1.0)))
    inside = np.array(ok[longest])
    inside[: lowpass.half] = inside[inside.size - lowpass.half :] = False
    if not inside.any():
        return None
    readings = lowpass.derivatives(straight[longest])[:2]
    weight, noise = np.zeros(2), own.copy()
    for order in (0, 1):
        differ = (readings[order] - rates[order][longest])[inside]
        excess = float(np.mean(differ**2)) - sure * own[order] ** 2
        both = max(theirs[order] ** 2, excess, 1e-300)
        weight[order] = own[order] ** 2 / (own[order] ** 2 + both)
        noise[order] = np.sqrt(weight[order] * both)
    return Weighed(straight, weight, noise)


class Skew(NamedTuple):
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
        mine = slice(max(0, k), x.size + min(0, k))
        other = slice(max(0, -k), y.size + min(0, -k))
        a, b, both = x0[mine], y0[other], good[mine] & rated[other]
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
