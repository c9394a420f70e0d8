"""How a channel was sampled: rate, gaps, quantisation, held values, saturation, standstill."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.logs.signals.grid import GAP

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Rows looked at for the lattice of values.
LATTICE_ROWS: Final = 100_000
#: Half-width of the window in which a channel's mean change per row is taken.
WINDOW: Final = 20


@dataclass(frozen=True)
class Clock:
    """Spacing of the rows.

    Attributes:
        dt: Median step [s].
        jitter: Standard deviation of the steps inside pieces [s].
        gaps: Number of steps longer than `GAP` usual ones.
        longest: Longest step [s].
    """

    dt: float
    jitter: float
    gaps: int
    longest: float


def clock(time: Array) -> Clock:
    """Judge the spacing of rows, shape (N,) [s]."""
    step = np.diff(time)
    dt = float(np.median(step))
    inside = step <= GAP * dt
    return Clock(dt, float(np.std(step[inside])), int((~inside).sum()), float(step.max()))


def quantum(x: Array) -> tuple[float, float]:
    """Step of a quantised channel.

    Args:
        x: Shape (N,).

    Returns:
        Step and the share of values on its lattice; step 0 where none shows.
    """
    part = x[: LATTICE_ROWS + 1]
    part = part[np.isfinite(part)]
    values, counts = np.unique(part, return_counts=True)
    if values.size < 3:
        return 0.0, 0.0
    if values.size < 0.5 * part.size:
        step, whole = _lattice(values)
        if whole > 0.9:
            return step, whole
    # A log that was interpolated after sampling still rests on the values of the sensor.
    often = values[counts >= 5]
    if often.size >= 5 and counts[counts >= 5].sum() > 0.2 * part.size:
        step, whole = _lattice(often)
        if whole > 0.6:
            return step, whole * float(counts[counts >= 5].sum()) / part.size
    return 0.0, 0.0


def new_values(time: Array, x: Array) -> float:
    """How often a channel takes a new value, by the median over its changes [Hz].

    A rounded channel of speed v and step d does v / d times a second, and its error is a sawtooth
    of that frequency: a filter that lets it pass shows the steps, and no speed between them.

    Args:
        time: Shape (N,) [s].
        x: Shape (N,).

    Returns:
        Infinite where it never changes.
    """
    changes = time[1:][np.diff(x) != 0]
    if changes.size == 0:
        return np.inf
    apart = np.diff(changes) if changes.size > 1 else time[-1:] - time[:1]
    return 1.0 / float(np.median(apart))


def _lattice(values: Array) -> tuple[float, float]:
    """Usual spacing of sorted values and the share of spacings that are whole multiples."""
    gaps = np.diff(values)
    gaps = gaps[gaps > 1e-9 * (values[-1] - values[0])]
    step = float(np.quantile(gaps, 0.1))
    return step, float(np.mean(np.abs(gaps / step - np.round(gaps / step)) < 0.05))


def held(x: Array, step: float) -> tuple[float, Mask]:
    """Repeats that quantisation does not explain: sample-and-hold.

    Where a channel changes by more than two of its quanta per row on average, every row should
    differ from the one before, but for those that rounding makes alike: no more rows than differ by
    one smallest step.

    Args:
        x: Shape (N,).
        step: From `quantum`.

    Returns:
        Share of such rows that repeat, and the repeats themselves, shape (N,).
    """
    n = x.size
    repeats = np.zeros(n, dtype=np.bool_)
    repeats[1:] = x[1:] == x[:-1]
    if n <= 4 * WINDOW:
        return 0.0, np.zeros(n, dtype=np.bool_)
    change = np.abs(x[2 * WINDOW :] - x[: -2 * WINDOW]) / (2 * WINDOW)
    change = np.pad(change, WINDOW, mode="edge")
    change = np.nan_to_num(change)
    fast = change > max(2.0 * step, 0.1 * float(np.quantile(change, 0.95)), 1e-12)
    if fast.sum() < 50:
        return 0.0, np.zeros(n, dtype=np.bool_)
    by_chance = _one_step(x, fast)
    count = int(repeats[fast].sum())
    if count <= 1.5 * by_chance + 4.0 * np.sqrt(count):
        return 0.0, np.zeros(n, dtype=np.bool_)
    return float(repeats[fast].mean()), repeats & fast


def _one_step(x: Array, rows: Mask) -> int:
    """How often a channel (N,) changes by the smallest step it knows, either way."""
    change = np.abs(np.diff(x, prepend=x[0]))
    steps = change[rows & (change > 0)]
    if steps.size == 0:
        return 0
    return int((steps < 1.5 * float(np.quantile(steps, 0.01))).sum())


def saturated(x: Array, moving: Mask, step: float) -> Mask:
    """Rows at the channel's largest or smallest value where it sticks there while moving.

    A peak passes through its neighbourhood; a limit collects rows at one value. Where the channel
    is quantised, more must lie at the limit than just inside it; where it is not, no value comes
    back by chance.

    Args:
        x: Shape (N,).
        moving: Shape (N,).
        step: From `quantum`.

    Returns:
        Shape (N,).
    """
    out = np.zeros(x.size, dtype=np.bool_)
    good = np.isfinite(x) & moving
    if good.sum() < 50:
        return out
    low, high = float(x[good].min()), float(x[good].max())
    for limit in (low, high):
        at = good & (np.abs(x - limit) <= 0.5 * step)
        inside = good & ~at & (np.abs(x - limit) < 4.5 * step)
        runs = at[2:] & at[1:-1] & at[:-2]
        if at.sum() >= 20 and runs.any() and (step == 0 or at.sum() > 2 * inside.sum()):
            # Known to be a limit, it counts at standstill, too.
            out |= np.abs(x - limit) <= 0.5 * step
    return out


def standstill(position: Array, dt: float) -> Mask:
    """Rows in which a joint moves at less than 1 % of its usual top speed.

    Args:
        position: Shape (N, J) [rad].
        dt: [s].

    Returns:
        Shape (N, J).
    """
    w = max(1, min(WINDOW, position.shape[0] // 8))
    speed = np.abs(position[2 * w :] - position[: -2 * w]) / (2 * w * dt)
    speed = np.nan_to_num(np.pad(speed, ((w, w), (0, 0)), mode="edge"))
    # A short excursion still counts as motion, a single jump does not.
    top = np.quantile(speed, 0.98, axis=0)
    return np.asarray(speed <= 0.01 * top)
