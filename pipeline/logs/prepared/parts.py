"""Three parts of the data: *training* estimates, *validation* selects, *test* judges.

Whole logs are held out where there are several, since cycles of one gait resemble each other;
within a log, blocks of rows alternate, with a guard between them longer than what the filter sees
to both sides, so that no part contains a trace of another. Pieces between gaps, or whole logs, that
are too short for that are dealt out as they are: the filter never runs across a gap. Where that
leaves a part without rows, the guard is as long as filtered noise remembers.

Where a motion repeats itself, its period and the noise between repetitions are found here, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.logs.prepared.measurement import TEST, TRAIN, UNUSED, VALIDATION
from pipeline.logs.prepared.prepare import Prepared

#: Correlation from which a motion counts as repeated.
REPEATED: Final = 0.98
#: Difference of repeated positions per their spread up to which efforts may be compared.
SAME_MOTION: Final = 0.02
#: Samples used to find the period.
PERIOD_ROWS: Final = 16_384
NAMES: Final = ("training", "validation", "test")
#: Guard between blocks per reach of the filter to one side: more than both sides together.
GUARD: Final = 2.2
#: Blocks are at least this many guards long, so that little is lost between them.
BLOCK_GUARDS: Final = 5.0
#: Rows that a part needs.
_LEAST_ROWS: Final = 20
#: Short logs from which on every fourth is held out, not the last alone.
_MANY_LOGS: Final = 8
#: Blocks a log is cut into where it is long enough.
MOST_BLOCKS: Final = 48
FEWEST_BLOCKS: Final = 6
#: The order in which blocks go to the parts: half to training, a quarter each to the others.
PATTERN: Final = (TRAIN, VALIDATION, TRAIN, TEST)
PATTERN_WITHOUT_TEST: Final = (TRAIN, VALIDATION, TRAIN)


@dataclass(frozen=True)
class Parts:
    """Which rows of which log belong to which part."""

    #: Per log, shape (N,): `TRAIN`, `VALIDATION`, `TEST` or `UNUSED` (guards).
    part: tuple[NDArray[np.int8], ...]
    #: Per log, shape (N,): number of the block, unique over all logs; -1 in guards.
    block: tuple[NDArray[np.int32], ...]
    guard: float  #: Between blocks [s].
    rule: str  #: How the parts were cut, in words.
    warning: str  #: What the test cannot show, or empty.


def split(
    prepared: Sequence[Prepared],
    *,
    holdout: Sequence[Prepared] = (),
    prove_last: float | None = None,
) -> Parts:
    """Cut logs into training, validation and test.

    Args:
        prepared: Logs that may be fitted.
        holdout: Logs for the test only.
        prove_last: Share of every log, at its end, for the test instead.

    Returns:
        Parts of `prepared` followed by `holdout`.

    Raises:
        LegwattError: Too little data for three parts.
    """
    every = [*prepared, *holdout]
    guard = GUARD * max(one.memory for one in every)
    remembered = max(one.settings.lowpass.noise_memory for one in every)
    if prove_last is not None and not 0.05 <= prove_last <= 0.8:
        raise LegwattError(f"share to test on is {prove_last:g}; expected 0.05 to 0.8")
    tested = set(range(len(prepared), len(every)))
    warning, last = "", 0.0
    pattern: tuple[int, ...] = PATTERN_WITHOUT_TEST
    if holdout:
        rule = "tested on the held-out logs"
    elif prove_last is not None:
        rule, last = f"tested on the last {100 * prove_last:g} % of every log", prove_last
    elif len(prepared) > 1:
        tested, rule = _held_out(prepared, guard)
    else:
        rule, pattern = "tested on every fourth block of the log", PATTERN
        if (cycle := period(prepared[0])) is not None:
            warning = (
                f"the log repeats one motion every {cycle:.3g} s: held-out cycles of it show "
                "nothing about other motions; give a log of another motion, speed or load with "
                "--holdout"
            )
    for apart in (guard, remembered):
        part, block = _parts(every, tested, apart, pattern, last)
        rows = [sum(int((kind == k).sum()) for kind in part) for k in range(len(NAMES))]
        if min(rows) >= _LEAST_ROWS:
            return Parts(part, block, apart, rule, warning)
    duration = sum(float(one.time[-1] - one.time[0]) for one in every)
    raise LegwattError(
        f"{every[0].log.name}: {duration:.3g} s in {sum(len(o.pieces) for o in every)} "
        f"pieces without a gap, at a cut-off of {every[0].cutoff:.3g} Hz with guards of "
        f"{remembered:.2g} s between parts, leave {min(rows)} rows to "
        f"{NAMES[int(np.argmin(rows))]}; log longer, or raise the cut-off"
    )


def _parts(
    every: Sequence[Prepared],
    tested: set[int],
    guard: float,
    pattern: Sequence[int],
    prove_last: float,
) -> tuple[tuple[NDArray[np.int8], ...], tuple[NDArray[np.int32], ...]]:
    """Parts and blocks of logs of which some are for the test alone."""
    part, block, count = [], [], 0
    open_ = [one for k, one in enumerate(every) if k not in tested]
    short = sum(len(_short(one, guard)) for one in open_)
    dealt = 0  # pieces that were dealt out as they are, in the pattern's order
    for k, one in enumerate(every):
        rule = ((TEST,), 0.0) if k in tested else (pattern, prove_last)
        whole = _short(one, guard) if k not in tested and short >= len(pattern) else ()
        kinds, numbers = _cut(one, guard, *rule, whole, dealt)
        dealt += len(whole)
        block.append(np.where(numbers >= 0, numbers + count, -1).astype(np.int32))
        count += int(numbers.max(initial=-1)) + 1
        part.append(kinds)
    return tuple(part), tuple(block)


def _short(one: Prepared, guard: float) -> tuple[int, ...]:
    """Numbers of pieces of which guards between the fewest blocks would take most."""
    least = 2 * FEWEST_BLOCKS * guard / one.settings.dt
    return tuple(k for k, piece in enumerate(one.pieces) if piece.stop - piece.start < least)


def _held_out(prepared: Sequence[Prepared], guard: float) -> tuple[set[int], str]:
    """Which of several logs are for the test: one condition, else the last log.

    Of many short logs every fourth is.

    Of the condition that takes most values, the median one is left out: to predict between what
    was seen is fair, at the ends it is extrapolation.
    """
    conditions = [dict(one.log.condition) for one in prepared]
    best: tuple[str, list[float | str]] = ("", [""])
    for key in sorted(set.intersection(*(set(c) for c in conditions))):
        values = sorted({c[key] for c in conditions}, key=lambda v: (isinstance(v, str), v))
        if len(values) > len(best[1]):
            best = key, values
    key, values = best
    short = all(len(_short(one, guard)) == len(one.pieces) for one in prepared)
    if not key and short and len(prepared) >= _MANY_LOGS:
        return set(range(3, len(prepared), len(PATTERN))), "tested on every fourth log"
    if not key:
        last = len(prepared) - 1
        return {last}, f"tested on the log {prepared[last].log.name}"
    # With two values the larger one; with more the one in the middle.
    left_out = values[len(values) // 2]
    chosen = {k for k, c in enumerate(conditions) if c[key] == left_out}
    return chosen, f"tested on the logs with {key} = {left_out}"


def _cut(
    one: Prepared,
    guard: float,
    pattern: Sequence[int],
    prove_last: float,
    whole: Sequence[int] = (),
    dealt: int = 0,
) -> tuple[NDArray[np.int8], NDArray[np.int32]]:
    """Blocks of one log, with a guard wherever neighbours belong to different parts.

    Pieces whose numbers are in `whole` go to one part each, the first to the pattern's place
    `dealt`, the last share of them to the test.
    """
    part = np.full(len(one), UNUSED, dtype=np.int8)
    block = np.full(len(one), -1, dtype=np.int32)
    margin = int(np.ceil(guard / one.settings.dt))
    number = 0
    proves = len(whole) - round(prove_last * len(whole))
    for k, piece in enumerate(one.pieces):
        size = piece.stop - piece.start
        if k in whole:
            if size >= 3:
                turn = whole.index(k)
                kind = pattern[(dealt + turn) % len(pattern)] if turn < proves else TEST
                part[piece], block[piece] = kind, number
                number += 1
            continue
        fitted = size - round(prove_last * size)
        count = _block_count(fitted, margin)
        edges = np.round(np.linspace(0, fitted, count + 1)).astype(int).tolist()
        kinds = [pattern[b % len(pattern)] for b in range(count)]
        if prove_last:
            # The test is cut into blocks too: intervals are taken over blocks.
            more = _block_count(size - fitted, margin)
            edges += np.round(np.linspace(fitted, size, more + 1)).astype(int).tolist()[1:]
            kinds += [TEST] * more
        for b, kind in enumerate(kinds):
            start, stop = edges[b], edges[b + 1]
            # Between two parts the guard is taken from the one that is not the test.
            if b > 0 and kinds[b - 1] == TEST != kind:
                start += margin
            if b + 1 < len(kinds) and kinds[b + 1] != kind != TEST:
                stop -= margin
            if stop - start < 3:
                continue
            rows = slice(piece.start + start, piece.start + stop)
            part[rows], block[rows] = kind, number
            number += 1
    outside = np.ones(len(one), dtype=np.bool_)
    outside[one.core] = False
    part[outside], block[outside] = UNUSED, -1
    return part, block


def _block_count(rows: int, margin: int) -> int:
    return min(MOST_BLOCKS, max(int(rows / ((1 + BLOCK_GUARDS) * margin)), FEWEST_BLOCKS))


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
