"""Speed and acceleration from a position and a velocity column, weighed by their noises.

A differentiated position and a measured velocity are two readings of one thing. Within the
bandwidth each has a noise: of the position s_q |h'| and s_q |h''|, of the velocity s_v |h| and
s_v |h'|, with the norms of the low-pass's kernels. They are averaged by inverse variance, speed and
acceleration each for itself. The position is the reference: the velocity column is first brought to
its factor, zero and time, and what the two still differ by beyond their noises counts as noise of
the velocity (a drive's own filter, the other side of a soft gear).
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.signal import correlate

from actuators.arrays import Array, Mask
from pipeline.logs.filters import LowPass

#: Correlation with the position's rate below which a velocity column is another thing ...
SAME: Final = 0.9
#: ... and how far its factor may be from one.
FACTOR: Final = 0.3
#: Standard deviations by which a difference has to exceed the noises to count as one.
_SURE: Final = 4.0
#: Lags are looked for up to this long [s].
_LONGEST_LAG: Final = 0.1


def weigh(
    time: Array,
    column: Array,
    rates: tuple[Array, Array],
    ok: Mask,
    noises: tuple[float, float],
    lowpass: LowPass,
    longest: slice,
) -> tuple[Array, Array, Array] | None:
    """Weigh a velocity column against the differentiated position; None where it says nothing.

    Args:
        time: Uniform within `longest`, shape (N,) [s].
        column: As measured, shape (N,) [rad/s]; NaN where it was not.
        rates: First and second derivative of the filtered position, each (N,).
        ok: Where the position's rate is good, shape (N,).
        noises: Standard deviation of a sample of position [rad] and of velocity [rad/s].
        lowpass: The filter.
        longest: The longest stretch without a gap among those that tell most.

    Returns:
        The column at the position's factor, zero and time, (N,); its weight in speed and in
        acceleration, 0 to 1, and the noise of both so averaged, each (2,).
    """
    good = ok & np.isfinite(column)
    inside = np.array(ok[longest])
    inside[: lowpass.half] = inside[inside.size - lowpass.half :] = False
    if not np.isfinite(noises[1]) or good.mean() < 0.5 or not inside.any():
        return None
    filled = np.interp(time, time[good], column[good])
    rate = np.where(ok[longest], rates[0][longest], np.nan)
    seen = _skew(lowpass.smooth(filled[longest]), rate, 1.0 / lowpass.rate)
    if seen is None or abs(seen[1] - 1.0) > FACTOR:
        return None
    late, factor = seen
    straight = np.interp(time + late, time, filled) / factor
    straight -= float(np.mean((straight - rates[0])[good]))
    h0, h1, h2 = lowpass.gains
    own, theirs = np.array([h1, h2]) * np.nan_to_num(noises[0]), np.array([h0, h1]) * noises[1]
    # So much may the scatter of a stretch exceed the noise by chance, at `_SURE` deviations.
    samples = 2.0 * lowpass.cutoff * inside.size / lowpass.rate
    sure = 1.0 + _SURE * float(np.sqrt(2.0 / max(samples, 1.0)))
    readings = lowpass.derivatives(straight[longest])
    differ = [np.mean((readings[k] - rates[k][longest])[inside] ** 2) for k in (0, 1)]
    both = np.maximum((theirs / factor) ** 2, np.array(differ) - sure * own**2)
    both = np.maximum(both, 1e-300)
    weight = own**2 / (own**2 + both)
    return straight, weight, np.sqrt(weight * both)


def _skew(x: Array, y: Array, dt: float) -> tuple[float, float] | None:
    """Lag [s] and factor of x(t) = factor * y(t - lag) + offset; None where they are not alike.

    By correlation, refined by least squares on y and its rate; a lag within its error is none.
    """
    reach = max(1, min(int(_LONGEST_LAG / dt), x.size // 4))
    good = np.isfinite(x) & np.isfinite(y)
    if good.sum() < 50:
        return None
    x0, y0 = (np.where(good, z - z[good].mean(), 0.0) for z in (x, y))
    size = float(np.sqrt((x0**2).sum() * (y0**2).sum()))
    product = correlate(x0, y0, method="fft")  # at lag k stands k + N - 1
    product = product[x.size - 1 - reach : x.size + reach]
    k = int(np.argmax(np.abs(product))) - reach
    # Where a neighbour is missing the rate of y is meaningless.
    rated = good.copy()
    rated[1:] &= good[:-1]
    rated[:-1] &= good[1:]
    # The peak of a slow signal's correlation is flat: the shift is refined by least squares, row
    # by row until less than half a row is left.
    for _ in range(20):
        mine, other = slice(max(0, k), x.size + min(0, k)), slice(max(0, -k), x.size + min(0, -k))
        a, b, both = x0[mine], y0[other], good[mine] & rated[other]
        columns = np.stack([b, np.gradient(b, dt), np.ones_like(b)], axis=1)[both]
        solution = np.linalg.lstsq(columns, a[both], rcond=None)[0]
        factor, fine = float(solution[0]), -float(solution[1]) / (float(solution[0]) or np.inf)
        if columns.shape[0] < 50 or abs(fine) <= 0.5 * dt or abs(k) >= reach:
            break
        k = int(np.clip(k + np.clip(round(fine / dt), -reach, reach), -reach, reach))
    if columns.shape[0] < 50 or product[k + reach] < SAME * size or size == 0.0:
        return None
    rest = a[both] - columns @ solution
    spread = float(np.sqrt((rest**2).mean() / max((columns[:, 1] ** 2).sum(), 1e-300)))
    lag = k * dt + float(np.clip(fine, -dt, dt))
    return (lag if abs(lag) > 4.0 * spread / abs(factor) else 0.0), factor
