"""A joint's speed and the sign by which friction acts along it.

*Speed.* A differentiated position and a measured velocity are two readings of one thing. Within the
bandwidth each has a noise: of the position s_q |h'| and s_q |h''|, of the velocity s_v |h| and
s_v |h'|, with the norms of the low-pass's kernels. They are averaged by inverse variance, speed and
acceleration each for itself. The position is the reference: the velocity column is first brought to
its factor, zero and time, and what the two still differ by beyond their noises counts as noise of
the velocity (a drive's own filter, the other side of a soft gear).

*Sign.* The logged speed v is the true one plus noise of standard deviation s. A joint that rests (a
share P of its rows) has friction of either sign, up to its level; of one that moves, with density g
of speeds near zero, sgn has the mean erf(v / (sqrt(2) s)). So

    rest(v) = P phi(v / s) / s / (P phi(v / s) / s + g),
    E[sign | v] = (1 - rest(v)) erf(v / (sqrt(2) s)),    Var[sign | v] = 1 - E^2.

An estimate on a column that is an expectation given what was logged is consistent (regression
calibration: Carroll et al., Measurement Error in Nonlinear Models, 2006, chapter 4), where the
sign of a noisy speed, or a smooth step of any width, shrinks what it multiplies. P and g are
counted: what lies within two standard deviations of zero beyond what those from three to nine
foretell is rest. A move shorter than the filter leaves a speed that is smeared beyond it: where a
wider band shows more than its noise, the sign is that band's.

Rows near standstill, reversal or another stance, on which no law of friction says anything, are
told here, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Final

import numpy as np
from scipy.signal import oaconvolve
from scipy.special import erf

from actuators.arrays import Array, Mask
from pipeline.logs.filters import LowPass, by_piece, runs_of

#: Correlation with the position's rate below which a velocity column is another thing ...
SAME: Final = 0.9
#: ... and how far its factor may be from one.
FACTOR: Final = 0.3
#: Standard deviations by which a difference has to exceed the noises to count as one.
_SURE: Final = 4.0
#: Share of the kernel's weight on other rows up to which a row's value is whole.
_WHOLE: Final = 1e-6
#: Delays that a velocity column may have [s].
_LONGEST_LAG: Final = 0.1
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


def weigh(
    time: Array,
    column: Array,
    rates: tuple[Array, Array],
    ok: Mask,
    noises: Array,
    lowpass: LowPass,
    pieces: Sequence[slice],
) -> tuple[float, tuple[Array, Array, Array] | None]:
    """Weigh a velocity column against the differentiated position.

    Args:
        time: Shape (N,) [s].
        column: As measured, shape (N,) [rad/s]; NaN where it was not.
        rates: First and second derivative of the filtered position, each (N,).
        ok: Where the position's rate is good, shape (N,).
        noises: Standard deviation of a sample of position [rad] and of velocity [rad/s], (2,).
        lowpass: The filter.
        pieces: Stretches without a gap.

    Returns:
        Its factor, 1 where the two are not alike; and unless it says nothing the column at the
        position's factor, zero and time, (N,), its weight in speed and in acceleration, 0 to 1, and
        the noise of both so averaged, each (2,).
    """
    good = ok & np.isfinite(column)
    if not np.isfinite(noises[1]) or good.mean() < 0.5:
        return 1.0, None
    filled, late = np.interp(time, time[good], column[good]), 0.0
    good = lowpass.share(~good[:, None], pieces)[:, 0] < _WHOLE
    if not good.any():
        return 1.0, None
    columns = np.stack([*rates, np.ones_like(time)], axis=1)[good]
    for _ in range(4):  # f v(t - lag) is f v - f lag a
        x = lowpass.smooth(np.interp(time + late, time, filled), pieces)[good]
        factor, slope, zero = np.linalg.lstsq(columns, x, rcond=None)[0].tolist()
        late -= slope / factor if factor else np.inf
        if abs(late) > _LONGEST_LAG:
            return 1.0, None
    left = np.std(x - columns @ [factor, slope, zero])
    if left > np.sqrt(1.0 - SAME**2) * np.std(x):
        return 1.0, None
    if abs(factor - 1.0) > FACTOR:
        return factor, None
    straight = (np.interp(time + late, time, filled) - zero) / factor
    own, theirs = lowpass.gains[1:] * np.nan_to_num(noises[0]), lowpass.gains[:2] * noises[1]
    # So much may the scatter of the rows exceed the noise by chance, at `_SURE` deviations.
    samples = 2.0 * lowpass.cutoff * int(good.sum()) / lowpass.rate
    sure = 1.0 + _SURE * float(np.sqrt(2.0 / max(samples, 1.0)))
    readings = lowpass.derivatives(straight, pieces)
    differ = [np.mean((readings[k] - rates[k])[good] ** 2) for k in (0, 1)]
    both = np.maximum((theirs / factor) ** 2, np.array(differ) - sure * own**2)
    both = np.maximum(both, 1e-300)
    weight = own**2 / (own**2 + both)
    return factor, (straight, weight, np.sqrt(weight * both))


def friction_sign(
    speed: Array,
    noise: float,
    wide: Array,
    wide_noise: float,
    pieces: Sequence[slice],
    lowpass: LowPass,
) -> tuple[Array, Array]:
    """Expected sign of a joint's friction and its remaining standard deviation.

    Args:
        speed: At the bandwidth of what is compared, shape (N,) [rad/s].
        noise: Of it [rad/s].
        wide: Speed at a wider band, shape (N,) [rad/s].
        wide_noise: Of it [rad/s].
        pieces: Stretches without a gap.
        lowpass: By which the compared torque was filtered.

    Returns:
        The sign as it acts, not filtered, -1 to 1; and the standard deviation of the filtered sign,
        each (N,). Rows that share one unknown friction, as those of one rest, count together as
        one: their standard deviation is larger by the square root of their number, and more than 1.
    """
    period, weight = lowpass.rate / lowpass.cutoff, np.abs(lowpass.kernels[0])
    box = np.ones(2 * int(np.ceil(period / 2)) + 1)
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
    summed = partial(oaconvolve, in2=weights, mode="same")
    return np.maximum(by_piece(summed, x, pieces), 0.0)


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
    still |= changes(np.signbit(v), pieces)
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


def changes(state: Mask, pieces: Sequence[slice]) -> Mask:
    """Rows to either side of a change of a state (N, C), none across gaps."""
    new = np.diff(state, axis=0, prepend=state[:1])
    new[[piece.start for piece in pieces]] = False
    new[:-1] |= new[1:]
    return np.asarray(new)


def within(event: Mask, pieces: Sequence[slice], reach: int) -> Mask:
    """Rows (N, C) at most `reach` rows from an event, not across gaps."""
    out = np.zeros_like(event)
    for piece in pieces:
        count = np.cumsum(np.pad(event[piece], ((reach + 1, reach), (0, 0))), axis=0)
        out[piece] = count[2 * reach + 1 :] > count[: -2 * reach - 1]
    return out
