"""A long Parquet log in overlapping chunks whose filtered output is that of the whole."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pipeline.gap.errors import LogContentError
from pipeline.gap.expected import Expected
from pipeline.gap.finding import Quality
from pipeline.gap.grid import STRETCH_ROWS, STRETCHES
from pipeline.gap.log import Log
from pipeline.gap.mapping import Mapping as MappingFile
from pipeline.gap.prepare import Prepared, Settings, choose_settings, prepare
from pipeline.gap.quality import judge
from pipeline.gap.read import sample_log, stream_log

Array = NDArray[np.float64]


#: Refusals that concern a log as a whole and not a chunk of it.
FINE_IN_A_CHUNK: Final = ("rows", "constant", "empty")


def join_logs(first: Log, second: Log) -> Log:
    """Rows of two pieces of one log, one after the other."""
    changes: dict[str, Any] = {}
    for name, value in vars(first).items():
        other = getattr(second, name)
        if isinstance(value, np.ndarray) and isinstance(other, np.ndarray):
            changes[name] = np.concatenate([value, other])
    changes["extra"] = {
        key: np.concatenate([value, second.extra[key]]) for key, value in first.extra.items()
    }
    return first.with_changes(**changes)


def survey(
    path: Path,
    expected: Expected,
    mapping: MappingFile | None = None,
    *,
    settings: Settings | None = None,
    largest: Mapping[str, Array] | None = None,
) -> tuple[Settings, tuple[Array, Array]]:
    """Grid, cut-off and noise of a long log from stretches spread over it.

    Returns:
        Settings (those given, if any) and the noise of effort and position, each shape (J,).

    Raises:
        GapError: The stretches are unusable, e.g. no joint moves in any of them.
    """
    seen: Log | None = None
    for piece in sample_log(path, expected, mapping, stretches=STRETCHES, rows=STRETCH_ROWS):
        # Small row groups may follow on each other; what lies between larger ones is a gap.
        seen = piece if seen is None else join_logs(seen, piece)
    if seen is None:
        raise LogContentError(f"{path.name}: a header and no rows; nothing was logged")
    quality = judge(seen, expected, largest=largest)
    quality.refuse()
    settings = settings or choose_settings([seen], [quality.usable])
    ready = prepare(seen, settings, usable=quality.usable)
    return settings, (ready.noise, ready.position_noise)


def stream_prepared(
    path: Path,
    expected: Expected,
    mapping: MappingFile | None = None,
    *,
    settings: Settings | None = None,
    rows: int = 200_000,
    largest: Mapping[str, Array] | None = None,
) -> Iterator[tuple[Quality, Prepared]]:
    """Prepare a Parquet log chunk by chunk.

    Every chunk carries the filter's reach of its neighbours at both ends; its `core` are the rows
    that count, and the cores together are the whole log, each row once. Grid, cut-off and noise
    floor come from `survey` and are the same for all chunks. Held values and saturation are judged
    within each chunk; that a joint rests, or a drive is off, throughout a chunk is no defect.

    Args:
        path: Parquet.
        expected: The robot's names and limits.
        mapping: For foreign columns.
        settings: Grid and cut-off; chosen by `survey` by default.
        rows: Per chunk; with 18 joints 200 000 rows take about 1.4 GB at the peak.
        largest: As for `judge`.

    Raises:
        GapError: As for `read_log`, `judge` and `prepare`.
    """
    chosen, noise = survey(path, expected, mapping, settings=settings, largest=largest)
    reach = 2 * chosen.lowpass.half + 2
    origin: float | None = None
    kept: Log | None = None  # rows not yet given out, with the reach before them
    before = 0  # rows at the start of `kept` that were given out already

    def chunk(log: Log, core: slice, origin: float) -> tuple[Quality, Prepared]:
        quality = judge(log, expected, largest=largest)
        quality.refuse(overlooked=FINE_IN_A_CHUNK)
        ready = prepare(log, chosen, usable=quality.usable, core=core, origin=origin, noise=noise)
        return quality, ready

    for piece in stream_log(path, expected, mapping, rows=rows):
        origin = float(piece.time[0]) if origin is None else origin
        log = piece if kept is None else join_logs(kept, piece)
        last = len(log) - reach
        if last <= before:
            kept = log
            continue
        yield chunk(log, slice(before, last), origin)
        start = max(0, last - reach)
        kept, before = log.rows(slice(start, None)), last - start
    if kept is not None and before < len(kept) and origin is not None:
        yield chunk(kept, slice(before, len(kept)), origin)
