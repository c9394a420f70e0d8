"""A zero-phase low-pass of finite memory that gives value, velocity and acceleration at once.

The kernel is a sinc of cut-off f_c under a Blackman window of half-length 2 / f_c; its first and
second analytic derivatives are the kernels of velocity and acceleration, so that the three belong
to one and the same smoothed curve. At f_c the amplitude is halved (as by a Butterworth filter run
forward and backward); below 0.4 f_c it is flat, above 1.6 f_c it is nothing. Being finite, it sees
exactly `memory` seconds to either side: rows further apart than twice that share no sample, and
chunks that overlap by it give the output of the whole.

Several logs share one grid and one cut-off, chosen by what their channels hold (`choose_settings`).
A channel's noise is what the filter leaves over.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Final

import numpy as np
import scipy  # its signal is loaded where it is first used: every command passes here

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError
from pipeline.logs.reading.log import Log
from pipeline.logs.signals.grid import busiest, fill_gaps, own_spacing, uniform_grid

#: The kernel may not be longer than this share of the log.
LONGEST_KERNEL: Final = 0.1
#: Cut-off per own rate of a channel: bridging by straight lines takes 5 % at that frequency.
OWN_SHARE: Final = 0.125
#: Median absolute deviation of a normal distribution per standard deviation.
MAD: Final = 0.6744897501960817
#: Half-length of the kernel in units of 1 / cut-off.
HALF_LENGTH: Final = 2.0
#: Largest cut-off per sampling rate: above it the kernel would no longer be sampled finely enough.
LARGEST_SHARE: Final = 0.25
#: A joint whose spectrum nowhere exceeds its noise by this factor stands still.
SEEN: Final = 30.0
#: Share of the cut-off up to which the filter is flat.
FLAT: Final = 0.4
#: Density of a joint's speed over its peak from which there is motion at a frequency: the errors
#: of stamps and encoders spread over the whole band and stay below.
MOVED: Final = 0.01
#: Correlation of noise with itself below which two rows count as independent.
REMEMBERED: Final = 0.05
#: A series without a gap.
WHOLE: Final = (slice(None),)


@dataclass(frozen=True)
class LowPass:
    """The filter at one sampling rate.

    Raises:
        LegwattError: The cut-off is not between zero and a quarter of the rate.
    """

    rate: float  #: Samples per second [Hz].
    cutoff: float  #: Frequency at which the amplitude is halved [Hz].

    def __post_init__(self) -> None:
        if not 0 < self.cutoff <= LARGEST_SHARE * self.rate * (1 + 1e-9):
            raise LegwattError(
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
    def noise_memory(self) -> float:
        """Time after which filtered white noise correlates with itself by less than 5 % [s]."""
        own = np.correlate(self.kernels[0], self.kernels[0], mode="full")[2 * self.half :]
        return float(np.flatnonzero(np.abs(own) >= REMEMBERED * own[0])[-1] + 1) / self.rate

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

    def share(self, flag: Mask, pieces: Sequence[slice] = WHOLE) -> Array:
        """Share of the kernel's weight on flagged samples or beyond the ends, (N, C), 0 to 1."""
        weight = np.abs(self.kernels[0])
        return np.concatenate([self._share(flag[piece], weight / weight.sum()) for piece in pieces])

    def _share(self, flag: Mask, weight: Array) -> Array:
        n, half = flag.shape[0], self.half
        # Weight beyond the ends is the tail sum of the kernel.
        tail = np.concatenate([np.cumsum(weight[::-1])[:half][::-1], np.zeros(max(0, n - half))])
        ends = tail[:n] + tail[:n][::-1]
        out = np.repeat(ends[:, None], flag.shape[1], axis=1)
        for c in np.flatnonzero(flag.any(axis=0)):
            padded = np.pad(flag[:, c].astype(np.float64), half)
            out[:, c] += np.maximum(scipy.signal.oaconvolve(padded, weight, mode="valid"), 0.0)
        return np.minimum(out, 1.0)

    def _apply(self, x: Array, orders: Sequence[int]) -> list[Array]:
        """Derivatives of some orders, column by column in overlapping blocks."""
        flat = x.reshape(x.shape[0], -1)
        kernels = np.stack([self.kernels[order] for order in orders])
        out = np.empty((len(orders), *flat.shape))
        for c in range(flat.shape[1]):
            column = _extended(np.ascontiguousarray(flat[:, c]), self.half)
            out[:, :, c] = scipy.signal.oaconvolve(column[None], kernels, mode="valid", axes=1)
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
        f, power = scipy.signal.welch((x - trend)[:, moves], fs=rate, nperseg=segment, axis=0)
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


