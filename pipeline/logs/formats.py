"""Files of many tools as one table: a header of columns, and the numbers of some of them.

CSV and Parquet are read by pyarrow, arrays of MATLAB, HDF5 and NumPy by SciPy, pymatreader, h5py
and NumPy, bags by rosbags. The kind is told by a file's first bytes. Nothing is ever unpickled.
"""

from __future__ import annotations

import gzip
import hashlib
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError, one_line
from pipeline.logs.csv_head import read_head
from pipeline.logs.mapping import CsvTable

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
}
_PACKED: Final = {b"\x1f\x8b": "gz", b"\x28\xb5\x2f\xfd": "zst"}
BAGS: Final = (".mcap", ".db3", ".bag")
NEEDS: Final = (
    "reading bags, MATLAB 7.3 and HDF5 files needs the extra 'bags': pip install -e '.[bags]'"
)
#: Names of a time vector; with it the number of rows is known.
TIMES: Final = ("time_s", "time", "t", "timestamp", "timestamps", "stamp", "times", "__time")
#: Of the numbers of one log that are held at once [B]: of a longer one evenly spread stretches are.
MOST_BYTES: Final = 700_000_000
_STRETCH: Final = 100_000  # [rows]
_HEAD_BYTES: Final = 1 << 20
_DECIMAL_COMMA: Final = re.compile(r"^\s*[-+]?\d+,\d+([eE][-+]?\d+)?\s*$")


@dataclass(frozen=True)
class Source:
    """A file of columns whose header is known."""

    path: Path  #: The file, or the folder of a bag.
    header: tuple[str, ...]  #: Column names, unique.
    read: Callable[[Sequence[str]], Any]  #: Some columns as a pyarrow table.
    dialect: CsvTable = field(default_factory=CsvTable)  #: Of a CSV file.
    units: Mapping[str, str] = field(default_factory=dict)  #: By column, of a row of units.
    remarks: tuple[str, ...] = ()  #: What a reader should know of how the data were made.

    is_csv: bool = False  #: Whether it is text, whose dialect may be another.

    @property
    def where(self) -> str:
        """The file's name, for messages."""
        return one_line(self.path.name)

    def columns(self, names: Sequence[str]) -> dict[str, Array]:
        """Numbers of some columns, each (N,); empty cells are NaN, true and false 1 and 0.

        Raises:
            LegwattError: A cell is no number, rows are ragged, or there are none.
        """
        out: dict[str, Array] = {}
        for some in [names] if self.is_csv else [[name] for name in names]:
            with _reported(self.where, header=self.header):
                table = self.read(some)
            if table.num_rows == 0:
                raise LegwattError(f"{self.where}: a header and no rows; nothing was logged")
            out |= {name: _numbers(table.column(name), name, self.where) for name in some}
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


def open_source(path: Path, dialect: CsvTable | None = None) -> Source:
    """Open a log and read its header.

    Raises:
        LegwattError: No such file, empty, damaged, no header, names that occur twice.
    """
    where, dialect = one_line(path.name), dialect or CsvTable()
    try:
        head = b"" if path.is_dir() else _first_bytes(path)
    except OSError as error:
        raise LegwattError(
            f"{one_line(path)}: cannot be read ({error.strerror or 'no such file'}); give a log "
            "as CSV, Parquet or bag"
        ) from None
    kind = next((k for start, k in _BEGINNINGS.items() if head.startswith(start)), "csv")
    kind = "bag" if path.is_dir() else "mat" if path.suffix == ".mat" else kind  # MATLAB 4: no mark
    with _reported(where):
        if kind == "parquet":
            import pyarrow.parquet as pq

            names = tuple(map(str, pq.read_schema(path).names))
            source = Source(path, names, partial(_parquet, path))
        elif kind == "csv":
            source = _csv(path, dialect, head)
        else:
            facts = tuple((f.stat().st_size, f.stat().st_mtime_ns) for f in bag_files(path))
            table, remarks = _whole(path, kind, facts)
            source = Source(path, tuple(table.column_names), table.select, remarks=remarks)
    for k, name in enumerate(source.header):
        if name in source.header[:k]:
            raise LegwattError(f"{where}: column '{one_line(name)}' occurs twice; rename one")
        if not name:
            raise LegwattError(f"{where}: column {k + 1} has no name; give it one in line 1")
    return source


def _first_bytes(path: Path) -> bytes:
    with path.open("rb") as stream:
        return stream.read(16)


