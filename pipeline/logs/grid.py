"""The uniform time grid of a log, its pieces between gaps, and its channels' own rates.

A column may be slower than its log: most cells empty, each value held for several rows, or rows
interpolated between samples afterwards. What lies above a quarter of its own rate is not in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask

Rows = NDArray[np.intp]
#: A step this many times the usual one is a gap; the filter never runs across it.
GAP: Final = 2.5
#: Times that lie this near to the grid, in steps, need no interpolation.
JITTER_IGNORED: Final = 0.05
#: Spectra and noise are taken from at most this many stretches of this many rows.
STRETCHES: Final = 8
STRETCH_ROWS: Final = 16_384
#: Rows between two looked at: the speed of a robot changes little within them.
EVERY: Final = 8
#: Share of a log's time that may lie in longer steps: those are gaps, not the channel's rate ...
_IN_GAPS: Final = 0.02
#: ... as are steps this many times longer than the usual one.
_LONG: Final = 20.0


@dataclass(frozen=True)
class Grid:
    """A uniform grid."""

    time: Array  #: Shape (M,) [s].
    pieces: tuple[slice, ...]  #: Stretches without a gap, slices of the grid's rows.
    left: Rows  #: Row of the log to the left of each grid time, shape (M,).
    share: Array | None = None  #: Weight of the row to the right, (M,); None where rows lie on it.

    @property
    def nearest(self) -> Rows:
        """Nearest row of the log, shape (M,)."""
        return self.left if self.share is None else self.left + (self.share > 0.5)

    def resample(self, values: Array) -> Array:
        """Values of the log's rows (N, ...) on the grid by straight lines; NaN stays NaN."""
        if self.share is None:
            return np.array(values)
        weight = self.share.reshape(-1, *(1,) * (values.ndim - 1))
        below, above = values[self.left], values[np.minimum(self.left + 1, values.shape[0] - 1)]
        # Where the weight is zero a missing neighbour does not matter.
        return np.where(weight == 0, below, (1 - weight) * below + weight * above)

    def flags(self, flag: Mask) -> Mask:
        """A flag of the log's rows (N,) on the grid: set where either neighbour has it."""
        if self.share is None:
            return np.array(flag)
        right = np.minimum(self.left + 1, flag.size - 1)
        return np.asarray(flag[self.left] | (flag[right] & (self.share > 0)))


def uniform_grid(time: Array, dt: float, *, bridge: float = 0.0) -> Grid:
    """Lay a uniform grid of steps `dt` [s] under a log.

    The log's own rows where each piece is uniform to within `JITTER_IGNORED` steps, else a grid to
    interpolate on, through the first time; steps up to `bridge` [s] are no gaps.
    """
    cuts = np.flatnonzero(np.diff(time) > max(GAP * dt, bridge)) + 1
    pieces = [slice(a, b) for a, b in pairwise([0, *cuts.tolist(), time.size])]
    if all(_is_uniform(time[piece], dt) for piece in pieces):
        return Grid(time, tuple(pieces), np.arange(time.size, dtype=np.intp))
    times = []
    for part in (time[piece] for piece in pieces):
        first = int(np.ceil((part[0] - time[0]) / dt - 1e-9))
        last = int(np.floor((part[-1] - time[0]) / dt + 1e-9))
        if last >= first:
            grid = time[0] + dt * np.arange(first, last + 1)
            times.append(np.clip(grid, part[0], part[-1]))
    whole, ends = np.concatenate(times), np.cumsum([0, *map(len, times)]).tolist()
    left = np.clip(np.searchsorted(time, whole, side="right") - 1, 0, time.size - 2)
    share = (whole - time[left]) / (time[left + 1] - time[left])
    slices = tuple(slice(a, b) for a, b in pairwise(ends))
    return Grid(whole, slices, left.astype(np.intp), share)


