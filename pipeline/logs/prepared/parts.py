"""Three parts of the data: *training* estimates, *validation* selects, *test* judges.

Whole logs are held out where there are several, since cycles of one gait resemble each other;
within a log, blocks of rows alternate, with a guard between them longer than what the filter sees
to both sides, so that no part contains a trace of another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.logs.errors import PreparationError
from pipeline.logs.prepared.cycles import period
from pipeline.logs.prepared.measurement import TEST, TRAIN, UNUSED, VALIDATION
from pipeline.logs.prepared.prepare import Prepared

NAMES: Final = ("training", "validation", "test")
#: Guard between blocks per reach of the filter to one side: more than both sides together.
GUARD: Final = 2.2
#: Blocks are at least this many guards long, so that little is lost between them.
BLOCK_GUARDS: Final = 5.0
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
        PreparationError: Too little data for three parts.
    """
    every = [*prepared, *holdout]
    guard = GUARD * max(one.memory for one in every)
    if prove_last is not None and not 0.05 <= prove_last <= 0.8:
        raise PreparationError(f"share to test on is {prove_last:g}; expected 0.05 to 0.8")
    tested = set(range(len(prepared), len(every)))
    warning, last = "", 0.0
    pattern: tuple[int, ...] = PATTERN_WITHOUT_TEST
    if holdout:
        rule = "tested on the held-out logs"
    elif prove_last is not None:
        rule, last = f"tested on the last {100 * prove_last:g} % of every log", prove_last
    elif len(prepared) > 1:
        tested, rule = _held_out(prepared)
    else:
        rule, pattern = "tested on every fourth block of the log", PATTERN
        warning = _periodic_warning(prepared)
    part, block, count = [], [], 0
    for k, one in enumerate(every):
        kinds, numbers = _cut(one, guard, *(((TEST,), 0.0) if k in tested else (pattern, last)))
        block.append(np.where(numbers >= 0, numbers + count, -1).astype(np.int32))
        count += int(numbers.max(initial=-1)) + 1
        part.append(kinds)
    for number, name in enumerate(NAMES):
        rows = sum(int((kind == number).sum()) for kind in part)
        if rows < 20:
            duration = sum(float(one.time[-1] - one.time[0]) for one in every)
            raise PreparationError(
                f"{every[0].log.name}: {duration:.3g} s in {sum(len(o.pieces) for o in every)} "
                f"pieces without a gap, at a cut-off of {every[0].cutoff:.3g} Hz with guards of "
                f"{guard:.2g} s between parts, leave {rows} rows to {name}; log longer, or raise "
                "the cut-off"
            )
    return Parts(tuple(part), tuple(block), guard, rule, warning)


def _held_out(prepared: Sequence[Prepared]) -> tuple[set[int], str]:
    """Which of several logs are for the test: one condition, else the last log.

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
    if not key:
        last = len(prepared) - 1
        return {last}, f"tested on the log {prepared[last].log.name}"
    # With two values the larger one; with more the one in the middle.
    left_out = values[len(values) // 2]
    chosen = {k for k, c in enumerate(conditions) if c[key] == left_out}
    return chosen, f"tested on the logs with {key} = {left_out}"


def _periodic_warning(prepared: Sequence[Prepared]) -> str:
    cycle = period(prepared[0])
    if cycle is None:
        return ""
    return (
        f"the log repeats one motion every {cycle:.3g} s: held-out cycles of it show nothing "
        "about other motions; give a log of another motion, speed or load with --holdout"
    )


def _cut(
    one: Prepared, guard: float, pattern: Sequence[int], prove_last: float
) -> tuple[NDArray[np.int8], NDArray[np.int32]]:
    """Blocks of one log, with a guard wherever neighbours belong to different parts."""
    part = np.full(len(one), UNUSED, dtype=np.int8)
    block = np.full(len(one), -1, dtype=np.int32)
    margin = int(np.ceil(guard / one.settings.dt))
    number = 0
    for piece in one.pieces:
        size = piece.stop - piece.start
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
