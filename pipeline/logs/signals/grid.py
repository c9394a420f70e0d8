"""Uniform time grid of a log, its pieces between gaps, its channels' own rates, its stamps' error.

A column may be slower than its log: most cells empty, each value held for several rows, or rows
interpolated between samples afterwards. What lies above a quarter of its own rate is not in it.

A stamp late by dt reads speed times dt wrong: each position is compared with the cubic through its
four neighbours at their stamps. What it differs by has a variance of c (s_q^2 + s_t^2 v^2), with
the encoder's noise s_q, the stamps' error s_t and c from the cubic's weights: a straight line over
v^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask

#: Share of a log's time that may lie in longer steps: those are gaps, not the channel's rate.
_IN_GAPS: Final = 0.02
#: Steps this many times longer than the usual one are gaps.
_GAP: Final = 20.0
#: Share of a moving channel's rows on a straight line between their neighbours from which on rows
#: were interpolated; noise and rounding of a sensor leave hardly any.
_STRAIGHT: Final = 0.4
#: Share of those rows in stretches of one length, a row more or less.
_PACE: Final = 0.6
#: Distance from that line, in usual changes from row to row.
_ON_LINE: Final = 1e-4
#: Groups of rows by speed through which the line is laid.
_GROUPS: Final = 12
#: Median of a squared normal variable.
_MEDIAN_SQUARE: Final = 0.4549364
_LEAST_ROWS: Final = 200
#: A step this many times the usual one is a gap; the filter never runs across it.
GAP: Final = 2.5
#: Times that lie this near to the grid, in steps, need no interpolation.
JITTER_IGNORED: Final = 0.05
#: Spectra and noise are taken from at most this many stretches of this many rows.
STRETCHES: Final = 8
STRETCH_ROWS: Final = 16_384


@dataclass(frozen=True)
class Grid:
    """A uniform grid."""

    time: Array  #: Shape (M,) [s].
    pieces: tuple[slice, ...]  #: Stretches without a gap, slices of the grid's rows.
    nearest: NDArray[np.intp]  #: Nearest row of the log, shape (M,).
    #: Row of the log to the left of each grid time, shape (M,); None where the log's own rows lie
    #: on the grid.
    left: NDArray[np.intp] | None = None
    share: Array | None = None  #: Weight of the row to the right, shape (M,).

    def resample(self, values: Array) -> Array:
        """Values on the grid by linear interpolation, shape (M, C); NaN stays NaN."""
        if self.left is None or self.share is None:
            return np.array(values)
        weight = self.share[:, None]
        right = np.minimum(self.left + 1, values.shape[0] - 1)
        below, above = values[self.left], values[right]
        # Where the weight is zero a missing neighbour does not matter.
        return np.where(weight == 0, below, (1 - weight) * below + weight * above)

    def flags(self, flag: Mask) -> Mask:
        """A flag on the grid: set where either neighbour has it."""
        if self.left is None or self.share is None:
            return np.array(flag)
        right = np.minimum(self.left + 1, flag.shape[0] - 1)
        used = (self.share > 0)[:, None]
        return np.asarray(flag[self.left] | (flag[right] & used))


def uniform_grid(
    time: Array, dt: float, origin: float | None = None, *, bridge: float = 0.0
) -> Grid:
    """Lay a uniform grid of steps `dt` [s] under a log.

    The log's own rows where each piece is uniform to within `JITTER_IGNORED` steps, else a grid to
    interpolate on, through `origin` or the first time [s]; steps up to `bridge` [s] are no gaps.
    """
    # A step longer than `GAP` usual ones and than `bridge` is a gap.
    cuts = np.flatnonzero(np.diff(time) > max(GAP * dt, bridge)) + 1
    edges = [0, *cuts.tolist(), time.size]
    pieces = [slice(a, b) for a, b in pairwise(edges)]
    if all(_is_uniform(time[piece], dt) for piece in pieces):
        return Grid(time, tuple(pieces), np.arange(time.size, dtype=np.intp))
    start = time[0] if origin is None else origin
    times, slices, filled = [], [], 0
    for piece in pieces:
        part = time[piece]
        first = int(np.ceil((part[0] - start) / dt - 1e-9))
        last = int(np.floor((part[-1] - start) / dt + 1e-9))
        if last < first:
            continue
        grid = start + dt * np.arange(first, last + 1)
        times.append(np.clip(grid, part[0], part[-1]))
        slices.append(slice(filled, filled + grid.size))
        filled += grid.size
    all_times = np.concatenate(times)
    left = np.clip(np.searchsorted(time, all_times, side="right") - 1, 0, time.size - 2)
    share = (all_times - time[left]) / (time[left + 1] - time[left])
    nearest = np.where(share > 0.5, left + 1, left)
    return Grid(all_times, tuple(slices), nearest.astype(np.intp), left.astype(np.intp), share)


def _is_uniform(time: Array, dt: float) -> bool:
    ideal = time[0] + dt * np.arange(time.size)
    # A rate that is off by a little is no jitter: compare with the piece's own step too.
    own = np.linspace(time[0], time[-1], time.size)
    drift_ok = time.size < 2 or abs((time[-1] - time[0]) / (time.size - 1) / dt - 1) < 1e-3
    limit = JITTER_IGNORED * dt
    return bool(
        np.abs(time - ideal).max() <= limit or (drift_ok and np.abs(time - own).max() <= limit)
    )


def fill_gaps(time: Array, values: Array, ok: Mask) -> Array:
    """Bad values interpolated linearly from good ones; zero where a column has no good one."""
    out = np.array(values)
    good = ok & np.isfinite(values)
    for c in np.flatnonzero(~good.all(axis=0)):
        keep = good[:, c]
        out[:, c] = np.interp(time, time[keep], values[keep, c]) if keep.any() else 0.0
    return out


def busiest(x: Array, pieces: Sequence[slice]) -> list[slice]:
    """Stretches in which a long log (N, C) changes most: enough to know its spectrum and noise.

    The pieces themselves where they are short, else up to `STRETCHES` of `STRETCH_ROWS` rows.
    """
    if sum(p.stop - p.start for p in pieces) <= STRETCHES * STRETCH_ROWS:
        return list(pieces)
    parts = [
        slice(start, start + STRETCH_ROWS)
        for p in pieces
        for start in range(p.start, p.stop - STRETCH_ROWS + 1, STRETCH_ROWS)
    ]
    if not parts:
        return sorted(pieces, key=lambda p: p.stop - p.start)[-STRETCHES:]
    # Mean square step of each column per its largest: every joint counts alike.
    change = np.stack([np.nanmean((x[p][::8][1:] - x[p][::8][:-1]) ** 2, axis=0) for p in parts])
    busy = (change / np.maximum(change.max(axis=0), 1e-300)).sum(axis=1)
    best = np.sort(np.argsort(-busy, kind="stable")[:STRETCHES])
    return [parts[k] for k in best]


def runs_of(flag: Mask) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First rows, and rows after the last, of the stretches in which a flag (N,) is set."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flag.astype(np.int8), [0]])))
    return edges[::2], edges[1::2]


def long_runs(time: Array, bad: Mask, longest: float) -> Mask:
    """Bad samples (N, C) except runs between good ones up to `longest` [s], as held repeats are."""
    out = np.zeros_like(bad)
    for c in np.flatnonzero(bad.any(axis=0)):
        for start, stop in zip(*runs_of(bad[:, c]), strict=True):
            left, right = max(start - 1, 0), min(stop, time.size - 1)
            open_end = start == 0 or stop == time.size
            if open_end or time[right] - time[left] > longest:
                out[start:stop, c] = True
    return out


def own_spacing(time: Array, ok: Mask) -> float:
    """Step between good samples [s] that all but `_IN_GAPS` of the time keeps to; inf for none."""
    step = np.sort(np.diff(time[ok]))
    if step.size == 0:
        return np.inf
    step = step[: np.searchsorted(step, _GAP * step[step.size // 2], side="right")]
    passed = np.cumsum(step)
    return float(step[int(np.searchsorted(passed, (1.0 - _IN_GAPS) * passed[-1]))])


def interpolated(time: Array, x: Array) -> Mask:
    """Rows (N,) that lie on the straight line between their neighbours; none in a sensor's own log.

    All false where fewer rows than `_STRAIGHT` of the moving ones do.
    """
    out = np.zeros(x.size, dtype=np.bool_)
    if x.size < 10:
        return out
    change = np.abs(np.diff(x))
    alive = change[np.isfinite(change) & (change > 0)]
    if alive.size < 10:
        return out
    share = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
    away = np.abs(x[1:-1] - (1.0 - share) * x[:-2] - share * x[2:])
    moving = (change[1:] > 0) | (change[:-1] > 0)
    with np.errstate(invalid="ignore"):
        straight = away < _ON_LINE * float(np.median(alive))
    straight &= moving
    if straight.sum() < max(_STRAIGHT * moving.sum(), 10):
        return out
    # Samples between which lines were drawn come at one pace; steps of a rounded sensor do not.
    starts, stops = runs_of(straight)
    length = stops - starts
    usual = float(np.median(np.repeat(length, length)))
    if usual < 3 or length[np.abs(length - usual) <= 1].sum() < _PACE * straight.sum():
        return out
    out[1:-1] = straight
    return out


def stamp_error(time: Array, q: Array, gap: float) -> tuple[float, float]:
    """Standard deviation of the stamps' errors and its standard error [s]; zeros if none tells.

    Args:
        time: Strictly increasing, shape (N,) [s].
        q: Positions, shape (N, J) [rad].
        gap: Steps longer than this are none to compare across [s].
    """
    if time.size < _LEAST_ROWS:
        return 0.0, 0.0
    with np.errstate(all="ignore"):  # numbers no clock shows leave no finite row
        weights = _lagrange(time)
        scatter = 1.0 + (weights**2).sum(axis=0)
        close = np.diff(time) <= gap
        inside = close[:-3] & close[1:-2] & close[2:-1] & close[3:]
        squares, errors = [], []
        for j in range(q.shape[1]):
            x = q[:, j]
            guess = sum(
                w * x[k : x.size - 4 + k] for w, k in zip(weights, (0, 1, 3, 4), strict=True)
            )
            rest = (x[2:-2] - guess) ** 2 / scatter
            speed = ((x[3:-1] - x[1:-3]) / (time[3:-1] - time[1:-3])) ** 2
            good = inside & np.isfinite(rest) & np.isfinite(speed)
            seen = _slope(speed[good], rest[good])
            if seen is not None and seen[1] > 0:
                squares.append(seen[0])
                errors.append(seen[1])
        if not squares:
            return 0.0, 0.0
        # By the most certain one: variances of variances are small numbers.
        finest = min(errors)
        weight = (finest / np.array(errors)) ** 2
        square = float(np.average(squares, weights=weight))
        error = finest / float(np.sqrt(weight.sum()))
        size = float(np.sqrt(max(square, 0.0)))
        return size, error / (2.0 * size) if size > 0 else float(np.sqrt(error))


def _lagrange(time: Array) -> Array:
    """Weights of the cubic through four neighbours at the sample between, shape (4, N - 4)."""
    n = time.size - 4
    t = [time[k : k + n] - time[2 : 2 + n] for k in (0, 1, 3, 4)]
    rows = []
    for a in range(4):
        w = np.ones(n)
        for b in range(4):
            if b != a:
                w = w * (-t[b]) / (t[a] - t[b])
        rows.append(w)
    return np.stack(rows)


def _slope(speed: Array, rest: Array) -> tuple[float, float] | None:
    """Slope of squared misfit over squared speed and its standard error; None without motion."""
    if speed.size < _LEAST_ROWS or speed.max() <= 0:
        return None
    order = np.argsort(speed, kind="stable")
    groups = np.array_split(order, _GROUPS)
    x = np.array([speed[g].mean() for g in groups])
    y = np.array([np.median(rest[g]) / _MEDIAN_SQUARE for g in groups])
    # A median of n squares scatters by about 2.3 / sqrt(n) of itself.
    sigma = 2.3 * np.maximum(y, 1e-300) / np.sqrt([g.size for g in groups])
    design = np.stack([np.ones_like(x), x], axis=1) / sigma[:, None]
    if np.ptp(x) <= 0:
        return None
    scale = np.abs(design).max(axis=0)
    if not np.isfinite(scale).all() or not np.isfinite(y / sigma).all():
        return None  # numbers whose squares are beyond any
    covariance = np.linalg.pinv((design / scale).T @ (design / scale))
    solution = covariance @ ((design / scale).T @ (y / sigma)) / scale
    return float(solution[1]), float(np.sqrt(covariance[1, 1]) / scale[1])