@contextmanager
def _reported(where: str, header: Sequence[str] = ()) -> Iterator[None]:
    """What a library meets, in one line: whatever bytes make it."""
    try:
        yield
    except LegwattError:
        raise
    except ImportError:
        raise LegwattError(f"{where}: {NEEDS}") from None
    except Exception as error:
        raise LegwattError(f"{where}{_reason(error, header)}") from None


def _reason(error: Exception, header: Sequence[str]) -> str:
    text = one_line(error) or type(error).__name__
    row = re.search(r"Row #(\d+)", text)
    if ragged := re.search(r"Expected (\d+) columns, got (\d+)", text):
        want, got = int(ragged[1]), int(ragged[2])
        hint = "a row is cut off or has a cell too many"
        if got == 2 * want or (got == 2 * want - 1 and want > 2):
            hint = "decimal commas? export the log with decimal dots"
        place = f"row {row[1]}" if row else "a row"
        return f": {place} has {got} cells, the header {want}; {hint}"
    if cell := re.search(r"column #(\d+): .*invalid value '(.*)'", text):
        name = header[int(cell[1])] if int(cell[1]) < len(header) else f"#{cell[1]}"
        hint = "expected a number"
        if _DECIMAL_COMMA.match(cell[2]):
            hint = "a decimal comma; export the log with decimal dots"
        place = f"row {row[1]}, " if row else ""
        return f": {place}column '{one_line(name)}' holds '{cell[2][:40]}', {hint}"
    return f": cannot be read: {text}"


