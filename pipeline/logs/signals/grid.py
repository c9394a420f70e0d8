"""Uniform time grid of a log, its pieces between gaps, and what to do with missing samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask

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


def split_at_gaps(time: Array, dt: float, bridge: float = 0.0) -> list[slice]:
    """Stretches of rows without a step longer than `GAP` usual ones and than `bridge` [s]."""
    cuts = np.flatnonzero(np.diff(time) > max(GAP * dt, bridge)) + 1
    edges = [0, *cuts.tolist(), time.size]
    return [slice(a, b) for a, b in pairwise(edges)]


def uniform_grid(
    time: Array, dt: float, origin: float | None = None, *, bridge: float = 0.0
) -> Grid:
    """Lay a uniform grid of steps `dt` [s] under a log.

    The log's own rows where each piece is uniform to within `JITTER_IGNORED` steps, else a grid to
    interpolate on, through `origin` or the first time [s]; steps up to `bridge` [s] are no gaps.
    """
    pieces = split_at_gaps(time, dt, bridge)
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
