"""What repeats: the period of a motion, and the noise seen between repetitions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.logs.prepared.prepare import Prepared

#: Correlation from which a motion counts as repeated.
REPEATED: Final = 0.98
#: Difference of repeated positions per their spread up to which efforts may be compared.
SAME_MOTION: Final = 0.02
#: Samples used to find the period.
PERIOD_ROWS: Final = 16_384


def period(prepared: Prepared) -> float | None:
    """Period of the motion [s], or None where fewer than three cycles repeat.

    The autocorrelation of all joints' velocities, each by its own spread; the first peak above
    `REPEATED`, refined between samples by a parabola.
    """
    piece = max(prepared.pieces, key=lambda p: p.stop - p.start)
    v = prepared.v[piece]
    every = max(1, v.shape[0] // PERIOD_ROWS)
    v = v[::every]
    n = v.shape[0]
    spread = v.std(axis=0)
    moving = spread > 1e-3 * max(float(spread.max()), 1e-300)
    if n < 100 or not moving.any() or spread.max() == 0:
        return None
    x = v[:, moving] / spread[moving]
    x = x - x.mean(axis=0)
    size = 1 << int(np.ceil(np.log2(2 * n)))
    raw = np.fft.irfft((np.abs(np.fft.rfft(x, size, axis=0)) ** 2).sum(axis=1), size)[:n]
    power = np.concatenate([[0.0], np.cumsum((x**2).sum(axis=1))])
    lags = np.arange(n // 3)
    # Energy of the two stretches that overlap at each lag, so that the ends do not count.
    both = np.sqrt(np.maximum((power[n - lags]) * (power[n] - power[lags]), 1e-300))
    r = raw[: lags.size] / both
    peaks = np.flatnonzero((r[1:-1] >= r[:-2]) & (r[1:-1] > r[2:]) & (r[1:-1] > REPEATED)) + 1
    # The slope from lag zero is no repetition: it must have come down before.
    first_low = int(np.argmax(r < 0.5)) if (r < 0.5).any() else n
    peaks = peaks[peaks > first_low]
    if peaks.size == 0:
        return None
    # Of near-equal peaks the first: later ones are multiples of the period.
    good = peaks[r[peaks] >= r[peaks].max() - 0.01]
    k = int(good[0])
    bend = r[k - 1] - 2 * r[k] + r[k + 1]
    shift = 0.5 * (r[k - 1] - r[k + 1]) / bend if bend != 0 else 0.0
    return float((k + shift) * every * prepared.settings.dt)


def cycle_noise(prepared: Prepared, cycle: float) -> Array | None:
    """Noise of the effort within the bandwidth from successive cycles of a period [s].

    Half the mean square difference between a sample and the same phase one cycle later, where the
    motion is the same to within `SAME_MOTION` of its spread. Standard deviation, shape (J,), NaN
    where it is not known; None where nothing repeats.
    """
    pairs = []
    for piece in prepared.pieces:
        time = prepared.time[piece]
        later = time[time + cycle <= time[-1]] + cycle
        if later.size >= 50:
            index = (later - time[0]) / prepared.settings.dt
            pairs.append(_difference(prepared, piece.start, prepared, piece, index))
    return _noise(pairs, prepared) if pairs else None


def repeat_noise(first: Prepared, second: Prepared) -> Array | None:
    """Noise from two logs of one motion that begin at the same instant, (J,); None if they do not.

    Standard deviations, as of `cycle_noise`.
    """
    n = min(len(first), len(second))
    if n < max(50, 0.9 * max(len(first), len(second))) or first.settings.dt != second.settings.dt:
        return None
    if len(first.pieces) + len(second.pieces) > 2:
        return None
    index = np.arange(n, dtype=np.float64)
    return _noise([_difference(first, 0, second, slice(0, len(second)), index)], first)


def _difference(
    a: Prepared, first: int, b: Prepared, piece: slice, index: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Differences of position and effort between rows of one and fractional rows of another."""
    rows = slice(first, first + index.size)
    k = np.clip(np.floor(index).astype(int), 0, piece.stop - piece.start - 2) + piece.start
    w = (index - (k - piece.start))[:, None]
    dq = (1 - w) * b.q[k] + w * b.q[k + 1] - a.q[rows]
    de = (1 - w) * b.effort[k] + w * b.effort[k + 1] - a.effort[rows]
    return dq, de, a.mask[rows] & b.mask[k] & b.mask[k + 1]


def _noise(
    parts: Sequence[tuple[Array, Array, NDArray[np.bool_]]], prepared: Prepared
) -> Array | None:
    """Standard deviation of the effort where positions are the same, shape (J,)."""
    dq, de, ok = (np.concatenate(part) for part in zip(*parts, strict=True))
    spread = np.nanstd(prepared.q, axis=0)
    limit = SAME_MOTION * np.maximum(spread, 1e-3 * max(float(spread.max()), 1e-300))
    same = (np.abs(dq) <= 3 * limit).all(axis=1)
    if np.median(np.abs(dq) / limit) > 1 or same.sum() < 50:
        return None
    kept = ok & np.isfinite(de) & same[:, None]
    count = kept.sum(axis=0)
    square = np.where(kept, de, 0.0) ** 2
    return np.where(count >= 50, np.sqrt(square.sum(axis=0) / np.maximum(count, 1) / 2.0), np.nan)


def with_repeated_noise(prepared: Sequence[Prepared]) -> list[Prepared]:
    """Noise floors from cycles or repeated logs wherever there are some, else as they were."""
    out = []
    for k, one in enumerate(prepared):
        cycle = period(one)
        estimates = [cycle_noise(one, cycle)] if cycle is not None else []
        estimates += [repeat_noise(one, b) for i, b in enumerate(prepared) if i != k]
        good = [e for e in estimates if e is not None]
        if good:
            best = np.fmin.reduce(good)
            one = one.with_noise(np.where(np.isfinite(best), best, one.noise), "repeats")
        out.append(one)
    return out
