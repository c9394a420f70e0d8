"""A long log in overlapping chunks whose filtered output is that of the whole."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.logs.errors import LogContentError
from pipeline.logs.formats.convert import sha256
from pipeline.logs.prepared.contact import Contact
from pipeline.logs.prepared.informative import STRETCH, Scan, choose, scan
from pipeline.logs.prepared.prepare import Prepared, prepare
from pipeline.logs.quality.finding import Quality
from pipeline.logs.quality.quality import judge
from pipeline.logs.reading.expected import Expected
from pipeline.logs.reading.log import Log
from pipeline.logs.reading.mapping import Mapping as MappingFile
from pipeline.logs.reading.read import read_log, stream_log
from pipeline.logs.reading.table_file import TableFile, open_table, row_count

#: Refusals that concern a log as a whole and not a chunk of it.
FINE_IN_A_CHUNK: Final = ("rows", "constant", "empty")
#: Rows that are surveyed, and that naming works on, per log.
SURVEYED: Final = 6 * STRETCH
#: Rows of a chunk: with 18 joints, voltages and foot forces about a quarter of a gigabyte.
CHUNK_ROWS: Final = 50_000


@dataclass(frozen=True)
class Stream:
    """A log that is read piece by piece, as often as needed; a CSV is read once and kept."""

    path: Path  #: CSV or Parquet.
    expected: Expected  #: The robot's names and limits.
    mapping: MappingFile | None = None  #: For foreign columns.
    adjust: Callable[[Log], Log] = lambda log: log  #: What is changed in every piece after reading.

    @cached_property
    def _table(self) -> TableFile:
        return open_table(self.path, self.mapping.csv if self.mapping else None)

    @cached_property
    def rows(self) -> int:
        """Rows of the log."""
        return row_count(self._table)

    @cached_property
    def whole(self) -> Log:
        """All of it; a GapError as for `read_log`."""
        return self.adjust(read_log(self.path, self.expected, self.mapping))

    def pieces(self, rows: int = CHUNK_ROWS) -> Iterator[Log]:
        """Consecutive pieces of at most `rows` rows; a GapError as for `read_log`."""
        if self._table.parquet:
            read = stream_log(self.path, self.expected, self.mapping, rows=rows, digest=self.digest)
            for piece in read:
                yield self.adjust(piece)
            return
        for start in range(0, len(self.whole), rows):
            yield self.whole.rows(slice(start, start + rows))

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the file."""
        return sha256(self.path)


@dataclass(frozen=True, eq=False)
class Survey:
    """What stands for a long log where not every row is needed."""

    log: Log  #: The stretches that tell most; what lies between them is a gap.
    found: Scan  #: All stretches.
    proves_from: float  #: Time from which rows are for the test only [s]; infinite where none are.


def survey(stream: Stream, *, prove_last: float | None = None) -> Survey:
    """Read the stretches of a long log that tell most.

    Of a share at its end that is for the test only, a quarter of the stretches is taken.

    Raises:
        GapError: As for `read_log`.
    """
    found = scan(stream.pieces())
    count = SURVEYED // STRETCH
    proves_from = np.inf
    if prove_last is None:
        taken = choose(found, count)
    else:
        first = round((1.0 - prove_last) * found.rows)
        late = found.first >= first
        early = found.first + 2 * STRETCH <= first
        taken = np.union1d(
            choose(found, count - count // 4, early), choose(found, count // 4, late)
        )
    wanted = found.first[taken]
    parts: list[Log] = []
    at = 0
    for piece in stream.pieces():
        for start in wanted[(wanted >= at) & (wanted < at + len(piece))] - at:
            parts.append(piece.rows(slice(int(start), int(start) + STRETCH)))
        if prove_last is not None and at <= first < at + len(piece):
            proves_from = float(piece.time[first - at])
        at += len(piece)
    if not parts:
        raise LogContentError(f"{stream.path.name}: no row can be compared")
    return Survey(join_logs(*parts), found, proves_from)


def join_logs(*parts: Log) -> Log:
    """Rows of pieces of one log, one after the other."""
    first = parts[0]
    arrays = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name, value in vars(first).items()
        if isinstance(value, np.ndarray)
    }
    extra = {key: np.concatenate([part.extra[key] for part in parts]) for key in first.extra}
    return first.with_changes(extra=extra, **arrays)


def prepared_chunks(
    stream: Stream,
    known: Prepared,
    *,
    rows: int = CHUNK_ROWS,
    largest: Mapping[str, Array] | None = None,
    contact: Callable[[Log], Contact | None] | None = None,
) -> Iterator[tuple[Quality, Prepared]]:
    """Prepare a long log chunk by chunk.

    Every chunk carries the filter's reach of its neighbours at both ends; its `core` are the rows
    that count, and the cores together are the whole log, each row once. Held values and saturation
    are judged within each chunk; that a joint rests, or a drive is off, throughout a chunk is no
    defect. Grid, cut-off, noises and fusion are those of `known`, the log's survey.

    Args:
        stream: The log.
        known: Its survey.
        rows: Per chunk.
        largest: As for `judge`.
        contact: How to tell which feet stand; by the log's own forces or columns by default.

    Raises:
        GapError: As for `read_log`, `judge` and `prepare`.
    """
    settings = known.settings
    reach = 2 * settings.lowpass.half + 2
    for log, core, origin in _overlapping(stream.pieces(rows), reach):
        quality = judge(log, stream.expected, largest=largest, whole=False)
        quality.refuse(overlooked=FINE_IN_A_CHUNK)
        stands = contact(log) if contact else None
        ready = prepare(
            log,
            settings,
            usable=quality.usable,
            contact=stands,
            core=core,
            origin=origin,
            known=known,
        )
        yield quality, ready


def _overlapping(pieces: Iterator[Log], reach: int) -> Iterator[tuple[Log, slice, float]]:
    """Chunks that share `reach` rows with their neighbours, rows that count, the first time."""
    kept: Log | None = None  # rows not yet given out, with the reach before them
    before, origin = 0, 0.0  # rows at the start of `kept` that were given out already
    for piece in pieces:
        origin = float(piece.time[0]) if kept is None else origin
        log = piece if kept is None else join_logs(kept, piece)
        last = len(log) - reach
        if last <= before:
            kept = log
            continue
        yield log, slice(before, last), origin
        start = max(0, last - reach)
        kept, before = log.rows(slice(start, None)), last - start
    if kept is not None and before < len(kept):
        yield kept, slice(before, len(kept)), origin
