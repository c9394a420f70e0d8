"""Files of many tools as one table: a header of columns, and the numbers of some of them.

The kind of a file is told by its name's end. Parquet and CSV are read column by column by pandas;
others are one table as a whole: arrays (MATLAB by pymatreader, HDF5 by h5py), and bags (MCAP,
SQLite, ROS 1 by rosbags), of which joint states become rows by stamp. Nothing is ever unpickled.
Separator and decimal sign of a CSV are told by the file itself: the separator is the one that gives
as many cells in the header as below it, and a comma inside a number is a decimal one.
"""

from __future__ import annotations

import csv
import gzip
import hashlib
import re
from array import array
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from itertools import compress
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError, one_line

BAGS: Final = (".mcap", ".db3", ".bag")
_ARRAYS: Final = (".mat", ".h5", ".hdf5")
_PARQUET: Final = (".parquet", ".pq")
#: Names of a time vector; with it the number of rows is known.
TIMES: Final = ("time_s", "time", "t", "timestamp", "timestamps", "stamp", "times", "__time")
#: Of the numbers of one log that are held at once [B]: of a longer one evenly spread stretches are.
MOST_BYTES: Final = 700_000_000
_STRETCH: Final = 100_000  # [rows]
_HEAD_BYTES: Final = 1 << 20
#: A space only where nothing else does: it may stand beside any other.
_SEPARATORS: Final = (";", "\t", "|", ",", r"\s+")
#: Lines that may stand above the header, and below it by which the decimal sign is told.
_LOOKED_AT: Final = 50

JOINTS: Final = "sensor_msgs/msg/JointState"
#: What ROS calls a quantity, and the end of its column in the log format.
_SUFFIXES: Final = {"position": "position_rad", "velocity": "velocity_rad_s", "effort": "torque_Nm"}
#: Of numbers at once [B]: read message by message and sorted by stamp they are held several times.
_MOST_OF_BAG: Final = MOST_BYTES // 3
#: Messages that are read, or left out, in a row where a bag does not fit in memory.
_MESSAGES: Final = 50_000
_Stamps = NDArray[np.int64]
#: Topic and joints of a message, and which quantities it tells: ROS allows to leave some out.
_Kind = tuple[str, tuple[str, ...], tuple[bool, ...]]


@dataclass(frozen=True)
class Source:
    """A file of columns whose header is known."""

    path: Path  #: The file, or the folder of a bag.
    header: tuple[str, ...]  #: Column names, unique.
    read: Callable[[Sequence[str]], Iterable[Any]]  #: Some columns, one pandas series each.
    remark: str = ""  #: What a reader should know of how the data were made.

    @property
    def where(self) -> str:
        """The file's name, for messages."""
        return one_line(self.path.name)

    def columns(self, names: Sequence[str], *, texts: bool = False) -> dict[str, Array]:
        """Numbers of some columns, each (N,); empty cells are NaN, true and false 1 and 0.

        Args:
            names: Of the columns.
            texts: Whether columns that hold something else are left out, not refused.

        Raises:
            LegwattError: A cell is no number, a row has too many, or there are none.
        """
        out: dict[str, Array] = {}
        with _reported(self.where):
            for name, column in zip(names, self.read(names), strict=True):
                with suppress(*[LegwattError] * texts):
                    out[name] = _numbers(column, name, self.where)
        if not all(x.size for x in out.values()):
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
            hashlib.file_digest(stream, lambda: whole)
    return whole.hexdigest()


def open_source(path: Path) -> Source:
    """Open a log and read its header.

    Raises:
        LegwattError: No such file, empty, damaged, no header, names that occur twice.
    """
    with _reported(one_line(path.name)):
        kind = "" if path.is_dir() else path.suffix.lower()
        if path.is_dir() or kind in (*BAGS, *_ARRAYS):
            table, remark = (_arrays(path), "") if kind in _ARRAYS else _read_bag(path)
            columns = partial(map, table.__getitem__)
            source = Source(path, tuple(table.columns), columns, remark)
        elif kind in _PARQUET:
            import pyarrow.parquet as pq

            names = tuple(map(str, pq.read_schema(path).names))
            source = Source(path, names, partial(_parquet, path))
        else:
            source = _csv(path)
    twice = [name for name, count in Counter(source.header).items() if count > 1]
    if twice:
        raise LegwattError(f"{source.where}: column '{one_line(twice[0])}' occurs twice")
    return source


