"""A long Parquet log in overlapping chunks whose filtered output is that of the whole."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.gap.expected import Expected
from pipeline.gap.finding import Quality
from pipeline.gap.log import Log
from pipeline.gap.mapping import Mapping as MappingFile
from pipeline.gap.prepare import Prepared, Settings, choose_settings, prepare
from pipeline.gap.quality import judge
from pipeline.gap.read import stream_log

Array = NDArray[np.float64]


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
    floor come from the first chunk, so that all chunks share them. Held values and saturation are
    judged within each chunk.

    Args:
        path: Parquet.
        expected: The robot's names and limits.
        mapping: For foreign columns.
        settings: Grid and cut-off; chosen from the first chunk by default.
        rows: Per chunk; with 18 joints 200 000 rows take about 0.7 GB.
        largest: As for `judge`.

    Raises:
        GapError: As for `read_log`, `judge` and `prepare`.
    """
    noise: tuple[Array, Array] | None = None
    origin: float | None = None
    kept: Log | None = None  # rows not yet given out, with the reach before them
    before = 0  # rows at the start of `kept` that were given out already
    overlap = 0

    def chunk(log: Log, core: slice) -> tuple[Quality, Prepared]:
        nonlocal settings, noise, origin
        quality = judge(log, expected, largest=largest)
        quality.refuse()
        settings = settings or choose_settings([log], [quality.usable])
        origin = log.time[0] if origin is None else origin
        ready = prepare(log, settings, usable=quality.usable, core=core, origin=origin, noise=noise)
        noise = noise or (ready.noise, ready.position_noise)
        return quality, ready

    for piece in stream_log(path, expected, mapping, rows=rows):
        if settings is None:
            quality = judge(piece, expected, largest=largest)
            quality.refuse()
            settings = choose_settings([piece], [quality.usable])
        overlap = 2 * settings.lowpass.half + 2
        log = piece if kept is None else join_logs(kept, piece)
        last = len(log) - overlap
        if last <= before:
            kept = log
            continue
        yield chunk(log, slice(before, last))
        start = max(0, last - overlap)
        kept, before = log.rows(slice(start, None)), last - start
    if kept is not None and before < len(kept):
        yield chunk(kept, slice(before, len(kept)))
