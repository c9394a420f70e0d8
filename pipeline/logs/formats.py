"""Files of many tools as one table: a header of columns, and the numbers of some of them.

CSV and Parquet are read by pyarrow, MATLAB by SciPy and pymatreader, HDF5 by h5py, npz by NumPy;
the kind of a file is told by its first bytes.
"""

from __future__ import annotations

import hashlib
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
from pipeline.logs.csv_file import read_head, read_table

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


@dataclass
class Source:
    """A file of columns whose header is known."""

    path: Path  #: The file, or the folder of a bag.
    header: tuple[str, ...]  #: Column names, unique.
    read: Callable[[Sequence[str]], Any]  #: Some columns as a pyarrow table.
    units: Mapping[str, str] = field(default_factory=dict)  #: By column, of a row of units.
    remarks: tuple[str, ...] = ()  #: What a reader should know of how the data were made.
    at_once: bool = False  #: Whether columns are read together, as those of text are.

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
        for some in [names] if self.at_once else [[name] for name in names]:
            with _reported(self.where):
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
            table, remarks = _whole(path, kind, facts)
            source = Source(path, tuple(table.column_names), table.select, remarks=remarks)
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


def _csv(path: Path, head: bytes) -> Source:
    import pyarrow as pa

    packed = next((k for start, k in _PACKED.items() if head.startswith(start)), None)
    opened = partial(pa.input_stream, str(path), compression=packed)
    with opened() as stream:
        found = read_head(stream.read(_HEAD_BYTES), one_line(path.name))

    def read(columns: Sequence[str]) -> Any:
        table, cut = read_table(opened, found, columns, source.where)
        source.remarks = ("the last row was cut off while it was written: left out",) * cut
        return table

    source = Source(path, found.names, read, found.units, at_once=True)
    return source


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


@lru_cache(maxsize=1)
def _whole(path: Path, kind: str, facts: object) -> tuple[Any, tuple[str, ...]]:
    """A file of arrays, or a bag, as a pyarrow table, and remarks; by its `facts` once."""
    if kind == "feather":
        from pyarrow import feather

        return feather.read_table(path, memory_map=False), ()
    if kind == "bag":
        from pipeline.logs.bags import read_bag

        return read_bag(path)
    return _arrays(path, kind)


def _arrays(path: Path, kind: str) -> tuple[Any, tuple[str, ...]]:
    """Columns of a file of arrays as a pyarrow table, and a remark on what is none.

    A vector with a number per instant is a column; an array with one row, or one column, per
    instant gives a column for each of the others, called ``name[0]``, ``name[1]`` and so on.

    Args:
        path: The file.
        kind: ``"mat"``, ``"h5"`` or ``"npz"``.

    Raises:
        LegwattError: No arrays of one length.
    """
    import pyarrow as pa

    arrays = dict(_flat("", {"mat": _matlab, "h5": _hdf5, "npz": _numpy}[kind](path)))
    shapes = {name: f"{name} {array.shape}" for name, array in arrays.items() if array.ndim}
    numbers = {n: a for n, a in arrays.items() if a.dtype.kind in "fiubM" and a.ndim in (1, 2)}
    # The length of the time vector, else the one that most numbers share.
    sizes = Counter[int]()
    for name, array in numbers.items():
        is_time = array.ndim == 1 and name.rpartition("/")[2].lower() in TIMES
        sizes[max(array.shape)] += array.size + is_time * 10**12
    rows = sizes.most_common(1)[0][0] if sizes else 0
    columns: dict[str, NDArray[Any]] = {}
    for name, array in numbers.items():
        if rows in array.shape:
            block = array.reshape(rows, -1) if array.shape[0] == rows else array.T
            for k, column in enumerate(block.T):
                key = name if array.ndim == 1 else f"{name}[{k}]"
                columns[key] = np.ascontiguousarray(column)
            del shapes[name]
    left = ", ".join(shapes.values())
    if rows < 2 or not columns:
        raise LegwattError(
            f"{one_line(path.name)}: no arrays of one length that could be columns; it has "
            f"{left or 'none'}"
        )
    text = f"left out, not of {rows} rows or not of numbers: {left}"
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
            found[name] = item[()]

    with h5py.File(path, "r") as file:
        file.visititems(take)
    return found


def _numpy(path: Path) -> Mapping[str, Any]:
    with np.load(path, allow_pickle=False) as file:  # nothing is ever unpickled
        return {name: file[name] for name in file.files}


def _flat(above: str, value: object) -> Iterator[tuple[str, NDArray[Any]]]:
    """Arrays of nested tables, each by its path."""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _flat(f"{above}/{name}" if above else str(name), inner)
        return
    array = np.asarray(value)
    if array.dtype.names:  # rows of named fields
        yield from _flat(above, {name: array[name] for name in array.dtype.names})
    elif array.dtype != object:
        yield above, array.squeeze()
