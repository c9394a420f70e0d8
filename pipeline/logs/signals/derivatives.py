"""A zero-phase low-pass of finite memory that gives value, velocity and acceleration at once.

The kernel is a sinc of cut-off f_c under a Blackman window of half-length 2 / f_c; its first and
second analytic derivatives are the kernels of velocity and acceleration, so that the three belong
to one and the same smoothed curve. At f_c the amplitude is halved (as by a Butterworth filter run
forward and backward); below 0.4 f_c it is flat, above 1.6 f_c it is nothing. Being finite, it sees
exactly `memory` seconds to either side: rows further apart than twice that share no sample, and
chunks that overlap by it give the output of the whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.signal import oaconvolve, welch

from actuators.arrays import Array
from pipeline.logs.errors import PreparationError

#: Half-length of the kernel in units of 1 / cut-off.
HALF_LENGTH: Final = 2.0
#: Largest cut-off per sampling rate: above it the kernel would no longer be sampled finely enough.
LARGEST_SHARE: Final = 0.25
#: A joint whose spectrum nowhere exceeds its noise by this factor stands still.
SEEN: Final = 30.0
#: A series without a gap.
WHOLE: Final = (slice(None),)


@dataclass(frozen=True)
class LowPass:
    """The filter at one sampling rate.

    Raises:
        PreparationError: The cut-off is not between zero and a quarter of the rate.
    """

    rate: float  #: Samples per second [Hz].
    cutoff: float  #: Frequency at which the amplitude is halved [Hz].

    def __post_init__(self) -> None:
        if not 0 < self.cutoff <= LARGEST_SHARE * self.rate * (1 + 1e-9):
            raise PreparationError(
                f"cut-off {self.cutoff:g} Hz does not fit a log sampled at {self.rate:g} Hz; "
                f"expected up to {LARGEST_SHARE * self.rate:g} Hz"
            )

    @property
    def half(self) -> int:
        """Samples the kernel reaches to either side."""
        return int(np.ceil(HALF_LENGTH * self.rate / self.cutoff))

    @property
    def memory(self) -> float:
        """Time the kernel reaches to either side [s]."""
        return self.half / self.rate

    @cached_property
    def kernels(self) -> tuple[Array, Array, Array]:
        """Kernels of value [1], first [1/s] and second derivative [1/s^2], each (2 half + 1,)."""
        half, dt = self.half, 1.0 / self.rate
        k = np.arange(-half, half + 1, dtype=np.float64)
        t = k * dt
        end = HALF_LENGTH / self.cutoff
        w = 2.0 * np.pi * self.cutoff
        x = w * t
        with np.errstate(invalid="ignore", divide="ignore"):
            s0 = np.sinc(x / np.pi)
            s1 = w * (np.cos(x) - s0) / x
            s2 = -(w**2) * s0 - 2.0 * w * s1 / x
        s1[half], s2[half] = 0.0, -(w**2) / 3.0
        p = np.pi / end
        inside = np.abs(t) <= end
        b0 = np.where(inside, 0.42 + 0.5 * np.cos(p * t) + 0.08 * np.cos(2 * p * t), 0.0)
        b1 = np.where(inside, -p * (0.5 * np.sin(p * t) + 0.16 * np.sin(2 * p * t)), 0.0)
        b2 = np.where(inside, -(p**2) * (0.5 * np.cos(p * t) + 0.32 * np.cos(2 * p * t)), 0.0)
        h0 = s0 * b0
        h1 = s1 * b0 + s0 * b1
        h2 = s2 * b0 + 2 * s1 * b1 + s0 * b2
        # Sampling leaves an error of moments; constants, ramps and parabolas are made exact.
        h0 /= h0.sum()
        h1 /= -dt * (k * h1).sum()
        h2 -= h0 * h2.sum()
        h2 *= 2.0 / (dt**2 * (k**2 * h2).sum())
        return h0, h1, h2

    @property
    def noise_gain(self) -> float:
        """Standard deviation of filtered white noise per standard deviation of the noise."""
        return float(np.sqrt((self.kernels[0] ** 2).sum()))

    def smooth(self, x: Array, pieces: Sequence[slice] = WHOLE) -> Array:
        """Low-passed values, shape as `x` (samples first); ends are continued by point symmetry.

        Pieces are stretches that follow one another and share no sample; all of it by default.
        """
        return np.concatenate([self._apply(x[piece], (0,))[0] for piece in pieces])

    def derivatives(self, x: Array, pieces: Sequence[slice] = WHOLE) -> tuple[Array, Array, Array]:
        """Low-passed value, first and second derivative, each of the shape of `x`."""
        parts = [self._apply(x[piece], (0, 1, 2)) for piece in pieces]
        value, first, second = (np.concatenate(orders) for orders in zip(*parts, strict=True))
        return value, first, second

    def share(self, flag: NDArray[np.bool_], pieces: Sequence[slice] = WHOLE) -> Array:
        """Share of the kernel's weight on flagged samples or beyond the ends, (N, C), 0 to 1."""
        weight = np.abs(self.kernels[0])
        return np.concatenate([self._share(flag[piece], weight / weight.sum()) for piece in pieces])

    def _share(self, flag: NDArray[np.bool_], weight: Array) -> Array:
        n, half = flag.shape[0], self.half
        # Weight beyond the ends is the tail sum of the kernel.
        tail = np.concatenate([np.cumsum(weight[::-1])[:half][::-1], np.zeros(max(0, n - half))])
        ends = tail[:n] + tail[:n][::-1]
        out = np.repeat(ends[:, None], flag.shape[1], axis=1)
        for c in np.flatnonzero(flag.any(axis=0)):
            padded = np.pad(flag[:, c].astype(np.float64), half)
            out[:, c] += np.maximum(oaconvolve(padded, weight, mode="valid"), 0.0)
        return np.minimum(out, 1.0)

    def _apply(self, x: Array, orders: Sequence[int]) -> list[Array]:
        """Derivatives of some orders, column by column in overlapping blocks."""
        flat = x.reshape(x.shape[0], -1)
        kernels = np.stack([self.kernels[order] for order in orders])
        out = np.empty((len(orders), *flat.shape))
        for c in range(flat.shape[1]):
            column = _extended(np.ascontiguousarray(flat[:, c]), self.half)
            out[:, :, c] = oaconvolve(column[None], kernels, mode="valid", axes=1)
        return [one.reshape(x.shape) for one in out]