@contextmanager
def _reported(where: str) -> Iterator[None]:
    """What a library meets, in one line: whatever bytes make it."""
    try:
        yield
    except LegwattError:
        raise
    except ImportError:
        what = "reading bags, MATLAB and HDF5 files needs the extra 'bags'"
        raise LegwattError(f"{where}: {what}: pip install -e '.[bags]'") from None
    except Exception as error:
        text = one_line(error) or type(error).__name__
        raise LegwattError(f"{where}: cannot be read: {text}") from None


def _numbers(column: Any, name: str, where: str) -> Array:
    """A column as numbers; dates and times (ISO 8601) as seconds since 1970."""
    if column.dtype.kind == "m":
        return np.asarray(column / pd.Timedelta(seconds=1))
    numbers = column if column.dtype.kind == "M" else pd.to_numeric(column, errors="coerce")
    wrong = np.flatnonzero(column.notna() & numbers.isna())
    if wrong.size or column.dtype.kind == "M":
        stamps = pd.to_datetime(column, utc=True, format="ISO8601", errors="coerce")
        if (stamps.isna() & column.notna()).any():
            raise LegwattError(
                f"{where}: row {wrong[0] + 2}, column '{one_line(name)}' holds "
                f"'{one_line(column.iloc[wrong[0]])}', expected a number, as 1.5"
            )
        numbers = (stamps - pd.Timestamp(0, tz="UTC")) / pd.Timedelta(seconds=1)
    return np.asarray(numbers, dtype=np.float64)


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
            yield pa.chunked_array(kept, type=file.schema_arrow.field(name).type).to_pandas()


def _csv(path: Path) -> Source:
    """A text of cells; lines above the header are passed over, and a ``#`` before it."""
    where, packed = one_line(path.name), path.suffix == ".gz"
    with (gzip.open if packed else open)(path, "rb") as stream:
        head = stream.read(_HEAD_BYTES)
        if cut := bool(head) and not packed:  # while the last row was written
            stream.seek(-1, 2)
            cut = stream.read() not in (b"\n", b"\r")
    if b"\x00" in head[:4096]:
        raise LegwattError(f"{where}: not UTF-8 text; save the log as CSV in UTF-8 or as Parquet")
    try:
        text, encoding = head[: head.rfind(b"\n") + 1 or None].decode("utf-8-sig"), "utf-8-sig"
    except UnicodeDecodeError:  # degree signs of older tools
        text, encoding = head.decode("latin-1"), "latin-1"
    lines = [line.removeprefix("#") for line in re.split(r"\r\n|\r|\n", text)]
    places = ((k, sep) for sep in _SEPARATORS for k in range(min(len(lines) - 1, _LOOKED_AT)))
    skip, separator = next((p for p in places if _is_header(*p, lines)), (-1, ","))
    if skip < 0:
        raise LegwattError(
            f"{where}: empty, or no header of column names with rows of as many cells below it"
        )
    below = [x for line in lines[skip + 1 :][:_LOOKED_AT] for x in _cells(line, separator)]
    names = [name.strip() for name in _cells(lines[skip], separator)]
    names = [name or f"column {k}" for k, name in enumerate(names, start=1)]
    comma = separator != "," and any(re.fullmatch(r"\s*[-+]?\d*,\d+\S*\s*", x) for x in below)

    def read(columns: Sequence[str]) -> Iterable[Any]:
        layout: dict[str, Any] = {
            "sep": separator,
            "decimal": "," if comma else ".",
            "names": names,
            "skiprows": skip + 1,
            "comment": "#",
            "skipinitialspace": True,
            "encoding": encoding,
        }
        with pd.read_csv(path, **layout, index_col=None, chunksize=_STRETCH) as blocks:
            table = pd.concat([block[[*columns]] for block in blocks], ignore_index=True)
        table = table.iloc[:-1] if cut and len(table) > 1 else table
        return [table[name] for name in columns]

    return Source(path, tuple(names), read)