def _parquet(path: Path, columns: Sequence[str]) -> Any:
    """Some columns; of a file that does not fit in memory evenly spread stretches."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    # Without a memory map or pre-buffering, one row group at a time is in memory.
    with pq.ParquetFile(path, memory_map=False, pre_buffer=False) as file:
        rows = file.metadata.num_rows
        every = int(np.ceil(8 * rows * len(file.schema_arrow.names) / MOST_BYTES))
        batches = file.iter_batches(batch_size=_STRETCH, columns=list(columns))
        kept = [batch for k, batch in enumerate(batches) if k % every == 0]
        return pa.Table.from_batches(kept, schema=None if kept else pa.schema([]))


def _csv(path: Path, dialect: CsvTable, head: bytes) -> Source:
    packed = next((k for start, k in _PACKED.items() if head.startswith(start)), "")
    opened: Any = path.open
    if packed == "gz":
        opened = partial(gzip.open, path)
    elif packed == "zst":
        from backports import zstd

        opened = partial(zstd.open, path)
    with opened("rb") as stream:
        head = stream.read(_HEAD_BYTES)
    if not head.strip():
        raise LegwattError(
            f"{one_line(path.name)}: the file is empty; give a log as CSV or Parquet"
        )
    names, skip, units, stamps = read_head(head, dialect, one_line(path.name))

    def read(columns: Sequence[str]) -> Any:
        try:
            return table(columns, threads=True, remarks=False)
        except Exception:  # only a single thread counts rows, so that the message can say where
            with opened("rb") as stream:
                remarks = any(line.startswith(b"#") for line in stream)
            return table(columns, threads=False, remarks=remarks)

    def table(columns: Sequence[str], *, threads: bool, remarks: bool) -> Any:
        import pyarrow as pa
        import pyarrow.csv as pc

        kinds = {n: pa.string() if n.endswith("__contact") else pa.float64() for n in columns}
        for name, first in stamps.items():
            zone = re.search(r"(Z|[+-]\d\d:?\d\d)$", first[10:])
            kinds[name] = pa.timestamp("ns", "UTC" if zone else None)
        with opened("rb") as stream:
            return pc.read_csv(
                stream,
                read_options=pc.ReadOptions(
                    column_names=list(names), skip_rows=skip, use_threads=threads
                ),
                parse_options=pc.ParseOptions(
                    delimiter=dialect.delimiter,
                    invalid_row_handler=_without_remarks if remarks else None,
                ),
                convert_options=pc.ConvertOptions(
                    include_columns=list(columns),
                    column_types=kinds,
                    decimal_point=dialect.decimal,
                    strings_can_be_null=True,
                ),
            )

    return Source(path, names, read, dialect, units, is_csv=True)


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
            column = pc.if_else(pc.equal(lower, "false"), "0", lower)
        elif pa.types.is_timestamp(kind):
            # Seconds since 1970 of the clock they name.
            whole = pc.cast(pc.cast(column, pa.timestamp("ns")), pa.int64())
            column = pc.multiply(pc.cast(whole, pa.float64(), safe=False), 1e-9)
        elif not any(
            test(kind)
            for test in (pa.types.is_null, pa.types.is_boolean, pa.types.is_integer)
            + (pa.types.is_floating,)
        ):
            raise LegwattError(
                f"{where}: column '{one_line(name)}' holds {one_line(kind)}; expected numbers"
            )
        return np.asarray(pc.cast(column, pa.float64(), safe=False).to_numpy())
    except pa.ArrowException as error:
        raise LegwattError(
            f"{where}: column '{one_line(name)}': {one_line(error)}; expected numbers"
        ) from None


@lru_cache(maxsize=1)
def _whole(path: Path, kind: str, facts: object) -> tuple[Any, tuple[str, ...]]:
    """A file of arrays, or a bag, as a pyarrow table, and remarks; by its `facts` once."""
    if kind == "bag":
        from pipeline.logs.bags import read_bag

        return read_bag(path)
    return _arrays(path, kind)


def _arrays(path: Path, kind: str) -> tuple[Any, tuple[str, ...]]:
    """Columns of a file of arrays.

    An array with one row, or one column, per instant gives a column for each of the others, called
    ``name[0]``, ``name[1]`` and so on, or by the names of a list of texts of that length.
    """
    import pyarrow as pa

    arrays = dict(_flat("", {"mat": _matlab, "h5": _hdf5, "npz": _numpy}[kind](path)))
    rows = _rows(arrays)
    texts = [a.tolist() for a in arrays.values() if a.dtype.kind in "UTO" and a.ndim == 1]
    columns: dict[str, NDArray[Any]] = {}
    left = []
    for name, array in arrays.items():
        if array.ndim == 0 or array.dtype.kind in "UTO":
            continue
        if not _numeric(array) or rows not in array.shape:
            left.append(f"{name} {array.shape}")
        elif array.ndim == 1:
            columns[name] = array
        else:
            block = array if array.shape[0] == rows else array.T
            named = [names for names in texts if len(names) == block.shape[1]]
            inner = named[0] if len(named) == 1 else range(block.shape[1])
            for which, column in zip(inner, block.T, strict=True):
                columns[f"{name}[{which}]"] = np.ascontiguousarray(column)
    if rows < 2 or not columns:
        seen = ", ".join(f"{name} {a.shape}" for name, a in arrays.items())
        raise LegwattError(
            f"{one_line(path.name)}: no arrays of one length that could be columns; it has "
            f"{seen or 'none'}"
        )
    text = f"left out, not of {rows} rows or not of numbers: {', '.join(left)}"
    return pa.table(columns), (text,) if left else ()


def _matlab(path: Path) -> Mapping[str, Any]:
    from scipy.io import loadmat

    try:
        found = loadmat(path, simplify_cells=True)
    except NotImplementedError:  # 7.3, which is HDF5
        from pymatreader import read_mat

        found = read_mat(path)
    return {name: value for name, value in found.items() if not name.startswith("__")}


def _hdf5(path: Path) -> Mapping[str, Any]:
    import h5py

    found: dict[str, Any] = {}

    def take(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset):
            found[name] = item.asstr()[()] if h5py.check_string_dtype(item.dtype) else item[()]

    with h5py.File(path, "r") as file:
        file.visititems(take)
    return found


def _numpy(path: Path) -> Mapping[str, Any]:
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def _flat(above: str, value: object) -> Iterator[tuple[str, NDArray[Any]]]:
    """Arrays of nested tables, each by its path."""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _flat(f"{above}/{name}" if above else str(name), inner)
        return
    array = np.asarray(value)
    if array.dtype.names:  # rows of named fields
        for name in array.dtype.names:
            yield f"{above}/{name}" if above else name, array[name].squeeze()
    elif array.dtype != object or all(isinstance(x, str) for x in array.flat):
        yield above, array.squeeze()


def _numeric(array: NDArray[Any]) -> bool:
    return array.dtype.kind in "fiubM" and array.ndim in (1, 2)


def _rows(arrays: Mapping[str, NDArray[Any]]) -> int:
    """Length of the time vector, else the length that most numbers share."""
    for path, array in sorted(arrays.items(), key=lambda item: len(item[0])):
        last = path.rpartition("/")[2].lower()
        if last in TIMES and array.ndim == 1 and array.size > 1 and _numeric(array):
            return array.size
    seen = Counter[int]()
    for array in arrays.values():
        if _numeric(array):
            seen[max(array.shape)] += array.size
    return seen.most_common(1)[0][0] if seen else 0