def _is_uniform(time: Array, dt: float) -> bool:
    # A rate that is off by a little is no jitter: compare with the piece's own step too.
    own = (time[-1] - time[0]) / max(time.size - 1, 1)
    steps = [dt, own] if abs(own / dt - 1.0) < 1e-3 else [dt]
    rows = np.arange(time.size)
    return any(np.abs(time - time[0] - s * rows).max() <= JITTER_IGNORED * dt for s in steps)


def fill_gaps(time: Array, x: Array, ok: Mask) -> Array:
    """Bad values (N,) interpolated from good ones; zero where there is none."""
    good = ok & np.isfinite(x)
    if good.all():
        return x
    return np.interp(time, time[good], x[good]) if good.any() else np.zeros(x.size)


def most_telling(tells: Array, count: int) -> list[int]:
    """Numbers of the stretches of a log that tell most: half of them, and half spread evenly.

    A joint that moves in one minute of an hour is thus seen.

    Args:
        tells: What each tells of every quantity, such as variances, shape (S, Q).
        count: Most of them.
    """
    score = (tells / np.maximum(tells.mean(axis=0), 1e-300)).sum(axis=1)
    alive = np.flatnonzero(score > 0)
    best = alive[np.argsort(-score[alive], kind="stable")[: count // 2]]
    others = np.setdiff1d(alive, best)
    places = np.linspace(0, max(others.size - 1, 0), count - best.size).astype(int)
    return sorted({*best.tolist(), *others[places[: others.size]].tolist()})


def busiest(coarse: Array, pieces: Sequence[slice]) -> list[slice]:
    """Stretches of a long log that are enough to know its spectrum and noise.

    The pieces themselves where they are short, else up to `STRETCHES` of `STRETCH_ROWS` rows.
    `coarse` is every `EVERY`-th row of the log, shape (N / EVERY, C).
    """
    if sum(p.stop - p.start for p in pieces) <= STRETCHES * STRETCH_ROWS:
        return list(pieces)
    parts = cut(pieces, STRETCH_ROWS, whole=True)
    if not parts:
        return sorted(pieces, key=lambda p: p.stop - p.start)[-STRETCHES:]
    own = [coarse[p.start // EVERY : p.stop // EVERY] for p in parts]
    change = np.stack([np.nanmean(np.diff(x, axis=0) ** 2, axis=0) for x in own])
    return [parts[k] for k in most_telling(change, STRETCHES)]


def cut(pieces: Sequence[slice], rows: int, *, whole: bool = False) -> list[slice]:
    """Pieces in stretches of so many rows; those that are shorter too, unless `whole`."""
    return [
        slice(start, min(start + rows, p.stop))
        for p in pieces
        for start in range(p.start, p.stop - (rows - 1) * whole, rows)
    ]


def runs_of(flag: Mask) -> tuple[Rows, Rows]:
    """First rows, and rows after the last, of the stretches in which a flag (N,) is set."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flag.astype(np.int8), [0]])))
    return edges[::2], edges[1::2]


def long_runs(time: Array, bad: Mask, longest: float) -> Mask:
    """Bad samples (N,) except runs between good ones up to `longest` [s], as held repeats are."""
    out = np.zeros(bad.size, dtype=np.bool_)
    starts, stops = runs_of(bad)
    lasts = time[np.minimum(stops, time.size - 1)] - time[np.maximum(starts - 1, 0)]
    keep = (starts == 0) | (stops == time.size) | (lasts > longest)
    for start, stop in zip(starts[keep], stops[keep], strict=True):
        out[start:stop] = True
    return out


def own_spacing(time: Array, ok: Mask) -> float:
    """Step between good samples [s] that all but `_IN_GAPS` of the time keeps to; inf for none."""
    step = np.sort(np.diff(time[ok]))
    if step.size == 0:
        return np.inf
    step = step[: np.searchsorted(step, _LONG * step[step.size // 2], side="right")]
    passed = np.cumsum(step)
    return float(step[int(np.searchsorted(passed, (1.0 - _IN_GAPS) * passed[-1]))])
