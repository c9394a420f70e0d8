"""Noise of a channel by what a smoother leaves over, and how unsure it makes friction's sign."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import sqrt
from typing import Final

import numpy as np
from scipy.special import erf

from actuators.arrays import Array, Mask
from pipeline.logs.signals.derivatives import LARGEST_SHARE, LowPass

#: Median absolute deviation of a normal distribution per standard deviation.
MAD: Final = 0.6744897501960817


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


def sign_unsure(
    v: Array, noise: Array, rest: Array, pieces: Sequence[slice], lowpass: LowPass
) -> Array:
    """Standard deviation of the low-passed sign of a speed, by which friction acts.

    The measured speed is the true one plus noise of standard deviation s, so that sgn(v) has the
    mean erf(v / (sqrt(2) s)) and the variance 1 - mean^2. A low-pass averages the sign over its
    kernel; rows around one reversal share its error, so that standard deviations add.

    Args:
        v: Speed, shape (N, J) [rad/s].
        noise: Of the speed, shape (J,) [rad/s].
        rest: Speed within which friction takes any value, whatever the noise, shape (J,) [rad/s].
        pieces: Stretches without a gap.
        lowpass: Of the compared effort.

    Returns:
        Shape (N, J), 0 (sure) to 1 (any value).
    """
    scale = np.maximum(np.hypot(noise, rest), 1e-300)
    mean = erf(v / (sqrt(2.0) * scale))
    spread = np.sqrt(np.maximum(1.0 - mean**2, 0.0))
    return np.asarray(np.clip(lowpass.smooth(spread, pieces), 0.0, 1.0))