def _extended(x: Array, half: int) -> Array:
    """Continue a column beyond both ends by point symmetry about its end values.

    Where the kernel is longer than the column, what lies beyond its mirror image stays constant.
    """
    reach = min(half, x.size - 1)
    before = 2.0 * x[0] - x[reach:0:-1]
    after = 2.0 * x[-1] - x[-2 : -reach - 2 : -1]
    y = np.concatenate([before, x, after])
    return np.pad(y, half - reach, mode="edge") if reach < half else y


def choose_cutoff(stretches: Sequence[Array], rate: float, *, smallest: float = 0.0) -> Array:
    """Cut-off at which the spectrum of the signal meets that of its noise, per column.

    Below it the signal outweighs the noise, above it the noise the signal: there the sum of lost
    signal and passed noise is least, for the value and every derivative alike (both are weighted
    with the same power of frequency). The noise is taken as white, its level from the upper part
    of the band.

    Args:
        stretches: Each without gaps, shape (N, C); their spectra are averaged by length.
        rate: [Hz].
        smallest: Lower bound [Hz].

    Returns:
        Shape (C,) [Hz], at most `LARGEST_SHARE` of the rate; NaN for a column that never changes or
        shows nothing but noise.
    """
    largest = LARGEST_SHARE * rate
    out = np.full(stretches[0].shape[1], np.nan)
    moves = np.any([np.ptp(x, axis=0) > 0 for x in stretches], axis=0)
    if not moves.any():
        return out
    length = max(x.shape[0] for x in stretches)
    segment = int(min(length, max(256, 2 ** np.ceil(np.log2(2.0 * rate)))))
    spectra, weights = [], []
    for x in stretches:
        if x.shape[0] < segment:
            continue
        # Without its trend a stretch leaks less into high frequencies.
        trend = np.linspace(x[0], x[-1], x.shape[0])
        f, power = welch((x - trend)[:, moves], fs=rate, nperseg=segment, axis=0)
        spectra.append(power)
        weights.append(x.shape[0])
    mean = np.average(spectra, axis=0, weights=weights)
    noise = np.median(mean[f >= 0.6 * rate / 2], axis=0)
    # Medians over a third of an octave, three bins at least: a lone peak or dip decides nothing.
    bins = np.unique(np.round(2.0 ** (np.arange(0, 12 * np.log2(f.size - 1)) / 12)).astype(int))
    bins = bins[bins < f.size]
    level = np.stack(
        [np.median(mean[max(1, k - 1 - k // 8) : k + 2 + k // 8], axis=0) for k in bins]
    )
    above = level > 2.0 * noise
    first_below = np.where(above.all(axis=0), -1, np.argmin(above, axis=0))
    at_rest = level[: max(1, bins.size // 2)].max(axis=0) < SEEN * noise
    out[moves] = np.where(at_rest, np.nan, np.clip(f[bins[first_below]], smallest, largest))
    return out
