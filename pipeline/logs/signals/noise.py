"""Noise of a channel: from what a smoother leaves over, or from what repeats."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.logs.signals.derivatives import LARGEST_SHARE, LowPass

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

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

    def band_passed(part: Array) -> Array:
        return outer.smooth(part) - inner.smooth(part)

    rest = np.concatenate([band_passed(band_passed(x[piece])) for piece in pieces])
    good = np.concatenate([ok[p] for p in pieces])
    sigma = np.full(x.shape[1], np.nan)
    for c in range(x.shape[1]):
        kept = rest[good[:, c], c]
        if kept.size >= 50:
            sigma[c] = np.median(np.abs(kept)) / MAD / gain
    return sigma * (lowpass.noise_gain if in_band else 1.0)