def _cells(line: str, separator: str) -> list[str]:
    if separator == r"\s+":
        return line.split()
    return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])


def _is_header(k: int, separator: str, lines: Sequence[str]) -> bool:
    """Whether a line holds names, and the next one as many cells."""
    cells, below = (_cells(line, separator) for line in lines[k : k + 2])
    numbers = any(re.match(r"\s*[-+]?[.,]?\d", cell) for cell in cells)
    return len(cells) == len(below) > 1 and not numbers


def _arrays(path: Path) -> pd.DataFrame:
    """Columns of a file of arrays.

    A vector with a number per instant is a column; an array with one row, or one column, per
    instant gives a column for each of the others, called ``name[0]``, ``name[1]`` and so on.
    """
    if path.suffix.lower() == ".mat":
        from pymatreader import read_mat

        every = [*_flat("", read_mat(path))]
    else:
        import h5py

        with h5py.File(path) as file:
            every = [*_flat("", file)]
    numbers = {n: x for n, x in every if x.ndim in (1, 2) and x.dtype.kind in "fiubM"}
    # The length of the time vector, else the one that most numbers share.
    sizes = Counter[int]()
    for name, x in numbers.items():
        is_time = x.ndim == 1 and name.rpartition("/")[2].lower() in TIMES
        sizes[max(x.shape)] += x.size + is_time * 10**12
    rows = max(sizes, key=lambda n: sizes[n], default=0)
    columns: dict[str, NDArray[Any]] = {}
    for name, x in numbers.items():
        if rows in x.shape:
            block = x.reshape(rows, -1).T if x.shape[0] == rows else x
            names = [name] if x.ndim == 1 else [f"{name}[{k}]" for k in range(len(block))]
            columns |= zip(names, np.ascontiguousarray(block), strict=True)
    if rows < 2:
        found = ", ".join(f"{name} {x.shape}" for name, x in numbers.items()) or "none"
        raise LegwattError(
            f"{one_line(path.name)}: no arrays of one length that could be columns; it has {found}"
        )
    return pd.DataFrame(columns)


def _flat(above: str, value: object) -> Iterator[tuple[str, NDArray[Any]]]:
    """Arrays of nested tables, each by its path."""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _flat(f"{above}/{name}" if above else str(name), inner)
    elif (x := np.asarray(value)).dtype != object:
        yield above, x.squeeze()


def _read_bag(path: Path) -> tuple[pd.DataFrame, str]:
    """All joint states of a bag, or of a folder of bags, and a remark on their stamps.

    The rows are those of the column that most messages tell, of a topic called after states where
    there is one. What others send on stamps of their own is brought, by straight lines, to the rows
    that are nearest to these, and is empty in others.
    """
    sent = _messages(path)
    none = sum(sum(stamp <= 0 for stamp in stamps) for stamps, _, _ in sent.values())
    remark = (
        f"{none} messages have no stamp in their header: the times are those at which messages "
        "were recorded, late by what travelling takes, and unevenly so"
    )
    parts: dict[tuple[str, str], list[Any]] = defaultdict(list)
    for topic, joints, told in [*sent]:
        stamps, logged, values = sent.pop((topic, joints, told))
        when: _Stamps = np.array(logged if none else stamps, dtype=np.int64)
        names = [f"{j}__{suffix}" for suffix in compress(_SUFFIXES.values(), told) for j in joints]
        block = np.frombuffer(values, dtype=np.float64).reshape(when.size, -1)
        for name, numbers in zip(names, block.T, strict=True):
            parts[topic, name].append(pd.Series(numbers, when, copy=False))
    rows, out = pd.Index([]), dict[str, Array]()
    for topic, name in sorted(parts, key=lambda c: ("state" not in c[0], -sum(map(len, parts[c])))):
        own = pd.concat(parts.pop((topic, name))).sort_index(kind="stable")
        rows = rows if out else own.index
        if name in out:
            continue
        if own.index.isin(rows).all():
            out[name] = own[~own.index.duplicated()].reindex(rows).to_numpy()
        else:
            out[name] = _nearest(own.index.to_numpy(), own.to_numpy(), rows.to_numpy())
    table = pd.DataFrame({"time_s": 1e-9 * (rows - rows[0]).to_numpy(), **out}, copy=False)
    return table, remark * (none > 0)


