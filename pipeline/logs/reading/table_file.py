"""Numbers by column from CSV and Parquet files, with one clear line for whatever is wrong."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from actuators.arrays import Array
from actuators.errors import LegwattError, one_line
from pipeline.logs.formats.convert import plain
from pipeline.logs.reading.csv_head import CsvHead, read_head
from pipeline.logs.reading.mapping import CsvTable

_HEADER_BYTES: Final = 1 << 20
_DECIMAL_COMMA: Final = re.compile(r"^\s*[-+]?\d+,\d+([eE][-+]?\d+)?\s*$")


@dataclass(frozen=True)
class TableFile:
    """A file of columns whose header has been read."""

    path: Path  #: The file, or the folder of a bag.
    #: What is read: the file, or what was made of it where it is neither CSV nor Parquet.
    data: Path
    parquet: bool  #: Whether its data are Parquet; else CSV.
    dialect: CsvTable  #: Of a CSV file.
    header: tuple[str, ...]  #: Column names, unique.
    skip: int = 1  #: Lines above the first row of numbers.
    units: Mapping[str, str] = field(default_factory=dict)  #: By column, of a row of units.
    #: Columns of dates and times to the first of them, as written.
    stamps: Mapping[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()  #: What a reader should know of how the data were made.

    @property
    def where(self) -> str:
        """The file's name, for messages."""
        return one_line(self.path.name)


def open_table(path: Path, dialect: CsvTable | None = None) -> TableFile:
    """Open a file of columns and read its header; its kind is told by its first bytes.

    Raises:
        LegwattError: No such file, empty, wrong bytes, no header, names that occur twice.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    where, dialect = one_line(path.name), dialect or CsvTable()
    try:
        made = plain(path)
        with made.path.open("rb") as stream:
            head = stream.read(_HEADER_BYTES)
    except OSError as error:
        raise LegwattError(
            f"{one_line(path)}: cannot be read ({error.strerror or 'no such file'}); give a log "
            "as CSV, Parquet or bag"
        ) from None
    if not head.strip():
        raise LegwattError(f"{where}: the file is empty; give a log as CSV or Parquet")
    parquet = head.startswith(b"PAR1")
    head_of_csv: CsvHead
    if parquet:
        try:
            head_of_csv = ((*map(str, pq.read_schema(made.path).names),), 1, {}, {})
        except (pa.ArrowException, OSError, ValueError) as error:
            reason = f"not a readable Parquet file ({one_line(error)})"
            raise LegwattError(f"{where}: {reason}") from None
    else:
        head_of_csv = read_head(head, dialect, where)
    names = head_of_csv[0]
    for k, name in enumerate(names, start=1):
        if name in names[: k - 1]:
            raise LegwattError(f"{where}: column '{one_line(name)}' occurs twice; rename one")
        if not name:
            raise LegwattError(f"{where}: column {k} has no name; give it one in line 1")
    return TableFile(path, made.path, parquet, dialect, *head_of_csv, made.remarks)


def read_columns(table: TableFile, columns: Sequence[str]) -> dict[str, Array]:
    """Read some columns of the header whole.

    Returns:
        Name to numbers, shape (N,); empty cells are NaN, true and false 1 and 0.

    Raises:
        LegwattError: A cell is no number, rows are ragged, bytes are not UTF-8.
    """
    import pyarrow.parquet as pq

    with _reported(table):
        if table.parquet:
            data = pq.read_table(table.data, columns=list(columns))
        else:
            try:
                data = _read_csv(table, columns, threads=True)
            except _troubles():
                # Only a single thread counts rows, so that the message can say where.
                data = _read_csv(table, columns, threads=False, remarks=_remarked(table.data))
    if data.num_rows == 0:
        raise LegwattError(f"{table.where}: a header and no rows; nothing was logged")
    return {name: _numbers(data.column(name), name, table.where) for name in columns}


def stream_columns(
    table: TableFile, columns: Sequence[str], rows: int
) -> Iterator[dict[str, Array]]:
    """Read some columns of a Parquet file in consecutive batches of at most `rows` rows.

    Raises:
        LegwattError: The file is not Parquet or breaks off.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    if not table.parquet:
        raise LegwattError(f"{table.where}: streaming needs Parquet; convert the CSV first")
    # Without a memory map or pre-buffering, one row group at a time is in memory.
    with (
        _reported(table),
        pq.ParquetFile(table.data, memory_map=False, pre_buffer=False) as file,
    ):
        for batch in file.iter_batches(batch_size=rows, columns=list(columns)):
            whole = pa.table(batch)
            yield {name: _numbers(whole.column(name), name, table.where) for name in columns}


