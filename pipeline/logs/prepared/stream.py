"""A long log in overlapping chunks whose filtered output is that of the whole.

Naming works on those of its stretches that tell most, spread over the log. The log is cut into
stretches of equal length. Each is described by how much every joint moves and works in it (variance
of position, speed, change of speed and effort, over their means along the whole log) and by the
tenth of the log it lies in. Stretches are taken one after another; the next is the one that adds
most to the sum of the logarithms of what those taken so far tell, the D-criterion of optimal design
(Fedorov 1972) with a diagonal information matrix. A joint that moves in one minute of an hour is
thus seen, and an hour of the same gait is not seen twice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.logs.errors import Quality
from pipeline.logs.formats.convert import sha256
from pipeline.logs.log_format import Expected
from pipeline.logs.prepared.measurement import Contact
from pipeline.logs.prepared.prepare import Prepared, prepare
from pipeline.logs.quality.quality import judge
from pipeline.logs.reading.log import Log
from pipeline.logs.reading.mapping import Mapping as MappingFile
from pipeline.logs.reading.read import read_log, stream_log
from pipeline.logs.reading.table_file import TableFile, open_table, row_count

#: Rows of one stretch.
STRETCH: Final = 4096
#: Rows between two looked at: the speed of a robot changes little within them.
EVERY: Final = 8
#: Parts of the log that count as different times.
TIMES: Final = 10
#: What every description starts with, in means along the log.
START: Final = 0.02
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
        """All of it; a LegwattError as for `read_log`."""
        return self.adjust(read_log(self.path, self.expected, self.mapping))

    def pieces(self, rows: int = CHUNK_ROWS) -> Iterator[Log]:
        """Consecutive pieces of at most `rows` rows; a LegwattError as for `read_log`."""
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
        LegwattError: As for `read_log`.
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
        raise LegwattError(f"{stream.path.name}: no row can be compared")
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
        LegwattError: As for `read_log`, `judge` and `prepare`.
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


@dataclass(frozen=True, eq=False)
class Scan:
    """Stretches of a log and what they tell."""

    first: NDArray[np.intp]  #: First row of each stretch, shape (B,).
    #: Shape (B, D), at least zero; zero where nothing of a stretch can be compared.
    information: Array
    rows: int  #: Of the log.
    begin: float  #: Its first time [s].
    end: float  #: Its last time [s].


def scan(pieces: Iterable[Log]) -> Scan:
    """Describe the stretches of a log given piece by piece; stretches end with pieces."""
    first: list[int] = []
    variances: list[Array] = []
    middle: list[float] = []
    rows, begin, end = 0, np.inf, -np.inf
    for piece in pieces:
        for start in range(0, len(piece), STRETCH):
            part = slice(start, min(start + STRETCH, len(piece)))
            if part.stop - part.start < STRETCH // 2 and len(piece) > STRETCH:
                continue
            first.append(rows + start)
            variances.append(_information(piece, part))
            middle.append(float(piece.time[(part.start + part.stop) // 2]))
        rows += len(piece)
        begin, end = min(begin, float(piece.time[0])), max(end, float(piece.time[-1]))
    table = np.array(variances)
    table /= np.maximum(table.mean(axis=0), 1e-300)
    share = (np.array(middle) - begin) / max(end - begin, 1e-300)
    when = np.minimum((TIMES * share).astype(int), TIMES - 1)
    times = np.eye(TIMES)[when] * (table.sum(axis=1, keepdims=True) > 0)
    return Scan(np.array(first, dtype=np.intp), np.hstack([table, times]), rows, begin, end)


def _information(piece: Log, part: slice) -> Array:
    """Variances of position, speed, change of speed and effort of every joint, (4 J,)."""
    q, effort = piece.position[part][::EVERY], piece.effort.values[part][::EVERY]
    good = np.logical_and(*piece.rows(part).finite)[::EVERY].all(axis=1)
    if good.sum() < 10:
        return np.zeros(4 * q.shape[1])
    q, effort = q[good], effort[good]
    series = (q, np.diff(q, axis=0), np.diff(q, n=2, axis=0), effort)
    return np.concatenate([x.var(axis=0) for x in series])


def choose(found: Scan, count: int, among: NDArray[np.bool_] | None = None) -> NDArray[np.intp]:
    """Numbers of at most `count` stretches, among those marked (B,), that tell most together."""
    open_ = found.information.sum(axis=1) > 0
    if among is not None:
        open_ &= among
    known = np.full(found.information.shape[1], START)
    taken: list[int] = []
    for _ in range(min(count, int(open_.sum()))):
        gain = np.log1p(found.information / known).sum(axis=1)
        best = int(np.argmax(np.where(open_, gain, -np.inf)))
        open_[best] = False
        known = known + found.information[best]
        taken.append(best)
    return np.sort(np.array(taken, dtype=np.intp))
