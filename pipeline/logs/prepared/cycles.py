"""What repeats: the period of a motion, and the noise seen between repetitions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.logs.prepared.prepare import Prepared

Array = NDArray[np.float64]

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
    """Noise of the effort within the bandwidth from successive cycles.

    Half the mean square difference between a sample and the same phase one cycle later, where the
    motion is the same to within `SAME_MOTION` of its spread.

    Args:
        prepared: With at least two cycles.
        cycle: Period [s].

    Returns:
        Standard deviation, shape (J,), NaN where it cannot be told; None where nothing repeats.
    """
    pairs = []
    for piece in prepared.pieces:
        time = prepared.time[piece]
        later = time + cycle
        inside = later <= time[-1]
        if inside.sum() >= 50:
            pairs.append((piece, later[inside]))
    if not pairs:
        return None
    differences = []
    for piece, later in pairs:
        n = later.size
        first = slice(piece.start, piece.start + n)
        index = (later - prepared.time[piece.start]) / prepared.settings.dt
        differences.append(_difference(prepared, first, prepared, piece, index))
    return _noise(differences, np.nanstd(prepared.q, axis=0))


def repeat_noise(first: Prepared, second: Prepared) -> Array | None:
    """Noise from two logs of one motion that begin at the same instant; None if they do not.

    Returns:
        Standard deviation, shape (J,).
    """
    if len(first) < 50 or len(second) < 50 or first.settings.dt != second.settings.dt:
        return None
    n = min(len(first), len(second))
    if n < 0.9 * max(len(first), len(second)) or len(first.pieces) + len(second.pieces) > 2:
        return None
    part = slice(0, n)
    index = np.arange(n, dtype=np.float64)
    difference = _difference(first, part, second, slice(0, len(second)), index)
    return _noise([difference], np.nanstd(first.q, axis=0))


def _difference(
    a: Prepared, rows: slice, b: Prepared, piece: slice, index: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Differences of position and effort between rows of one and fractional rows of another."""
    k = np.clip(np.floor(index).astype(int), 0, piece.stop - piece.start - 2) + piece.start
    w = (index - (k - piece.start))[:, None]
    dq = (1 - w) * b.q[k] + w * b.q[k + 1] - a.q[rows]
    de = (1 - w) * b.effort[k] + w * b.effort[k + 1] - a.effort[rows]
    ok = a.mask[rows] & b.mask[k] & b.mask[k + 1]
    return dq, de, ok


def _noise(parts: Sequence[tuple[Array, Array, NDArray[np.bool_]]], spread: Array) -> Array | None:
    dq = np.concatenate([part[0] for part in parts])
    de = np.concatenate([part[1] for part in parts])
    ok = np.concatenate([part[2] for part in parts]) & np.isfinite(de)
    limit = SAME_MOTION * np.maximum(spread, 1e-3 * max(float(spread.max()), 1e-300))
    same = (np.abs(dq) <= 3 * limit).all(axis=1)
    if np.median(np.abs(dq) / limit) > 1 or same.sum() < 50:
        return None
    ok &= same[:, None]
    out = np.full(de.shape[1], np.nan)
    for j in range(de.shape[1]):
        kept = de[ok[:, j], j]
        if kept.size >= 50:
            out[j] = np.sqrt(np.mean(kept**2) / 2.0)
    return out


def with_repeated_noise(prepared: Sequence[Prepared]) -> list[Prepared]:
    """Noise floors from cycles or repeated logs wherever there are some, else as they were."""
    out = []
    for k, one in enumerate(prepared):
        cycle = period(one)
        estimates = [cycle_noise(one, cycle)] if cycle is not None else []
        estimates += [repeat_noise(one, b) for i, b in enumerate(prepared) if i != k]
        good = [e for e in estimates if e is not None]
        if not good:
            out.append(one)
            continue
        table = np.stack(good)
        known = np.isfinite(table).any(axis=0)
        best = np.where(known, np.min(np.where(np.isfinite(table), table, np.inf), axis=0), 0.0)
        out.append(one.with_noise(np.where(known, best, one.noise), "repeats"))
    return out