def reach_of_motion(stretches: Sequence[Array], rate: float) -> float:
    """Frequency up to which joints move, by the spectrum of their speeds [Hz].

    Args:
        stretches: Positions without gaps, each (N, J) [rad].
        rate: [Hz].
    """
    longest = max(stretches, key=len)
    length = int(min(longest.shape[0], max(256, 2 ** np.ceil(np.log2(4.0 * rate)))))
    trend = np.linspace(longest[0], longest[-1], longest.shape[0])
    f, power = scipy.signal.welch(longest - trend, fs=rate, nperseg=length, axis=0)
    noise = np.median(power[f >= 0.6 * rate / 2], axis=0)
    speed = np.where(power > SEEN * noise, power, 0.0) * f[:, None] ** 2
    seen = speed > MOVED * speed.max(axis=0)
    return float(f[seen.any(axis=1)].max(initial=0.0))


def smoother_noise(
    x: Array, ok: Mask, pieces: Sequence[slice], lowpass: LowPass, *, in_band: bool
) -> Array:
    """Noise from the band just above the cut-off, taken as white from there downward.

    The series is passed between 1.5 and 3 times the cut-off (or as far as the rate allows); the
    spread of that band, by its median so that jumps do not count, gives the noise's density.

    Args:
        x: Not filtered, shape (N, C).
        ok: Shape (N, C).
        pieces: Stretches without a gap.
        lowpass: The filter whose band is meant.
        in_band: Noise that the filter lets pass; else all of it, up to half the rate.

    Returns:
        Standard deviation, shape (C,); NaN where fewer than 50 samples are good.
    """
    outer = LowPass(lowpass.rate, min(3.0 * lowpass.cutoff, LARGEST_SHARE * lowpass.rate))
    inner = LowPass(lowpass.rate, min(1.5 * lowpass.cutoff, 0.8 * outer.cutoff))
    wide, narrow = outer.kernels[0], np.array(inner.kernels[0])
    middle = slice(inner.half - outer.half, inner.half + outer.half + 1)
    band = -narrow
    band[middle] += wide
    # Passed twice: what little of the motion the first pass lets through is gone after the second.
    gain = float(np.sqrt((np.convolve(band, band) ** 2).sum()))
    rest, good = (np.concatenate([y[piece] for piece in pieces]) for y in (x, ok))
    stops = np.cumsum([piece.stop - piece.start for piece in pieces]).tolist()
    joined = [slice(start, stop) for start, stop in pairwise([0, *stops])]
    for _ in range(2):
        rest = outer.smooth(rest, joined) - inner.smooth(rest, joined)
    sigma = np.full(x.shape[1], np.nan)
    for c in range(x.shape[1]):
        kept = rest[good[:, c], c]
        if kept.size >= 50:
            sigma[c] = np.median(np.abs(kept)) / MAD / gain
    return sigma * (lowpass.noise_gain if in_band else 1.0)


@dataclass(frozen=True)
class Settings:
    """How logs are brought to one grid and bandwidth; the same for all logs that are compared."""

    dt: float  #: Step of the uniform grid [s].
    cutoff: float  #: Of the low-pass [Hz].
    reason: str  #: How the cut-off was chosen, in words.
    #: Cut-off each joint alone would have asked for, shape (J,) [Hz].
    per_joint: Array = field(default_factory=lambda: np.empty(0))
    #: Least cut-off that passes the joints' motion as it is [Hz].
    least: float = 0.0

    @property
    def lowpass(self) -> LowPass:
        """The filter."""
        return LowPass(1.0 / self.dt, self.cutoff)

    @property
    def bridged(self) -> float:
        """Time between good samples up to which values are interpolated [s]."""
        return 1.0 / (4.0 * self.cutoff)


