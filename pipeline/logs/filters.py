"""A zero-phase low-pass of finite memory that gives value, velocity and acceleration at once.

The kernel is a sinc of cut-off f_c under a Blackman window of half-length 2 / f_c; its first and
second analytic derivatives are the kernels of velocity and acceleration, so that the three belong
to one and the same smoothed curve. At f_c the amplitude is halved (as by a Butterworth filter run
forward and backward); below 0.4 f_c it is flat, above 1.6 f_c it is nothing. Being finite, it sees
exactly `half` samples to either side. What it leaves over is a channel's noise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, Final, Self

import numpy as np
import scipy  # its signal is loaded where it is first used: every command passes here
from numpy.typing import NDArray

from actuators.arrays import Array, Mask

#: Half-length of the kernel in units of 1 / cut-off.
HALF_LENGTH: Final = 2.0
#: Largest cut-off per sampling rate: above it the kernel would no longer be sampled finely enough.
LARGEST_SHARE: Final = 0.25
#: Share of the cut-off up to which the filter is flat.
FLAT: Final = 0.4
#: A joint whose spectrum nowhere exceeds its noise by this factor stands still.
SEEN: Final = 30.0
#: Density of a joint's speed over its peak from which there is motion at a frequency: the errors
#: of stamps and encoders spread over the whole band and stay below.
MOVED: Final = 0.01
#: Correlation of noise with itself below which two rows count as independent.
REMEMBERED: Final = 0.05
#: Median absolute deviation of a normal distribution per standard deviation.
_MAD: Final = 0.6744897501960817
WHOLE: Final = (slice(None),)
Rows = NDArray[np.intp]
#: A step this many times the usual one is a gap; the filter never runs across it.
GAP: Final = 2.5
#: Times that lie this near to the grid, in steps, need no interpolation.
JITTER_IGNORED: Final = 0.05


@dataclass(frozen=True)
class LowPass:
    """The filter at one sampling rate, of which a cut-off is at most a quarter."""

    rate: float  #: Samples per second [Hz].
    cutoff: float  #: Frequency at which the amplitude is halved [Hz].

    @property
    def half(self) -> int:
        """Samples the kernel reaches to either side."""
        return int(np.ceil(HALF_LENGTH * self.rate / self.cutoff))

    @cached_property
    def kernels(self) -> tuple[Array, Array, Array]:
        """Kernels of value [1], first [1/s] and second derivative [1/s^2], each (2 half + 1,)."""
        half, dt = self.half, 1.0 / self.rate
        k = np.arange(-half, half + 1, dtype=np.float64)
        t, w = k * dt, 2.0 * np.pi * self.cutoff
        safe = np.where(k == 0, 1.0, w * t)
        s0 = np.sinc(w * t / np.pi)
        s1 = np.where(k == 0, 0.0, w * (np.cos(w * t) - s0) / safe)
        s2 = np.where(k == 0, -(w**2) / 3.0, -(w**2) * s0 - 2.0 * w * s1 / safe)
        end = HALF_LENGTH / self.cutoff
        p, inside = np.pi / end, np.abs(t) <= end
        b0 = np.where(inside, 0.42 + 0.5 * np.cos(p * t) + 0.08 * np.cos(2 * p * t), 0.0)
        b1 = np.where(inside, -p * (0.5 * np.sin(p * t) + 0.16 * np.sin(2 * p * t)), 0.0)
        b2 = np.where(inside, -(p**2) * (0.5 * np.cos(p * t) + 0.32 * np.cos(2 * p * t)), 0.0)
        h0, h1, h2 = s0 * b0, s1 * b0 + s0 * b1, s2 * b0 + 2 * s1 * b1 + s0 * b2
        # Sampling leaves an error of moments; constants, ramps and parabolas are made exact.
        h0 /= h0.sum()
        h1 /= -dt * (k * h1).sum()
        h2 -= h0 * h2.sum()
        h2 *= 2.0 / (dt**2 * (k**2 * h2).sum())
        return h0, h1, h2

    @property
    def gains(self) -> Array:
        """Noise of value, first and second derivative per noise of a sample, if white, (3,)."""
        return np.array([np.sqrt((kernel**2).sum()) for kernel in self.kernels])

    @property
    def noise_memory(self) -> float:
        """Time after which filtered white noise correlates with itself by less than 5 % [s]."""
        own = np.correlate(self.kernels[0], self.kernels[0], mode="full")[2 * self.half :]
        return float(np.flatnonzero(np.abs(own) >= REMEMBERED * own[0])[-1] + 1) / self.rate

    def smooth(self, x: Array, pieces: Sequence[slice] = WHOLE) -> Array:
        """Low-passed values, shape as `x` (samples first); ends are continued by point symmetry.

        Pieces are stretches that follow one another and share no sample; all of it by default.
        """
        return self._apply(x, pieces, self.kernels[:1])[0]

    def derivatives(self, x: Array, pieces: Sequence[slice] = WHOLE) -> tuple[Array, Array, Array]:
        """Low-passed value, first and second derivative, each of the shape of `x`."""
        value, first, second = self._apply(x, pieces, self.kernels)
        return value, first, second

    def noises(self, x: Array, pieces: Sequence[slice] = WHOLE) -> tuple[Array, Array, Array]:
        """Noise of value, first and second derivative, each of the shape of `x` (samples first).

        Half the difference of what even and odd rows alone give: another draw of the noise that
        passes, as large where it is large, if samples err independently of one another.
        """
        rest = x - self.smooth(x, pieces)
        rest[1::2] *= -1.0
        return self.derivatives(rest, pieces)

    def share(self, flag: Mask, pieces: Sequence[slice] = WHOLE) -> Array:
        """Share of the kernel's weight on flagged samples (N, C) or beyond the ends, 0 to 1."""
        weight = np.abs(self.kernels[0])[:, None]

        def seen(own: Mask) -> Array:
            ends = (self.half, self.half), (0, 0)
            whole = np.pad(own.astype(np.float64), ends, constant_values=1.0)
            return _summed(whole, weight / weight.sum())

        return np.clip(by_piece(seen, flag, pieces), 0.0, 1.0)

    def _apply(self, x: Array, pieces: Sequence[slice], kernels: Sequence[Array]) -> Array:
        """Every kernel over every column, piece by piece."""
        flat = x.reshape(x.shape[0], -1)
        out = np.empty((len(kernels), *flat.shape))
        for piece in pieces:
            ends = (self.half, self.half), (0, 0)
            own = np.pad(flat[piece], ends, mode="reflect", reflect_type="odd")
            for k, kernel in enumerate(kernels):
                out[k, piece] = _summed(own, kernel[:, None])
        return out.reshape(len(kernels), *x.shape)


