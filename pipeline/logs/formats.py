"""Files of many tools as one table: a header of columns, and the numbers of some of them.

The kind of a file is told by its first bytes. Parquet and CSV are read by pyarrow column by column;
other files are tables as a whole (`whole_files`). Separator and decimal sign of CSV are told by the
file itself: the separator is the one that gives as many cells in the rows as in the header, and a
comma inside a number is a decimal one.
"""

from __future__ import annotations

import csv
import hashlib
import io
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from actuators.arrays import Array
from actuators.errors import LegwattError, one_line
from actuators.units import spelt

#: What files begin with.
_BEGINNINGS: Final = {
    b"\x89MCAP0\r\n": "bag",
    b"SQLite format 3\x00": "bag",
    b"#ROSBAG V2.0": "bag",
    b"MATLAB 5.0 MAT": "mat",
    b"MATLAB 7.3 MAT": "mat",
    b"\x89HDF\r\n\x1a\n": "h5",
    b"PK\x03\x04": "npz",
    b"PAR1": "parquet",
    b"ARROW1": "feather",
}
_PACKED: Final = {b"\x1f\x8b": "gzip", b"\x28\xb5\x2f\xfd": "zstd"}
BAGS: Final = (".mcap", ".db3", ".bag")
#: Names of a time vector; with it the number of rows is known.
TIMES: Final = ("time_s", "time", "t", "timestamp", "timestamps", "stamp", "times", "__time")
_NEEDS: Final = (
    "reading bags, MATLAB 7.3 and HDF5 files needs the extra 'bags': pip install -e '.[bags]'"
)
#: Of the numbers of one log that are held at once [B]: of a longer one evenly spread stretches are.
MOST_BYTES: Final = 700_000_000
_STRETCH: Final = 100_000  # [rows]
_HEAD_BYTES: Final = 1 << 20
#: A space only where nothing else does: it may stand beside any other.
_SEPARATORS: Final = (",", ";", "\t", "|", " ")
#: Rows below the header by which the separator is told, and lines that may stand above it.
_LOOKED_AT, _PREAMBLE = 20, 50
#: Share of those rows that have as many cells as the header.
_ALIKE: Final = 0.4
_ISO: Final = re.compile(
    r"\s*\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d(\.\d{1,9})?)?\s*(Z|[+-]\d\d:?\d\d)?\s*"
)
_DECIMAL_COMMA: Final = re.compile(r"\s*[-+]?\d*,\d+([eE][-+]?\d+)?\s*")
#: Units as people write them beside `actuators.units`, which knows ``Nm`` and ``°/s``.
_SPELT: Final = {
    **{"nm": "N*m", "mnm": "mN*m", "ncm": "N*cm", "c": "degC", "celsius": "degC"},
    **{"radians": "rad", "rad/sec": "rad/s", "degrees": "deg", "deg/sec": "deg/s", "dps": "deg/s"},
    **{"sec": "s", "seconds": "s", "milliseconds": "ms", "amps": "A", "volts": "V", "-": "1"},
}


@dataclass
class Source:
    """A file of columns whose header is known."""

    path: Path  #: The file, or the folder of a bag.
    header: tuple[str, ...]  #: Column names, unique.
    read: Callable[
        [Sequence[str]], Iterable[Any]
    ]  #: Some columns, one pyarrow array after another.
    units: Mapping[str, str] = field(default_factory=dict)  #: By column, of a row of units.
    remarks: tuple[str, ...] = ()  #: What a reader should know of how the data were made.

    @property
    def where(self) -> str:
        """The file's name, for messages."""
        return one_line(self.path.name)

    def columns(self, names: Sequence[str]) -> dict[str, Array]:
        """Numbers of some columns, each (N,); empty cells are NaN, true and false 1 and 0.

        Raises:
            LegwattError: A cell is no number, rows are ragged, or there are none.
        """
        with _reported(self.where):
            columns = zip(names, self.read(names), strict=True)
            out = {name: _numbers(column, name, self.where) for name, column in columns}
        if names and out[names[0]].size == 0:
            raise LegwattError(f"{self.where}: a header and no rows; nothing was logged")
        return out