def choose_settings(
    logs: Sequence[Log],
    usable: Sequence[tuple[Mask, Mask]] | None = None,
    *,
    cutoff: float | None = None,
) -> Settings:
    """Choose one grid and one cut-off for several logs, by their good positions and efforts (N, J).

    The cut-off [Hz] is the user's, or the lowest any moving joint asks for (`choose_cutoff`), so
    that no joint's accelerations are mostly noise; the torque of every joint depends on those of
    the others. It is at most `OWN_SHARE` of the slowest channel's own rate, whatever the rows'.

    Raises:
        LegwattError: The user's cut-off does not fit the rate or the length.
    """
    steps = [float(np.median(np.diff(log.clock))) for log in logs]
    # The slowest log decides: its band holds nothing above.
    dt = max(steps)
    rate = 1.0 / dt
    longest = max(float(log.time[-1] - log.time[0]) for log in logs)
    smallest = 2.0 * 2.0 / (LONGEST_KERNEL * longest)
    if smallest > LARGEST_SHARE * rate:
        raise LegwattError(
            f"{logs[0].name}: {longest:.3g} s at {rate:.4g} Hz are too short to be filtered; "
            "log longer or faster"
        )
    if cutoff is not None:
        if not smallest <= cutoff <= LARGEST_SHARE * rate:
            raise LegwattError(
                f"cut-off {cutoff:g} Hz; logs of {longest:.3g} s at {rate:.4g} Hz allow "
                f"{smallest:.3g} to {LARGEST_SHARE * rate:.4g} Hz"
            )
        return Settings(dt, float(cutoff), "set by the user")
    usable = usable or [log.finite for log in logs]
    held = min(_held(log, good) for log, good in zip(logs, usable, strict=True))
    asked, moved = [], []
    for log, (position_ok, _) in zip(logs, usable, strict=True):
        grid = uniform_grid(log.time, dt, bridge=1.0 / (4.0 * max(held, smallest)))
        q = grid.resample(fill_gaps(log.time, log.position, position_ok))
        stretches = [q[part] for part in busiest(q, grid.pieces) if part.stop - part.start >= 64]
        if stretches:
            asked.append(choose_cutoff(stretches, rate, smallest=smallest))
            moved.append(reach_of_motion(stretches, rate) / FLAT)
    per_joint = np.fmin.reduce(asked) if asked else np.full(1, np.nan)
    if np.isnan(per_joint).all():
        if not any(turns(log.position, good) for log, (good, _) in zip(logs, usable, strict=True)):
            raise LegwattError(f"{logs[0].name}: no joint moves; nothing can be compared")
        # Turned at a steady speed: such a motion has no spectrum, and any bandwidth holds it.
        value = min(LARGEST_SHARE * rate, max(held, smallest))
        return Settings(dt, value, "joints turn at steady speeds: as much as the rate holds")
    slowest = int(np.nanargmin(per_joint))
    least = min(max(moved), LARGEST_SHARE * rate, max(held, smallest))
    value, reason = (
        float(per_joint[slowest]),
        f"position spectrum of {logs[0].joints[slowest]} meets its noise",
    )
    if value < least:
        value, reason = least, "the motion reaches as far, whatever the noise"
    if value > max(held, smallest):
        value = max(held, smallest)
        reason = f"the slowest channel holds no more: one sample in {1e3 * OWN_SHARE / held:.3g} ms"
    return Settings(dt, value, reason, per_joint, least)


def turns(position: Array, ok: Mask) -> bool:
    """Whether some joint travels much further than its positions scatter from row to row.

    Args:
        position: Shape (N, J) [rad].
        ok: Which are good, shape (N, J).
    """
    series = [position[good, j] for j, good in enumerate(ok.T) if good.sum() >= 10]
    return any(np.ptp(x) > SEEN * np.median(np.abs(np.diff(x, n=2))) for x in series)


def _held(log: Log, usable: tuple[Mask, Mask]) -> float:
    """Highest frequency that the slowest channel of a log holds [Hz]."""
    steps = [own_spacing(log.clock, np.ones(log.clock.size, dtype=np.bool_))]
    for good in usable:
        sparse = np.flatnonzero(good.any(axis=0) & ~good.all(axis=0))
        steps += [own_spacing(log.time, good[:, j]) for j in sparse]
    usual = float(np.median(np.diff(log.clock)))
    slowest = max(step for step in steps if np.isfinite(step))
    # A step or two more than usual is what interpolation bridges anyway.
    return OWN_SHARE / slowest if slowest > 1.9 * usual else np.inf
