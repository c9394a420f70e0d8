"""The sign by which friction acts: its expectation given the logged speed, and how unsure that is.

The logged speed v is the true one plus noise of standard deviation s. A joint that rests (a share
P of its rows) has friction of either sign, up to its level; of one that moves, with density g of
speeds near zero, sgn has the mean erf(v / (sqrt(2) s)). So

    rest(v) = P phi(v / s) / s / (P phi(v / s) / s + g),
    E[sign | v] = (1 - rest(v)) erf(v / (sqrt(2) s)),    Var[sign | v] = 1 - E^2.

An estimate on a column that is an expectation given what was logged is consistent (regression
calibration: Carroll et al., Measurement Error in Nonlinear Models, 2006, chapter 4), where the
sign of a noisy speed, or a smooth step of any width, shrinks what it multiplies. P and g are
counted: what lies within two standard deviations of zero beyond what those from three to nine
foretell is rest.

A move shorter than the filter leaves a speed that is smeared beyond it: where a wider band shows
more than its noise, the sign is that band's. Rows near standstill, reversal or another stance, on
which no law of friction says anything, are told here, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from scipy.special import erf

from actuators.arrays import Array, Mask
from pipeline.logs.grid import runs_of

#: A wider band's speed is another than the filtered one where they differ by this many times the
#: wider one's noise, root mean square over a period of the cut-off: its few independent samples
#: come to more than this in one of a thousand by chance.
DIFFERS: Final = 2.0
#: Rows within the first are at rest, as far as one can see; the others tell the density of moving
#: ones. In standard deviations of the speed.
NEAR, SHELL = 2.0, (3.0, 9.0)
_WITHIN: Final = 0.9545  # of a normal distribution within NEAR
#: A row is one of a group that shares one unknown friction where its sign is as unsure as this.
_SHARED: Final = 0.5

#: Below this many rest speeds a joint counts as standing: friction may take any value there.
STANDING: Final = 2.5
#: How far to either side a filter sees with weight, in periods of its cut-off.
SEEN: Final = 1.0
#: A reach that takes more than this share of what moves is halved ...
MOST_TAKEN: Final = 0.5
#: ... this often, and then nothing but the event itself is left out.
HALVED: Final = 3


def friction_sign(
    speed: Array,
    noise: float,
    wide: Array,
    wide_noise: float,
    pieces: Sequence[slice],
    kernel: Array,
    period: float,
) -> tuple[Array, Array]:
    """Expected sign of a joint's friction and its remaining standard deviation.

    Args:
        speed: At the bandwidth of what is compared, shape (N,) [rad/s].
        noise: Of it [rad/s].
        wide: Speed at a wider band, shape (N,) [rad/s].
        wide_noise: Of it [rad/s].
        pieces: Stretches without a gap.
        kernel: Weights by which the compared torque was filtered, shape (odd,).
        period: Of the cut-off, in rows.

    Returns:
        The sign as it acts, not filtered, -1 to 1; and the standard deviation of the filtered sign,
        each (N,). Rows that share one unknown friction, as those of one rest, count together as
        one: their standard deviation is larger by the square root of their number, and more than 1.
    """
    box, weight = np.ones(2 * int(np.ceil(period / 2)) + 1), np.abs(kernel)
    s, w = max(noise, 1e-12), max(wide_noise, 1e-12)
    lost = _over((wide - speed) ** 2, box / box.size, pieces) > (DIFFERS * w) ** 2
    mean, rests = _expected(np.where(lost, wide, speed), np.where(lost, w, s))
    # Neighbours share their error: standard deviations add, whatever the kernel's sign.
    spread = _over(np.sqrt(np.maximum(1.0 - mean**2, 0.0)), weight, pieces)
    still = _over(rests, weight / weight.sum(), pieces) > _SHARED
    turning = np.minimum(_lengths(spread > _SHARED), period)
    return mean, spread * np.sqrt(np.where(still, _lengths(still), turning))


def _expected(v: Array, s: Array) -> tuple[Array, Array]:
    """E[sign | v] and the probability of rest, each (N,); v and its deviations s, (N,) [rad/s]."""
    z = np.abs(v) / s
    low, high = SHELL
    moving = max(int(((z > low) & (z < high)).sum()), 1) / (2.0 * (high - low) * s.sum())
    near = int((z < NEAR).sum()) - moving * 2.0 * NEAR * s.sum()
    resting = max(near / _WITHIN / v.size, 0.0)
    seen = resting * np.exp(-0.5 * z**2) / (np.sqrt(2.0 * np.pi) * s)
    rest = seen / (seen + moving)
    return (1.0 - rest) * erf(v / (np.sqrt(2.0) * s)), rest


def _over(x: Array, weights: Array, pieces: Sequence[slice]) -> Array:
    """Sum of a series (N,) over neighbours with weights (odd,), not across gaps."""
    from scipy.signal import oaconvolve

    half = weights.size // 2
    out = np.empty_like(x)
    for piece in pieces:
        whole = oaconvolve(x[piece], weights)
        out[piece] = np.maximum(whole[half : whole.size - half], 0.0)
    return out


def _lengths(flag: Mask) -> Array:
    """Of every row the length of the run of flagged rows that it lies in, else 1; (N,)."""
    out = np.ones(flag.size)
    for start, stop in zip(*runs_of(flag), strict=True):
        out[start:stop] = stop - start
    return out


def near_rest(
    v: Array, rest: Array, pieces: Sequence[slice], rate: float, bandwidth: float
) -> Mask:
    """Rows (N, J) whose filter sees a shaft stop or turn back.

    There friction takes any value up to its level, and the filtered speed does not tell which. `v`
    are speeds (N, J) and `rest` rest speeds (J,) [rad/s], `bandwidth` the filter's [Hz].
    """
    still = np.abs(v) < STANDING * rest
    # A fast joint turns back between two samples, neither of which is slow.
    turned = np.signbit(v[1:]) != np.signbit(v[:-1])
    still[1:] |= turned
    still[:-1] |= turned
    reach = int(np.ceil(SEEN * rate / bandwidth)) if np.isfinite(bandwidth) else 0
    return narrowed(still, np.abs(v) >= STANDING * rest, pieces, reach)


def narrowed(event: Mask, wanted: Mask, pieces: Sequence[slice], reach: int) -> Mask:
    """Rows (N, C) within a reach of an event, the reach halved where it takes most that is wanted.

    A leg turns back several times a second, and a prediction passes the filter that the measurement
    passed: a row near an event is less sure and not wrong, and half of the rows are worth more than
    none. `wanted` are rows (N, C) that would count but for the reach.
    """
    out = within(event, pieces, reach)
    for k in range(1, HALVED + 1):
        lost = (out & wanted).sum(axis=0) > MOST_TAKEN * wanted.sum(axis=0)
        if reach == 0 or not lost.any():
            break
        out[:, lost] = within(event[:, lost], pieces, reach >> k if k < HALVED else 0)
    return out


def within(event: Mask, pieces: Sequence[slice], reach: int) -> Mask:
    """Rows (N, C) at most `reach` rows from an event, not across gaps."""
    out = np.zeros_like(event)
    for piece in pieces:
        count = np.cumsum(np.pad(event[piece], ((reach + 1, reach), (0, 0))), axis=0)
        out[piece] = count[2 * reach + 1 :] > count[: -2 * reach - 1]
    return out