def late(x: Array, rows: float) -> Array:
    """A series (N, ...) so many rows later, by cubic splines; its ends keep their value."""
    # Twelve beyond what is asked for: so far a spline's coefficients are not the series' own.
    reach, n = 15 + int(abs(rows)), len(x)
    flat = x.reshape(n, -1)[np.clip(np.arange(-reach, n + reach), 0, n - 1)]
    c = scipy.ndimage.spline_filter1d(flat, axis=0, mode="nearest")
    first, t = divmod(reach - rows, 1.0)
    before, here, far = (1.0 - t) ** 3, 4.0 - 6.0 * t**2 + 3.0 * t**3, t**3
    weights = (before, here, 6.0 - before - here - far, far)
    parts = (w / 6.0 * c[k : k + n] for k, w in enumerate(weights, start=int(first) - 1))
    return np.reshape(sum(parts), x.shape)


def by_piece(function: Callable[[Any], Any], x: Any, pieces: Sequence[slice]) -> Any:
    """What a function makes of every stretch of a series (N, ...), as one series."""
    return np.concatenate([function(x[piece]) for piece in pieces])


def _summed(x: Array, kernel: Array) -> Array:
    """Sums of a series (N, C) over a kernel (K, 1) where it lies inside."""
    return np.asarray(scipy.signal.oaconvolve(x, kernel, mode="valid", axes=0))


