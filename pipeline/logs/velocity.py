"""Speed and acceleration from a position and a velocity column, weighed by their noises.

A differentiated position and a measured velocity are two readings of one thing. Within the
bandwidth each has a noise: of the position s_q |h'| and s_q |h''|, of the velocity s_v |h| and
s_v |h'|, with the norms of the low-pass's kernels. They are averaged by inverse variance, speed and
acceleration each for itself. The position is the reference: the velocity column is first brought to
its factor and zero, and what the two still differ by beyond their noises counts as noise of the
velocity (a delay, a drive's own filter, the other side of a soft gear).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from actuators.arrays import Array, Mask
from pipeline.logs.filters import LowPass

#: How far the factor of a column may be from one: else it is another thing, or in another unit.
_FACTOR: Final = 0.3
#: Standard deviations by which the scatter of a stretch may exceed the noise by chance.
_SURE: Final = 4.0


def weigh(
    column: Array,
    rates: tuple[Array, Array],
    ok: Mask,
    noises: tuple[float, float],
    lowpass: LowPass,
    longest: slice,
) -> tuple[Array, Array, Array] | None:
    """Weigh a velocity column against the differentiated position; None where it says nothing.

    Args:
        column: As measured, gaps bridged, shape (N,) [rad/s].
        rates: First and second derivative of the filtered position, each (N,).
        ok: Where both are good, shape (N,).
        noises: Standard deviation of a sample of position [rad] and of velocity [rad/s].
        lowpass: The filter.
        longest: The longest stretch without a gap among those that tell most.

    Returns:
        The column at the position's factor and zero, (N,); its weight in speed and in
        acceleration, 0 to 1, and the noise of both so averaged, each (2,).
    """
    inside = np.array(ok[longest])
    inside[: lowpass.half] = inside[inside.size - lowpass.half :] = False
    if not np.isfinite(noises[1]) or ok.mean() < 0.5 or not inside.any():
        return None
    speed, smooth = rates[0][longest][inside], lowpass.smooth(column[longest])[inside]
    both = np.cov(speed, smooth)
    factor = float(both[0, 1] / max(both[0, 0], 1e-300))
    if abs(factor - 1.0) > _FACTOR:
        return None
    straight = (column - smooth.mean()) / factor + speed.mean()
    h0, h1, h2 = lowpass.gains
    own = np.array([h1, h2]) * np.nan_to_num(noises[0])
    theirs = np.array([h0, h1]) * noises[1] / factor
    samples = 2.0 * lowpass.cutoff * inside.size / lowpass.rate
    sure = 1.0 + _SURE * float(np.sqrt(2.0 / max(samples, 1.0)))
    readings = lowpass.derivatives(straight[longest])
    differ = [(readings[k] - rates[k][longest])[inside] for k in (0, 1)]
    excess = np.mean(np.square(differ), axis=1) - sure * own**2
    theirs = np.sqrt(np.maximum(np.maximum(theirs**2, excess), 1e-300))
    weight = own**2 / (own**2 + theirs**2)
    return straight, weight, np.sqrt(weight) * theirs
