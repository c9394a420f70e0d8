"""Three parts of the data: *training* estimates, *validation* selects, *test* judges.

Whole logs are held out where there are several, since cycles of one gait resemble each other;
within a log, blocks of rows alternate, with a guard between them as long as filtered noise
remembers. Pieces between gaps, or whole logs, that are too short for that are dealt out as they
are: the filter never runs across a gap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.logs.filters import LowPass
from pipeline.logs.log import TEST, TRAIN, UNUSED, VALIDATION, Log

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
#: Parts of a log that count as different times, and what every description starts with.
_TIMES: Final = 10
_START: Final = 0.02


class Parts(NamedTuple):
    """Logs in parts."""

    logs: tuple[Log, ...]  #: With their parts and blocks, numbered over all logs.
    guard: float  #: Between blocks [s].
    rule: str  #: How the parts were cut, in words.
    warning: str  #: What the test cannot show, or empty.


def split(logs: Sequence[Log], fitted: int, *, prove_last: float | None = None) -> Parts:
    """Cut logs into training, validation and test.

    Args:
        logs: At one bandwidth.
        fitted: How many of them, the first ones, may be fitted; the others are for the test.
        prove_last: Share of every log, at its end, for the test instead.

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
    out, count = [], 0
    short = sum(len(_short(one, guard)) for k, one in enumerate(logs) if k not in tested)
    dealt = 0  # pieces that were dealt out as they are, in the pattern's order
    for k, one in enumerate(logs):
        own: tuple[Sequence[int], float] = ((TEST,), 0.0) if k in tested else (pattern, last)
        whole = _short(one, guard) if k not in tested and short >= len(pattern) else ()
        part, block = _cut(one, guard, *own, whole, dealt)
        dealt += len(whole)
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
    return Parts(tuple(out), guard, rule, warning)


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
    best: tuple[str, list[float | str]] = ("", [""])
    for key in sorted(set.intersection(*(set(c) for c in conditions))):
        values = sorted({c[key] for c in conditions}, key=lambda v: (isinstance(v, str), v))
        if len(values) > len(best[1]):
            best = key, values
    key, values = best
    if not key and len(logs) >= _MANY_LOGS:
        return set(range(3, len(logs), len(PATTERN))), "tested on every fourth log"
    if not key:
        return {len(logs) - 1}, f"tested on the log {logs[-1].name}"
    # With two values the larger one; with more the one in the middle.
    left_out = values[len(values) // 2]
    chosen = {k for k, c in enumerate(conditions) if c[key] == left_out}
    return chosen, f"tested on the logs with {key} = {left_out}"


def _cut(
    one: Log,
    guard: float,
    pattern: Sequence[int],
    prove_last: float,
    whole: Sequence[int],
    dealt: int,
) -> tuple[NDArray[np.int8], NDArray[np.intp]]:
    """Parts and blocks of one log, with a guard wherever neighbours belong to different parts.

    Pieces whose numbers are in `whole` go to one part each, the first to the pattern's place
    `dealt`, the last share of them to the test.
    """
    part = np.full(len(one), UNUSED, dtype=np.int8)
    block = np.full(len(one), -1, dtype=np.intp)
    margin = int(np.ceil(guard * one.rate))
    number = 0
    proves = len(whole) - round(prove_last * len(whole))
    for k, piece in enumerate(one.pieces):
        size = piece.stop - piece.start
        fitted = size - round(prove_last * size)
        if k in whole:
            turn = whole.index(k)
            spans = [(pattern[(dealt + turn) % len(pattern)] if turn < proves else TEST, 0, size)]
        else:
            edges = np.round(np.linspace(0, fitted, _block_count(fitted, margin) + 1)).astype(int)
            spans = [
                (pattern[b % len(pattern)], int(edges[b]), int(edges[b + 1]))
                for b in range(edges.size - 1)
            ]
            spans += [(TEST, fitted, size)] if prove_last else []
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


def _block_count(rows: int, margin: int) -> int:
    return min(MOST_BLOCKS, max(int(rows / ((1 + BLOCK_GUARDS) * margin)), FEWEST_BLOCKS))


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


def most_telling(log: Log, rows: int) -> Log:
    """A log with at most so many rows: the stretches that tell most, spread over it.

    Each stretch is described by how much every joint moves and works in it (variance of position,
    speed, acceleration and effort, over their means along the log) and by the tenth of the log it
    lies in. They are taken one after another; the next is the one that adds most to the sum of the
    logarithms of what those taken so far tell, the D-criterion of optimal design (Fedorov 1972)
    with a diagonal information matrix. A joint that moves in one minute of an hour is thus seen,
    and an hour of the same gait is not seen twice.
    """
    if len(log) <= rows:
        return log
    spans = [
        slice(start, min(start + _STRETCH_ROWS, piece.stop))
        for piece in log.pieces
        for start in range(piece.start, piece.stop, _STRETCH_ROWS)
    ]
    tells = np.array([_information(log, span) for span in spans])
    tells /= np.maximum(tells.mean(axis=0), 1e-300)
    share = (log.time[[s.start for s in spans]] - log.time[0]) / (log.time[-1] - log.time[0])
    times = np.eye(_TIMES)[np.minimum((_TIMES * share).astype(int), _TIMES - 1)]
    tells = np.hstack([tells, times * (tells.sum(axis=1, keepdims=True) > 0)])
    known, left, taken = np.full(tells.shape[1], _START), tells.sum(axis=1) > 0, list[int]()
    while left.any() and (len(taken) + 1) * _STRETCH_ROWS <= rows:
        gain: Array = np.log1p(tells / known).sum(axis=1)
        best = int(np.argmax(np.where(left, gain, -np.inf)))
        left[best] = False
        known = known + tells[best]
        taken.append(best)
    kept = [spans[k] for k in sorted(taken)]
    ends = np.cumsum([0, *(s.stop - s.start for s in kept)]).tolist()
    pieces = tuple(slice(a, b) for a, b in pairwise(ends))
    out = log.at(np.concatenate([np.arange(s.start, s.stop) for s in kept]))
    lowpass = LowPass(log.rate, log.bandwidth)
    # What a prediction is filtered from ends with the stretch.
    inside = np.zeros((len(out), 1), dtype=np.bool_)
    for piece in pieces:
        inside[piece.start + lowpass.half : piece.stop - lowpass.half] = True
    assert out.known is not None
    return replace(
        out,
        pieces=pieces,
        kernel=log.kernel,
        lowpass=lambda x: lowpass.smooth(x, pieces),
        mask=out.mask & inside,
        known=out.known & inside,
    )


def _information(log: Log, span: slice) -> Array:
    """Variances of position, speed, acceleration and effort of every joint, (4 J,)."""
    good = log.mask[span].any(axis=1)
    if good.sum() < 10:
        return np.zeros(4 * len(log.joints))
    series = (log.q[span], log.v[span], log.a[span], log.effort[span, :, 0])
    return np.concatenate([x[good].var(axis=0) for x in series])