def is_log(path: Path) -> bool:
    """Whether this may be a log: a file, or a folder of a bag's files."""
    return path.exists() and bool(bag_files(path))


def bag_files(path: Path) -> list[Path]:
    """The files of a log, in order; none for a folder that holds no bag."""
    if not path.is_dir():
        return [path]
    return sorted(p for p in path.iterdir() if {*p.suffixes} & {*BAGS})


def sha256(path: Path) -> str:
    """SHA-256 in hexadecimal of a file's bytes, or of those of a bag's files in order."""
    whole = hashlib.sha256()
    for file in bag_files(path):
        with file.open("rb") as stream:
            while block := stream.read(1 << 22):
                whole.update(block)
    return whole.hexdigest()


def open_source(path: Path) -> Source:
    """Open a log and read its header.

    Raises:
        LegwattError: No such file, empty, damaged, no header, names that occur twice.
    """
    where, head = one_line(path.name), b""
    if not path.is_dir():
        with _reported(one_line(path)), path.open("rb") as stream:
            head = stream.read(16)
    kind = next((k for start, k in _BEGINNINGS.items() if head.startswith(start)), "csv")
    kind = "bag" if path.is_dir() else "mat" if path.suffix == ".mat" else kind  # MATLAB 4: no mark
    with _reported(where):
        if kind == "parquet":
            import pyarrow.parquet as pq

            names = tuple(map(str, pq.read_schema(path).names))
            source = Source(path, names, partial(_parquet, path))
        elif kind == "csv":
            source = _csv(path, head)
        else:
            facts = tuple((f.stat().st_size, f.stat().st_mtime_ns) for f in bag_files(path))
            from pipeline.logs.whole_files import whole_file

            table, remarks = whole_file(path, kind, facts)
            columns = partial(map, table.column)
            source = Source(path, tuple(table.column_names), columns, remarks=remarks)
    twice = [name for name, count in Counter(source.header).items() if count > 1]
    if twice:
        raise LegwattError(f"{where}: column '{one_line(twice[0])}' occurs twice; rename one")
    return source


@contextmanager
def _reported(where: str) -> Iterator[None]:
    """What a library meets, in one line: whatever bytes make it."""
    try:
        yield
    except LegwattError:
        raise
    except ImportError:
        raise LegwattError(f"{where}: {_NEEDS}") from None
    except Exception as error:
        text = one_line(error) or type(error).__name__
        raise LegwattError(f"{where}: cannot be read: {text}") from None


def _numbers(column: Any, name: str, where: str) -> Array:
    """A pyarrow column as numbers; times as seconds since 1970 of the clock they name."""
    import pyarrow as pa
    import pyarrow.compute as pc

    kind = column.type
    try:
        if pa.types.is_string(kind) or pa.types.is_large_string(kind):
            lower = pc.utf8_lower(pc.utf8_trim_whitespace(column))
            lower = pc.if_else(pc.equal(lower, "true"), "1", lower)
            column = pc.if_else(pc.equal(lower, "false"), "0", lower)
        elif pa.types.is_timestamp(kind) or pa.types.is_duration(kind):
            exact = pa.timestamp("ns") if pa.types.is_timestamp(kind) else pa.duration("ns")
            whole = pc.cast(pc.cast(column, exact), pa.int64())
            column = pc.multiply(pc.cast(whole, pa.float64(), safe=False), 1e-9)
        return np.asarray(pc.cast(column, pa.float64(), safe=False).to_numpy())
    except pa.ArrowException as error:
        raise LegwattError(
            f"{where}: column '{one_line(name)}' holds {one_line(kind)}; expected numbers "
            f"({one_line(error)})"
        ) from None


