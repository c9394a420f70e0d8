"""Speed and acceleration from a position and a velocity column, weighed by their noises.

A differentiated position and a measured velocity are two readings of one thing. Within the
bandwidth each has a noise: of the position s_q |h'| and s_q |h''|, of the velocity s_v |h| and
s_v |h'|, with the norms of the low-pass's kernel and its derivatives. The readings are averaged by
inverse variance, speed and acceleration each for itself. The position is the reference: the
velocity column is first brought to its factor, zero and time, and what the two still differ by
beyond their noises counts as noise of the velocity (a drive's own filter, the other side of a soft
gear).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.signal import correlate

from actuators.arrays import Array, Mask
from pipeline.logs.signals.derivatives import LowPass

#: Correlation with the position's rate below which a velocity column is another thing ...
_SAME: Final = 0.9
#: ... and how far its factor may be from one.
_FACTOR: Final = 0.3
#: Standard deviations by which a difference has to exceed the noises to count as one.
_SURE: Final = 4.0
#: Lags are looked for up to this long [s].
_LONGEST_LAG: Final = 0.1


@dataclass(frozen=True)
class Fusion:
    """How a log's velocity columns enter its speeds."""

    factor: Array  #: Of the column to the position's rate, shape (J,); NaN where it is not used.
    offset: Array  #: Of the column, shape (J,) [rad/s].
    lag: Array  #: Positive where the column is late, shape (J,) [s].
    weight: Array  #: Of the column in speed and in acceleration, shape (2, J), 0 to 1.
    noise: Array  #: Of speed [rad/s] and acceleration [rad/s^2] within the bandwidth, shape (2, J).

    def aligned(self, time: Array, column: Array, j: int) -> Array:
        """A joint's column (N,) at the position's factor, zero and time."""
        good = np.isfinite(column)
        shifted = np.interp(time + self.lag[j], time[good], column[good])
        return np.asarray((shifted - self.offset[j]) / self.factor[j])


def position_alone(position_noise: Array, lowpass: LowPass) -> Fusion:
    """The fusion that takes nothing from a velocity column."""
    none = np.full(position_noise.size, np.nan)
    noise = _norms(lowpass)[1:, None] * np.nan_to_num(position_noise)
    return Fusion(none, none, none, np.zeros((2, none.size)), noise)


def fuse_by_noise(
    time: Array,
    column: Array,
    ok: Mask,
    rates: tuple[Array, Array],
    noises: tuple[Array, Array],
    pieces: tuple[slice, ...],
    lowpass: LowPass,
) -> Fusion:
    """Weigh velocity columns against differentiated positions.

    Args:
        time: Uniform within each piece, shape (N,) [s].
        column: Velocity as measured, shape (N, J) [rad/s]; NaN where it was not.
        ok: Where the position's rate is good, shape (N, J).
        rates: First and second derivative of the filtered position, each (N, J).
        noises: Standard deviation of a sample of position [rad] and velocity [rad/s], each (J,).
        pieces: Stretches without a gap.
        lowpass: The filter.
    """
    joints = column.shape[1]
    h0, h1, h2 = _norms(lowpass)
    own = np.stack([h1, h2])[:, None] * np.nan_to_num(noises[0])
    factor, offset, lag = (np.full(joints, np.nan) for _ in range(3))
    weight, noise = np.zeros((2, joints)), own.copy()
    longest = max(pieces, key=lambda p: p.stop - p.start)
    for j in range(joints):
        good = ok[:, j] & np.isfinite(column[:, j])
        if not np.isfinite(noises[1][j]) or good.mean() < 0.5:
            continue
        filled = np.interp(time, time[good], column[good, j])
        smooth = lowpass.smooth(filled[longest, None])[:, 0]
        rate = np.where(ok[longest, j], rates[0][longest, j], np.nan)
        seen = skew(smooth, rate, 1.0 / lowpass.rate, longest=_LONGEST_LAG)
        if seen is None or seen.correlation < _SAME or abs(seen.factor - 1.0) > _FACTOR:
            continue
        late = seen.lag if abs(seen.lag) > 4.0 * seen.lag_error else 0.0
        factor[j], lag[j], offset[j] = seen.factor, late, 0.0
        fusion = Fusion(factor, offset, lag, weight, noise)
        straight = fusion.aligned(time, filled, j)
        offset[j] = seen.factor * float(np.mean((straight - rates[0][:, j])[good]))
        straight = straight - offset[j] / seen.factor
        theirs = np.array([h0, h1]) * noises[1][j] / seen.factor
        # So much may the scatter of a stretch exceed the noise by chance, at `_SURE` deviations.
        independent = max(2.0 * lowpass.cutoff * (longest.stop - longest.start) / lowpass.rate, 1.0)
        sure = 1.0 + _SURE * float(np.sqrt(2.0 / independent))
        inside = np.array(ok[longest, j])
        inside[: lowpass.half] = inside[inside.size - lowpass.half :] = False
        if not inside.any():
            continue
        readings = lowpass.derivatives(straight[longest, None])[:2]
        for order in (0, 1):
            differ = (readings[order][:, 0] - rates[order][longest, j])[inside]
            excess = float(np.mean(differ**2)) - sure * own[order, j] ** 2
            both = max(theirs[order] ** 2, excess, 1e-300)
            weight[order, j] = own[order, j] ** 2 / (own[order, j] ** 2 + both)
            noise[order, j] = np.sqrt(weight[order, j] * both)
    return Fusion(factor, offset, lag, weight, noise)


def _norms(lowpass: LowPass) -> Array:
    """Noise of filtered value, first and second derivative per noise of a sample, shape (3,)."""
    return np.array([np.sqrt((kernel**2).sum()) for kernel in lowpass.kernels])


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