def _messages(path: Path) -> dict[_Kind, tuple[array[int], array[int], array[float]]]:
    """Stamps of headers and of the recording [ns], and numbers, of messages of each kind.

    A reader per file, or one for a folder that says which files it holds; of what does not fit in
    memory evenly spread stretches.
    """
    from rosbags.rosbag1 import Reader as Reader1
    from rosbags.rosbag2 import Reader as Reader2
    from rosbags.typesys import Stores, get_typestore
    from tqdm import tqdm

    where = one_line(path.name)
    files = [path] if (path / "metadata.yaml").is_file() else bag_files(path)
    if not files:
        raise LegwattError(f"{where}: a folder without files of a bag ({', '.join(BAGS)})")
    readers: list[Any] = [Reader1(f) if f.suffix == ".bag" else Reader2(f) for f in files]
    sent: dict[_Kind, Any] = defaultdict(lambda: (array("q"), array("q"), array("d")))
    with ExitStack() as stack:
        every = [stack.enter_context(reader).connections for reader in readers]
        wanted = [[c for c in own if c.msgtype == JOINTS] for own in every]
        total, count, apart = sum(c.msgcount for own in wanted for c in own), 0, 0
        if not total:
            topics = ", ".join(sorted({f"{c.topic} ({c.msgtype})" for own in every for c in own}))
            raise LegwattError(
                f"{where}: no topic holds joint states ({JOINTS}); it has {topics or 'no topic'}"
            )
        bar = tqdm(total=total, desc=where, unit=" messages", leave=False, disable=None)
        for reader, own in zip(readers, wanted, strict=True):
            ros1 = isinstance(reader, Reader1)
            store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
            read: Any = store.deserialize_ros1 if ros1 else store.deserialize_cdr
            for connection, logged, raw in reader.messages(own) if own else ():
                bar.update()
                stretch, count = count // _MESSAGES, count + 1
                if apart > 1 and stretch % apart:
                    continue
                message = read(raw, JOINTS)
                numbers = [getattr(message, quantity) for quantity in _SUFFIXES]
                names, told = tuple(message.name), tuple(x.size > 0 for x in numbers)
                if {x.size for x in numbers} - {0, len(names)}:
                    sizes = ", ".join(str(x.size) for x in numbers)
                    raise LegwattError(
                        f"{where}: a message of {JOINTS} holds {sizes} numbers for {len(names)} "
                        f"names ({one_line(', '.join(names))})"
                    )
                apart = apart or int(np.ceil(8 * total * len(names) * sum(told) / _MOST_OF_BAG))
                stamps, times, values = sent[connection.topic, names, told]
                stamps.append(message.header.stamp.sec * 10**9 + message.header.stamp.nanosec)
                times.append(logged)
                values.frombytes(np.concatenate(numbers).tobytes())
        bar.close()
    return sent


def _nearest(own: _Stamps, values: Array, times: _Stamps) -> Array:
    """A sender's numbers (N,) in the rows that are nearest to its own, by straight lines."""
    first, out = times[0], np.full(times.size, np.nan)
    after = np.clip(np.searchsorted(times, own), 1, max(times.size - 1, 1))
    near = after - (own - times[after - 1] < times[after] - own)
    # Stamps of today are too large for a float to tell 100 ns.
    out[near] = np.interp(times[near] - first, own - first, values, left=np.nan, right=np.nan)
    return out