def _parquet(path: Path, columns: Sequence[str]) -> Iterator[Any]:
    """Some columns; of a file that does not fit in memory evenly spread stretches."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    # Without a memory map or pre-buffering, one row group at a time is in memory.
    with pq.ParquetFile(path, memory_map=False, pre_buffer=False) as file:
        names = file.schema_arrow.names
        every = int(np.ceil(8 * file.metadata.num_rows * len(names) / MOST_BYTES))
        for name in columns:
            batches = enumerate(file.iter_batches(batch_size=_STRETCH, columns=[name]))
            kept = [batch.column(0) for k, batch in batches if k % every == 0]
            yield pa.chunked_array(kept, type=file.schema_arrow.field(name).type)


def _csv(path: Path, head: bytes) -> Source:
    import pyarrow as pa

    packed = next((k for start, k in _PACKED.items() if head.startswith(start)), None)
    opened = partial(pa.input_stream, str(path), compression=packed)
    with opened() as stream:
        found = read_head(stream.read(_HEAD_BYTES), one_line(path.name))

    def read(columns: Sequence[str]) -> Iterable[Any]:
        with opened() as stream:
            table, cut = read_table(stream, found, columns, source.where)
        source.remarks = ("the last row was cut off while it was written: left out",) * cut
        return [table.column(name) for name in columns]

    source = Source(path, found.names, read, found.units)
    return source


@dataclass(frozen=True)
class CsvHead:
    """What stands above a file's numbers, and how they are written."""

    names: tuple[str, ...]  #: Of the columns, as written.
    skip: int  #: Lines above the first row of numbers.
    units: dict[str, str]  #: By column, where a row of units states them.
    stamps: dict[str, str]  #: Columns of dates and times, with the first of them.
    separator: str
    decimal: str


def read_head(head: bytes, where: str) -> CsvHead:
    """Understand a file's first bytes.

    Lines that begin with ``#`` are remarks, unless the last of them is the header of what follows.

    Raises:
        LegwattError: No text in UTF-8 or Latin-1, no header of names.
    """
    if not head.strip():
        raise LegwattError(f"{where}: the file is empty; give a log as CSV or Parquet")
    if head[:2] in (b"\xff\xfe", b"\xfe\xff") or b"\x00" in head[:4096]:
        raise LegwattError(f"{where}: not UTF-8 text; save the log as CSV in UTF-8 or as Parquet")
    lines = [_decoded(x) for x in re.split(rb"\r\n|\r|\n", head.removeprefix(b"\xef\xbb\xbf"))]
    whole = lines[:-1] or lines  # the last may be cut off
    told = [k for k, x in enumerate(whole) if x.strip() and not x.startswith(("#", "sep="))] or [0]
    # What stands above the header has other cells than what stands below.
    share, first, separator = 0.0, told[0], ","
    for k in range(min(len(told), _PREAMBLE)):
        body = [lines[n] for n in told[k : k + _LOOKED_AT + 1]]
        best = max(_SEPARATORS, key=lambda s: (_fits(body, s)[0], s != " ", _fits(body, s)[1]))
        fits = _fits(body, best)[0]
        if k == 0 or fits > max(share, _ALIKE):
            share, first, separator = fits, told[k], best
        if share > _ALIKE:
            break
    inside = (cell for n in told[: _LOOKED_AT + 1] for cell in _cells(lines[n], separator))
    comma = separator != "," and any(map(_DECIMAL_COMMA.fullmatch, inside))
    decimal = "," if comma else "."
    names, following = _cells(lines[first], separator), first + 1
    if names and all(_is_value(name, decimal) for name in names):
        header = _cells(lines[first - 1].lstrip("# ") if first else "", separator)
        if len(header) != len(names) or all(_is_value(name, decimal) for name in header):
            raise LegwattError(
                f"{where}: line {first + 1} holds numbers; expected a header of column names"
            )
        names, following = header, first
    names = [name.strip().removeprefix("#").strip() for name in names]
    names = [name or f"column {k}" for k, name in enumerate(names, start=1)]
    skip, units = following, dict[str, str]()
    row = _row(lines, skip, separator, len(names))
    if row and not any(_is_value(cell, decimal) for cell in row) and any(map(unit_spelt, row)):
        units = {n: u for n, cell in zip(names, row, strict=True) if (u := unit_spelt(cell))}
        skip += 1
        row = _row(lines, skip, separator, len(names))
    stamps = {n: c.strip() for n, c in zip(names, row, strict=False) if _ISO.fullmatch(c)}
    return CsvHead(tuple(names), skip, units, stamps, separator, decimal)