def row_count(table: TableFile) -> int:
    """Rows of a Parquet file from its footer, of a CSV file from its line ends.

    Raises:
        LegwattError: The footer cannot be read.
    """
    import pyarrow.parquet as pq

    if table.parquet:
        with _reported(table):
            return int(pq.read_metadata(table.data).num_rows)
    with table.data.open("rb") as stream:
        blocks = iter(lambda: stream.read(1 << 22), b"")
        return max(0, sum(block.count(b"\n") for block in blocks) - table.skip)


def _troubles() -> tuple[type[Exception], ...]:
    import pyarrow as pa

    return (pa.ArrowException, OSError, ValueError, OverflowError)


@contextmanager
def _reported(table: TableFile) -> Iterator[None]:
    """What the reader meets, in one line."""
    try:
        yield
    except _troubles() as error:
        raise LegwattError(_reason(error, table)) from None


def _read_csv(
    table: TableFile, columns: Sequence[str], *, threads: bool, remarks: bool = False
) -> Any:
    import pyarrow as pa
    import pyarrow.csv as pc

    kinds = {n: pa.string() if n.endswith("__contact") else pa.float64() for n in columns}
    for name, first in table.stamps.items():
        zone = re.search(r"(Z|[+-]\d\d:?\d\d)$", first[10:])
        kinds[name] = pa.timestamp("ns", "UTC" if zone else None)
    return pc.read_csv(
        table.data,
        read_options=pc.ReadOptions(
            column_names=list(table.header), skip_rows=table.skip, use_threads=threads
        ),
        parse_options=pc.ParseOptions(
            delimiter=table.dialect.delimiter,
            invalid_row_handler=_without_remarks if remarks else None,
        ),
        convert_options=pc.ConvertOptions(
            include_columns=list(columns),
            column_types=kinds,
            decimal_point=table.dialect.decimal,
            strings_can_be_null=True,
        ),
    )


def _remarked(path: Path) -> bool:
    """Whether a line below the first begins with a remark's sign."""
    with path.open("rb") as stream:
        return any(line.startswith(b"#") for line in stream)


def _without_remarks(row: Any) -> str:
    return "skip" if row.text.startswith("#") else "error"


def _numbers(column: Any, name: str, where: str) -> Array:
    import pyarrow as pa
    import pyarrow.compute as pc

    kind = column.type
    try:
        if pa.types.is_string(kind) or pa.types.is_large_string(kind):
            lower = pc.utf8_lower(pc.utf8_trim_whitespace(column))
            lower = pc.if_else(pc.equal(lower, "true"), "1", lower)
            lower = pc.if_else(pc.equal(lower, "false"), "0", lower)
            column = pc.cast(lower, pa.float64())
        elif pa.types.is_timestamp(kind):
            # Seconds since 1970 of the clock they name; empty cells are NaN.
            whole = pc.cast(pc.cast(column, pa.timestamp("ns")), pa.int64())
            seconds = np.array(pc.fill_null(whole, 0).to_numpy(), dtype=np.int64) * 1e-9
            return np.where(np.asarray(pc.is_null(whole).to_numpy()), np.nan, seconds)
        elif not (pa.types.is_null(kind) or pa.types.is_boolean(kind)) and not (
            pa.types.is_integer(kind) or pa.types.is_floating(kind)
        ):
            raise LegwattError(
                f"{where}: column '{one_line(name)}' holds {one_line(kind)}; expected numbers"
            )
        numbers = pc.cast(column, pa.float64(), safe=False).to_numpy()
        return np.array(numbers, dtype=np.float64)
    except pa.ArrowException as error:
        raise LegwattError(
            f"{where}: column '{one_line(name)}': {one_line(error)}; expected numbers"
        ) from None


def _reason(error: Exception, table: TableFile) -> str:
    """Say in one line what the reader met."""
    text, where = one_line(error), table.where
    row = re.search(r"Row #(\d+)", text)
    if ragged := re.search(r"Expected (\d+) columns, got (\d+)", text):
        want, got = int(ragged[1]), int(ragged[2])
        hint = "a row is cut off or has a cell too many"
        if got == 2 * want or (got == 2 * want - 1 and want > 2):
            hint = "decimal commas? export the log with decimal dots"
        place = f"row {row[1]}" if row else "a row"
        return f"{where}: {place} has {got} cells, the header {want}; {hint}"
    if cell := re.search(r"column #(\d+): .*invalid value '(.*)'", text):
        number = int(cell[1])
        name = table.header[number] if number < len(table.header) else f"#{number}"
        hint = "expected a number"
        if _DECIMAL_COMMA.match(cell[2]):
            hint = "a decimal comma; export the log with decimal dots"
        place = f"row {row[1]}, " if row else ""
        return f"{where}: {place}column '{one_line(name)}' holds '{cell[2][:40]}', {hint}"
    return f"{where}: cannot be read: {text}"
