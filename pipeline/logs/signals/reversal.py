"""How unsure friction's sign is at every row: near a reversal the speed's noise decides it.

The measured speed is the true one plus noise of standard deviation s, so that sgn(v) has the mean
erf(v / (sqrt(2) s)) and the variance 1 - mean^2. A low-pass averages the sign over its kernel; the
rows around one reversal share its error, so that standard deviations add. A row counts with
1 / (noise^2 + (level * unsure)^2) where friction has that level: rows near a reversal are weighed
by what is unsure there and not left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from pipeline.logs.signals.derivatives import LowPass

Array = NDArray[np.float64]


def sign_unsure(
    v: Array, noise: Array, rest: Array, pieces: Sequence[slice], lowpass: LowPass
) -> Array:
    """Standard deviation of the low-passed sign of a speed.

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
    out = np.empty_like(spread)
    for piece in pieces:
        out[piece] = lowpass.smooth(spread[piece])
    return np.asarray(np.clip(out, 0.0, 1.0))


def row_weights(noise: Array, level: Array, unsure: Array) -> Array:
    """Weight of every row relative to one far from reversals.

    Args:
        noise: Of the effort, shape (J,).
        level: Of friction, in the effort's unit, shape (J,).
        unsure: From `sign_unsure`, shape (N, J).

    Returns:
        Shape (N, J), 0 to 1.
    """
    variance = np.maximum(noise, 1e-300) ** 2
    return np.asarray(variance / (variance + (level * unsure) ** 2))
