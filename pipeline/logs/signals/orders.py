"""Ripple over the angle, looked for at the log's full bandwidth before any cut-off hides it.

An effort that repeats k times per turn sums to A = sum r exp(-i k q) over its rows, whatever the
speed was. What the low-pass takes away (r, the part above the cut-off) is sorted into narrow bins
of the angle and transformed, once for rows that turn forward and once for those that turn back. A
torque of the angle has one phase in both; friction, delay and the motion's own rhythm have not. So
the product of the two sums decides, against its own scatter over neighbouring orders.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from actuators.arrays import Array

#: Chance at which noise may pass for a ripple somewhere among all orders of a joint.
CHANCE: Final = 1e-4
#: Bins of the angle per period of the highest order.
_BINS: Final = 6
_MOST_ORDER: Final = 2000.0
_LEAST_ROWS: Final = 500


@dataclass(frozen=True)
class Ripple:
    """A torque periodic in the joint's angle."""

    order: float  #: Periods per turn [1].
    amplitude: float  #: In the effort's unit.
    phase: float  #: Of amplitude * sin(order * q + phase) [rad].
    chance: float  #: That noise makes as strong a one at any order.


def strongest_order(rest: Array, angle: Array, velocity: Array, rate: float) -> Ripple | None:
    """The order that stands out most; None where none does, or the joint does not turn far enough.

    Args:
        rest: Effort above the cut-off, shape (N,).
        angle: Of the joint, shape (N,) [rad].
        velocity: Likewise [rad/s].
        rate: Rows per second [Hz].
    """
    good = np.isfinite(rest) & np.isfinite(angle)
    span = float(np.ptp(angle[good])) if good.any() else 0.0
    fast = float(np.quantile(np.abs(velocity[good]), 0.5)) if good.any() else 0.0
    if good.sum() < _LEAST_ROWS or span <= 0.05 or fast <= 0:
        return None
    # Above this order half of the rows would see less than three samples of a period.
    highest = min(_MOST_ORDER, 2 * np.pi * rate / (3.0 * fast))
    step = 2 * np.pi / (_BINS * highest)
    bins = int(np.ceil(span / step)) + 1
    size = 1 << int(np.ceil(np.log2(4 * bins)))
    low = float(angle[good].min())
    spectra = []
    for sign in (1.0, -1.0):
        rows = good & (sign * velocity > 0.2 * fast)
        if rows.sum() < _LEAST_ROWS // 2:
            return None
        k = ((angle[rows] - low) / step).astype(int)
        sums = np.bincount(k, rest[rows] - rest[rows].mean(), minlength=bins)
        spectra.append(np.fft.rfft(sums, size) / rows.sum())
    order = 2 * np.pi * np.arange(size // 2 + 1) / (size * step)
    inside = (order <= highest) & (order > 4.0 * 2 * np.pi / span)
    if inside.sum() < 16:
        return None
    product = (spectra[0] * np.conj(spectra[1])).real
    scatter = _local(np.abs(spectra[0]) ** 2) * _local(np.abs(spectra[1]) ** 2)
    score = np.where(inside, product / np.sqrt(np.maximum(scatter, 1e-300)), 0.0)
    best = int(np.argmax(score))
    # The real part of a product of two unit complex normals: P(> z) = exp(-2 z) / 2.
    tries = float(inside.sum()) * bins / size * 2.0
    chance = min(1.0, 0.5 * tries * float(np.exp(-2.0 * score[best])))
    if chance > CHANCE:
        return None
    total = 0.5 * (spectra[0][best] + spectra[1][best]) * np.exp(-1j * order[best] * low)
    # r = a sin(k q + p) sums to a / 2 (sin p - i cos p) ... a exp(i (p - pi / 2)) / 2
    return Ripple(
        float(order[best]),
        2.0 * float(np.abs(total)),
        float((np.angle(total) + np.pi / 2) % (2 * np.pi)),
        chance,
    )


def _local(power: Array) -> Array:
    """Mean power of exponentially distributed neighbours, by their median, away from peaks."""
    from scipy.ndimage import median_filter

    width = int(min(max(power.size // 8, 65), 1025)) | 1
    return np.asarray(median_filter(power, width, mode="nearest") / np.log(2.0))
