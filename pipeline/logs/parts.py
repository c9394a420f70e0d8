"""Three parts of the data: *training* estimates, *validation* selects, *test* judges.

Whole logs are held out where there are several, since cycles of one gait resemble each other;
within a log, blocks of rows alternate, with a guard between them as long as filtered noise
remembers. Pieces between gaps, or whole logs, that are too short for that are dealt out as they
are: the filter never runs across a gap.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import count as count_from
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.logs.filters import LowPass
from pipeline.logs.log import TEST, TRAIN, UNUSED, VALIDATION, Log
from pipeline.logs.sampling import cut, most_telling

NAMES: Final = ("training", "validation", "test")
#: Blocks are at least this many guards long, so that little is lost between them.
BLOCK_GUARDS: Final = 5.0
#: Blocks a log is cut into where it is long enough.
MOST_BLOCKS: Final = 48
FEWEST_BLOCKS: Final = 6
#: Rows that a part needs.
_LEAST_ROWS: Final = 20
#: Logs from which on every fourth is held out, not the last alone.
_MANY_LOGS: Final = 8
#: The order in which blocks go to the parts: half to training, a quarter each to the others.
PATTERN: Final = (TRAIN, VALIDATION, TRAIN, TEST)
PATTERN_WITHOUT_TEST: Final = (TRAIN, VALIDATION, TRAIN)
#: Shortest stretch over which scatter is taken, in reaches of the filter to one side.
STRETCH: Final = 3.0
#: Rows of all logs together that estimation works on, and of one stretch of a longer log.
MOST_ROWS: Final = 60_000
_STRETCH_ROWS: Final = 1000


def split(
    logs: Sequence[Log], fitted: int, *, prove_last: float | None = None
) -> tuple[list[Log], float, str, str]:
    """Cut logs into training, validation and test.

    Args:
        logs: At one bandwidth.
        fitted: How many of them, the first ones, may be fitted; the others are for the test.
        prove_last: Share of every log, at its end, for the test instead.

    Returns:
        Logs with their parts and blocks, numbered over all; the guard between blocks [s]; how the
        parts were cut, and what the test cannot show, in words.

    Raises:
        LegwattError: Too little data for three parts.
    """
    lowpass = LowPass(logs[0].rate, logs[0].bandwidth)
    guard, warning, last = lowpass.noise_memory, "", 0.0
    if prove_last is not None and not 0.05 <= prove_last <= 0.8:
        raise LegwattError(f"share to test on is {prove_last:g}; expected 0.05 to 0.8")
    tested = set(range(fitted, len(logs)))
    pattern: tuple[int, ...] = PATTERN_WITHOUT_TEST
    if tested:
        rule = "tested on the held-out logs"
    elif prove_last is not None:
        rule, last = f"tested on the last {100 * prove_last:g} % of every log", prove_last
    elif fitted > 1:
        tested, rule = _held_out(logs)
    else:
        rule, pattern = "tested on every fourth block of the log", PATTERN
        warning = (
            "tested on parts of the same log: they show nothing about other motions; give a log "
            "of another motion, speed or load to test on"
        )
    out, count, dealt = [], 0, 0
    short = [() if k in tested else _short(one, guard) for k, one in enumerate(logs)]
    enough = sum(map(len, short)) >= len(pattern)
    for k, one in enumerate(logs):
        own = (TEST,) if k in tested else pattern
        # Short pieces are dealt out as they are, in the pattern's order over all logs.
        turns = dict(zip(short[k], count_from(dealt), strict=False)) if enough else {}
        dealt += len(turns)
        part, block = _cut(one, guard, own, 0.0 if k in tested else last, turns)
        block = _subdivided(block, max(2, int(np.ceil(STRETCH * lowpass.half))))
        out.append(replace(one, part=part, block=np.where(block >= 0, block + count, -1)))
        count += int(block.max(initial=-1)) + 1
    rows = [sum(int((one.part == k).sum()) for one in out) for k in range(len(NAMES))]
    if min(rows) < _LEAST_ROWS:
        duration = sum(float(one.time[-1] - one.time[0]) for one in logs)
        raise LegwattError(
            f"{logs[0].name}: {duration:.3g} s in {sum(len(o.pieces) for o in logs)} "
            f"pieces without a gap, at a cut-off of {logs[0].bandwidth:.3g} Hz with guards of "
            f"{guard:.2g} s between parts, leave {min(rows)} rows to "
            f"{NAMES[int(np.argmin(rows))]}; log longer, or raise the cut-off"
        )
    return out, guard, rule, warning


def _short(one: Log, guard: float) -> tuple[int, ...]:
    """Numbers of pieces of which guards between the fewest blocks would take much."""
    least = (1 + BLOCK_GUARDS) * FEWEST_BLOCKS * guard * one.rate
    return tuple(k for k, piece in enumerate(one.pieces) if piece.stop - piece.start < least)


def _held_out(logs: Sequence[Log]) -> tuple[set[int], str]:
    """Which of several logs are for the test: one condition, else the last log.

    Of many logs every fourth is. Of the condition that takes most values, the median one is
    left out: to predict between what was seen is fair, at the ends it is extrapolation.
    """
    conditions = [dict(one.recording.condition) if one.recording else {} for one in logs]
    shared = sorted(set.intersection(*map(set, conditions)))
    values = {key: {c[key] for c in conditions} for key in shared}
    key = max(values, key=lambda k: len(values[k]), default="")
    if key and len(values[key]) > 1:
        ordered = sorted(values[key], key=lambda v: (isinstance(v, str), v))
        left_out = ordered[len(ordered) // 2]
        chosen = {k for k, c in enumerate(conditions) if c[key] == left_out}
        return chosen, f"tested on the logs with {key} = {left_out}"
    if len(logs) >= _MANY_LOGS:
        return set(range(3, len(logs), len(PATTERN))), "tested on every fourth log"
    return {len(logs) - 1}, f"tested on the log {logs[-1].name}"


def _cut(
    one: Log, guard: float, pattern: Sequence[int], last: float, turns: Mapping[int, int]
) -> tuple[NDArray[np.int8], NDArray[np.intp]]:
    """Parts and blocks of one log, with a guard wherever neighbours belong to different parts.

    Pieces in `turns` go to one part each, by their place in the pattern, the last share of them to
    the test.
    """
    part = np.full(len(one), UNUSED, dtype=np.int8)
    block = np.full(len(one), -1, dtype=np.intp)
    margin = int(np.ceil(guard * one.rate))
    number = 0
    proving = [*turns][len(turns) - round(last * len(turns)) :]
    for k, piece in enumerate(one.pieces):
        size = piece.stop - piece.start
        fitted = size - round(last * size)
        if k in turns:
            spans = [(TEST if k in proving else pattern[turns[k] % len(pattern)], 0, size)]
        else:
            blocks = int(fitted / ((1 + BLOCK_GUARDS) * margin))
            blocks = min(MOST_BLOCKS, max(blocks, FEWEST_BLOCKS))
            edges = np.round(np.linspace(0, fitted, blocks + 1)).astype(int).tolist()
            ends = enumerate(pairwise(edges))
            spans = [(pattern[b % len(pattern)], start, stop) for b, (start, stop) in ends]
            spans += [(TEST, fitted, size)] if last else []
        for b, (kind, start, stop) in enumerate(spans):
            # Between two parts the guard is taken from the one that is not the test.
            if b > 0 and spans[b - 1][0] == TEST != kind:
                start += margin
            if b + 1 < len(spans) and spans[b + 1][0] != kind != TEST:
                stop -= margin
            if stop - start >= 3:
                rows = slice(piece.start + start, piece.start + stop)
                part[rows], block[rows] = kind, number
                number += 1
    return part, block


def _subdivided(block: NDArray[np.intp], length: int) -> NDArray[np.intp]:
    """Blocks cut into stretches of a few reaches of the filter: enough of them to see scatter."""
    out = np.full_like(block, -1)
    number = 0
    for b in np.unique(block[block >= 0]):
        rows = np.flatnonzero(block == b)
        count = max(1, rows.size // length)
        out[rows] = number + (np.arange(rows.size) * count) // rows.size
        number += count
    return out


def thinned(log: Log, rows: int) -> Log:
    """A log with at most so many rows: the stretches that tell most, spread over it.

    What a stretch tells is how much every joint moves and works in it: the variances of position,
    speed, acceleration and effort.
    """
    if len(log) <= rows:
        return log
    spans = cut(log.pieces, _STRETCH_ROWS)
    telling = most_telling(np.array([_variances(log, s) for s in spans]), rows // _STRETCH_ROWS)
    kept = [spans[k] for k in telling]
    ends = np.cumsum([0, *(s.stop - s.start for s in kept)]).tolist()
    pieces = tuple(slice(a, b) for a, b in pairwise(ends))
    out = log.at(np.concatenate([np.arange(s.start, s.stop) for s in kept]))
    assert log.filter is not None
    # What a prediction is filtered from ends with the stretch.
    inside = np.zeros((len(out), 1), dtype=np.bool_)
    for piece in pieces:
        inside[piece.start + log.filter.half : piece.stop - log.filter.half] = True
    assert out.known is not None
    return replace(
        out,
        pieces=pieces,
        filter=log.filter,
        mask=out.mask & inside,
        known=out.known & inside,
    )


def _variances(log: Log, span: slice) -> Array:
    """Of position, speed, acceleration and effort of every joint, (4 J,)."""
    good = log.mask[span].any(axis=1)
    if good.sum() < 10:
        return np.zeros(4 * len(log.joints))
    series = (log.q[span], log.v[span], log.a[span], log.effort[span, :, 0])
    return np.concatenate([x[good].var(axis=0) for x in series])