def choose_cutoff(
    stretches: Sequence[Array], rate: float, *, smallest: float = 0.0, step: Array | None = None
) -> tuple[Array, float]:
    """Cut-off at which the spectrum of the signal meets that of its noise, per column.

    Below it the signal outweighs the noise, above it the noise the signal: there the sum of lost
    signal and passed noise is least, for the value and every derivative alike (both are weighted
    with the same power of frequency). The noise is taken as white, its level from the upper part
    of the band, and is at least that of rounding: at rest a rounded sensor shows none, and its
    steps in motion look like motion.

    Args:
        stretches: Each without gaps, shape (N, C); their spectra are averaged by length.
        rate: [Hz].
        smallest: Lower bound [Hz].
        step: Of columns that are rounded, shape (C,).

    Returns:
        Shape (C,) [Hz], NaN for a column that never changes or shows nothing but noise; and the
        frequency up to which joints move, by the spectrum of their speeds [Hz].
    """
    out = np.full(stretches[0].shape[1], np.nan)
    moves = np.any([np.ptp(x, axis=0) > 0 for x in stretches], axis=0)
    if not moves.any():
        return out, 0.0
    segment = int(min(max(map(len, stretches)), max(256, 2 ** np.ceil(np.log2(2.0 * rate)))))
    long = [x[:, moves] for x in stretches if x.shape[0] >= segment]
    # Without its trend a stretch leaks less.
    level = [x - np.linspace(x[0], x[-1], x.shape[0]) for x in long]
    spectra = [scipy.signal.welch(x, fs=rate, nperseg=segment, axis=0) for x in level]
    f, power = spectra[0][0], np.average([s for _, s in spectra], axis=0, weights=[*map(len, long)])
    rounded = 0.0 if step is None else step[moves] ** 2 / (6.0 * rate)
    noise = np.maximum(np.median(power[f >= 0.6 * rate / 2], axis=0), rounded)
    speed = np.where(power > SEEN * noise, power, 0.0) * f[:, None] ** 2
    reach = float(f[(speed > MOVED * speed.max(axis=0)).any(axis=1)].max(initial=0.0))
    # Medians over a third of an octave, three bins at least: a lone peak or dip decides nothing.
    bins = np.unique(np.round(2.0 ** (np.arange(0, 12 * np.log2(f.size - 1)) / 12)).astype(int))
    bins = bins[bins < f.size]
    level = [np.median(power[max(1, k - 1 - k // 8) : k + 2 + k // 8], axis=0) for k in bins]
    above = np.array(level) > 2.0 * noise
    first_below = np.where(above.all(axis=0), -1, np.argmin(above, axis=0))
    at_rest = np.max(level[: max(1, bins.size // 2)], axis=0) < SEEN * noise
    found = np.clip(f[bins[first_below]], smallest, LARGEST_SHARE * rate)
    out[moves] = np.where(at_rest, np.nan, found)
    return out, reach


def smoother_noise(x: Array, ok: Mask, pieces: Sequence[slice], lowpass: LowPass) -> Array:
    """Noise of a sample from the band just above the cut-off, taken as white from there downward.

    The series is passed between 1.5 and 3 times the cut-off (or as far as the rate allows); the
    spread of that band, by its median so that jumps do not count, gives the noise's density.

    Args:
        x: Not filtered, shape (N, C).
        ok: Which of it is good, shape (N, C).
        pieces: Stretches without a gap.
        lowpass: The filter above whose band nothing but noise is left.

    Returns:
        Standard deviation up to half the rate, shape (C,); NaN where fewer than 50 samples are
        good. A filter lets its first gain of it pass.
    """
    outer = LowPass(lowpass.rate, min(3.0 * lowpass.cutoff, LARGEST_SHARE * lowpass.rate))
    inner = LowPass(lowpass.rate, min(1.5 * lowpass.cutoff, 0.8 * outer.cutoff))
    band = np.pad(outer.kernels[0], inner.half - outer.half) - inner.kernels[0]
    gain = float(np.sqrt((np.convolve(band, band) ** 2).sum()))
    # Passed twice: what little of the motion the first pass lets through is gone after the second.
    for _ in range(2):
        x = outer.smooth(x, pieces) - inner.smooth(x, pieces)
    seen = [np.abs(r[g]) for r, g in zip(x.T, ok.T, strict=True)]
    sigma = np.array([np.median(r) if r.size >= 50 else np.nan for r in seen])
    return np.asarray(sigma / _MAD / gain)


@dataclass(frozen=True)
class Grid:
    """A uniform grid."""

    time: Array  #: Shape (M,) [s].
    pieces: tuple[slice, ...]  #: Stretches without a gap, slices of the grid's rows.
    nearest: Rows  #: Row of the log that is nearest to each time, shape (M,).

    @classmethod
    def under(cls, time: Array, dt: float, *, bridge: float = 0.0) -> Self:
        """Lay a grid of steps `dt` [s] under a log; steps up to `bridge` [s] are no gaps.

        Every piece has its log's own rows where these are even to within `JITTER_IGNORED` steps.
        """
        cuts = np.flatnonzero(np.diff(time) > max(GAP * dt, bridge)) + 1
        parts = [_even(part, dt) for part in np.split(time, cuts)]
        whole = np.concatenate(parts)
        right = np.clip(np.searchsorted(time, whole), 1, time.size - 1)
        nearer = time[right] - whole < whole - time[right - 1]
        return cls(whole, pieces_of(map(len, parts)), np.where(nearer, right, right - 1))

    def bridged(self, time: Array, x: Array) -> Array:
        """Columns (N, C) of the log's rows on the grid, straight over holes; zeros for none."""
        out = np.zeros((self.time.size, x.shape[1]))
        for j, ok in enumerate(np.isfinite(x).T):
            if ok.any():
                out[:, j] = np.interp(self.time, time[ok], x[ok, j])
        return out

    def missing(self, time: Array, ok: Mask, longest: float) -> Mask:
        """Grid times (M,) between good rows (N,) that are further apart than `longest` [s].

        Neighbouring rows have nothing between them, however far apart.
        """
        rows = np.flatnonzero(ok)
        if not rows.size:
            return np.ones(self.time.size, dtype=np.bool_)
        k = np.searchsorted(time[rows], self.time)
        before, after = rows[np.maximum(k - 1, 0)], rows[np.minimum(k, rows.size - 1)]
        apart = (time[after] - time[before] > longest) & (after - before > 1)
        outside = (self.time < time[rows[0]]) | (self.time > time[rows[-1]])
        return np.asarray(apart & (time[after] != self.time) | outside)


def _even(time: Array, dt: float) -> Array:
    """Times of a piece [s], or where these are uneven, steps `dt` from the first one."""
    span = float(time[-1] - time[0])
    own = span / max(time.size - 1, 1)
    step = own if abs(own / dt - 1.0) < 1e-3 else dt  # a rate that is off by a little
    grid = time[0] + step * np.arange(int(span / step + 1e-9) + 1)
    even = grid.size == time.size and np.abs(grid - time).max() <= JITTER_IGNORED * dt
    return time if even else np.minimum(grid, time[-1])


def pieces_of(lengths: Iterable[int]) -> tuple[slice, ...]:
    """Stretches of so many rows each, one after another."""
    ends = np.cumsum([0, *lengths]).tolist()
    return tuple(slice(a, b) for a, b in pairwise(ends))


def runs_of(flag: Mask) -> tuple[Rows, Rows]:
    """First rows, and rows after the last, of the stretches in which a flag (N,) is set."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flag.astype(np.int8), [0]])))
    return edges[::2], edges[1::2]