def read_table(stream: Any, head: CsvHead, columns: Sequence[str], where: str) -> tuple[Any, bool]:
    """Some columns as a pyarrow table, and whether the last row was cut off and left out.

    Args:
        stream: The file's bytes, unpacked.
        head: What stands above its numbers.
        columns: That are wanted.
        where: The file's name, for messages.

    Raises:
        LegwattError: A cell is no number, or a row has another length than the header.
    """
    import pyarrow as pa
    import pyarrow.csv as pc

    kinds = {n: pa.string() if n.endswith("__contact") else pa.float64() for n in columns}
    for name, first in head.stamps.items():
        zone = re.search(r"(Z|[+-]\d\d:?\d\d)$", first[10:])
        kinds[name] = pa.timestamp("ns", "UTC" if zone else None)
    if head.separator == " ":  # as many as make columns stand below one another
        rows = [b" ".join(line.split()) for line in stream.read().split(b"\n")]
        stream = io.BytesIO(b"\n".join(rows))
    odd, remarks = list[Any](), list[Any]()  # rows of another length

    def passed_over(row: Any) -> str:
        (remarks if row.text.startswith("#") else odd).append(row)
        return "skip"

    try:
        table = pc.read_csv(
            stream,
            # A single thread counts rows, so that messages can say where; any byte can be read, so
            # that an odd row is told whatever is in it.
            read_options=pc.ReadOptions(
                column_names=list(head.names),
                skip_rows=head.skip,
                use_threads=False,
                encoding="latin1",
            ),
            parse_options=pc.ParseOptions(
                delimiter=head.separator, invalid_row_handler=passed_over
            ),
            convert_options=pc.ConvertOptions(
                include_columns=list(columns),
                column_types=kinds,
                decimal_point=head.decimal,
                strings_can_be_null=True,
            ),
        )
    except pa.ArrowInvalid as error:
        raise LegwattError(f"{where}: {_reason(error, head)}") from None
    # The end of a file that nobody closed is none of its numbers.
    last = head.skip + table.num_rows + len(remarks) + 1
    cut = [row for row in odd[:1] if row.number >= last > head.skip + 1]
    for row in odd if not cut or cut[0].actual_columns > len(head.names) else ():
        raise LegwattError(
            f"{where}: row {row.number} has {row.actual_columns} cells, the header "
            f"{row.expected_columns}; mend or drop it"
        )
    return table, bool(cut)


def _reason(error: Exception, head: CsvHead) -> str:
    """Row, column and cell of what is no number."""
    text = one_line(error)
    found = re.search(r"Row #(\d+)", text)
    row = f"row {found[1]}" if found else "a row"
    if cell := re.search(r"column #(\d+): .*invalid value '(.*)'", text):
        name = one_line(head.names[int(cell[1])])
        return f"{row}, column '{name}' holds '{cell[2][:40]}', expected a number, as 1.5"
    return f"cannot be read: {text}"


def _decoded(line: bytes) -> str:
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError:  # degree signs of older tools
        return line.decode("latin-1")


def _fits(body: Sequence[str], separator: str) -> tuple[float, int]:
    """Share of rows with as many cells as the header, and how many those are."""
    header, *rows = (len(_cells(line, separator)) for line in body)
    return (sum(n == header for n in rows) / max(len(rows), 1) if header > 1 else 0.0), header


def _row(lines: Sequence[str], number: int, separator: str, cells: int) -> list[str]:
    """Cells of one line; none where it is missing, cut off or of another length."""
    row = _cells(lines[number], separator) if number + 1 < len(lines) else []
    return row if len(row) == cells else []


def _cells(line: str, separator: str) -> list[str]:
    if separator == " ":
        return line.split()
    with suppress(csv.Error):
        return next(csv.reader([line], delimiter=separator), [])
    return []


def _is_value(text: str, decimal: str) -> bool:
    """Whether a cell holds a number or a time, not a name."""
    try:
        float(text.replace(decimal, "."))
    except ValueError:
        return bool(_ISO.fullmatch(text))
    return True


def unit_spelt(text: str) -> str:
    """The unit that a text means, as `actuators.units` writes it; empty where it is none."""
    plain = text.strip().strip("[]()").strip()
    for name in (plain, _SPELT.get(plain.lower(), ""), plain.replace("_", "/")):
        try:
            return spelt(name)
        except LegwattError:
            continue
    return ""
