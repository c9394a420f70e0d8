"""Files of many tools as one table: a header of columns, and the numbers of some of them.

The kind of a file is told by its first bytes. Parquet and CSV are read by pyarrow column by column;
others are one table as a whole: arrays (MATLAB by SciPy and pymatreader, HDF5 by h5py, npz), and
bags (MCAP, SQLite, ROS 1 by rosbags), of which joint states become rows by stamp. Nothing is ever
unpickled. Separator and decimal sign of CSV are told by the file itself: the separator is the one
that gives as many cells in the rows as in the header, and a comma inside a number is a decimal one.
"""

from __future__ import annotations

import csv
import hashlib
import io
import re
from array import array
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from functools import lru_cache, partial
from itertools import compress
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError, one_line
from actuators.parameters import spelt

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
#: Units as people write them beside `actuators.parameters`, which knows ``Nm`` and ``°/s``.
_SPELT: Final = {
    **{"nm": "N*m", "mnm": "mN*m", "ncm": "N*cm", "c": "degC", "celsius": "degC"},
    **{"radians": "rad", "rad/sec": "rad/s", "degrees": "deg", "deg/sec": "deg/s", "dps": "deg/s"},
    **{"sec": "s", "seconds": "s", "milliseconds": "ms", "amps": "A", "volts": "V", "-": "1"},
}


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


@dataclass
class Source:
    """A file of columns whose header is known."""

    path: Path  #: The file, or the folder of a bag.
    header: tuple[str, ...]  #: Column names, unique.
    #: Some columns, one pyarrow array after another.
    read: Callable[[Sequence[str]], Iterable[Any]]
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
            hashlib.file_digest(stream, lambda: whole)
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
            table, remarks = _whole_file(path, kind, facts)
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
        found = _read_head(stream.read(_HEAD_BYTES), one_line(path.name))

    def read(columns: Sequence[str]) -> Iterable[Any]:
        with opened() as stream:
            table, cut = _read_table(stream, found, columns, source.where)
        source.remarks = ("the last row was cut off while it was written: left out",) * cut
        return map(table.column, columns)

    source = Source(path, found.names, read, found.units)
    return source


class _CsvHead(NamedTuple):
    """What stands above a file's numbers, and how they are written."""

    names: tuple[str, ...]  #: Of the columns, as written.
    skip: int  #: Lines above the first row of numbers.
    units: dict[str, str]  #: By column, where a row of units states them.
    stamps: dict[str, str]  #: Columns of dates and times, with the first of them.
    separator: str
    decimal: str


def _read_head(head: bytes, where: str) -> _CsvHead:
    """Understand a file's first bytes; a LegwattError where they are no text with a header.

    Lines that begin with ``#`` are remarks, unless the last of them is the header of what follows.
    """
    if not head.strip():
        raise LegwattError(f"{where}: the file is empty; give a log as CSV or Parquet")
    if head[:2] in (b"\xff\xfe", b"\xfe\xff") or b"\x00" in head[:4096]:
        raise LegwattError(f"{where}: not UTF-8 text; save the log as CSV in UTF-8 or as Parquet")
    try:
        text = head[: head.rfind(b"\n") + 1 or None].decode("utf-8-sig")
    except UnicodeDecodeError:  # degree signs of older tools
        text = head.decode("latin-1")
    lines = re.split(r"\r\n|\r|\n", text)
    lines = lines[:-1] or lines  # the last may be cut off
    told = [k for k, x in enumerate(lines) if x.strip() and not x.startswith(("#", "sep="))] or [0]

    def fits(k: int, separator: str) -> tuple[float, bool, int]:
        """Share of rows with as many cells as the header at `k`, and how many those are."""
        body = (lines[n] for n in told[k : k + _LOOKED_AT + 1])
        header, *rows = (len(_cells(line, separator)) for line in body)
        share = sum(n == header for n in rows) / max(len(rows), 1) if header > 1 else 0.0
        return share, separator != " ", header

    # What stands above the header has other cells than what stands below.
    best = (max(fits(k, x)[0] for x in _SEPARATORS) for k in range(min(len(told), _PREAMBLE)))
    k = next((k for k, share in enumerate(best) if share > _ALIKE), 0)
    first, separator = told[k], max(_SEPARATORS, key=partial(fits, k))
    inside = [cell for n in told[: _LOOKED_AT + 1] for cell in _cells(lines[n], separator)]
    comma = separator != "," and any(map(_DECIMAL_COMMA.fullmatch, inside))
    is_value = partial(_is_value, decimal="," if comma else ".")
    names, skip = _cells(lines[first], separator), first + 1
    if names and all(map(is_value, names)):
        header = _cells(lines[first - 1].lstrip("# ") if first else "", separator)
        if len(header) != len(names) or all(map(is_value, header)):
            raise LegwattError(
                f"{where}: line {first + 1} holds numbers; expected a header of column names"
            )
        names, skip = header, first
    names = [name.strip().removeprefix("#").strip() for name in names]
    names = [name or f"column {k}" for k, name in enumerate(names, start=1)]
    rows = [[*zip(names, _cells(x, separator), strict=False)] for x in lines[skip : skip + 2]]
    units = {n: u for row in rows[:1] for n, cell in row if (u := unit_spelt(cell))}
    if units and not any(is_value(cell) for _, cell in rows[0]):
        skip, rows = skip + 1, rows[1:]
    else:
        units = {}
    stamps = {n: c.strip() for row in rows[:1] for n, c in row if _ISO.fullmatch(c)}
    return _CsvHead(tuple(names), skip, units, stamps, separator, "," if comma else ".")


def _read_table(
    stream: Any, head: _CsvHead, columns: Sequence[str], where: str
) -> tuple[Any, bool]:
    """Some columns as a pyarrow table, and whether the last row was cut off and left out."""
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

    # A single thread counts rows, so that messages can say where; any byte can be read, so that an
    # odd row is told whatever is in it.
    how = pc.ReadOptions(
        column_names=list(head.names), skip_rows=head.skip, use_threads=False, encoding="latin1"
    )
    parse = pc.ParseOptions(delimiter=head.separator, invalid_row_handler=passed_over)
    convert = pc.ConvertOptions(
        include_columns=list(columns),
        column_types=kinds,
        decimal_point=head.decimal,
        strings_can_be_null=True,
    )
    try:
        table = pc.read_csv(stream, how, parse, convert)
    except pa.ArrowInvalid as error:
        text = one_line(error)
        row = f"row {found[1]}" if (found := re.search(r"Row #(\d+)", text)) else "a row"
        if cell := re.search(r"column #(\d+): .*invalid value '(.*)'", text):
            name = one_line(head.names[int(cell[1])])
            text = f"{row}, column '{name}' holds '{cell[2][:40]}', expected a number, as 1.5"
        raise LegwattError(f"{where}: {text if cell else f'cannot be read: {text}'}") from None
    # The end of a file that nobody closed is none of its numbers.
    last = head.skip + table.num_rows + len(remarks) + 1
    cut = [row for row in odd[:1] if row.number >= last > head.skip + 1]
    for row in odd if not cut or cut[0].actual_columns > len(head.names) else ():
        raise LegwattError(
            f"{where}: row {row.number} has {row.actual_columns} cells, the header "
            f"{row.expected_columns}; mend or drop it"
        )
    return table, bool(cut)


def _cells(line: str, separator: str) -> list[str]:
    return line.split() if separator == " " else next(csv.reader([line], delimiter=separator), [])


def _is_value(text: str, decimal: str) -> bool:
    """Whether a cell holds a number or a time, not a name."""
    try:
        float(text.replace(decimal, "."))
    except ValueError:
        return bool(_ISO.fullmatch(text))
    return True


def unit_spelt(text: str) -> str:
    """The unit that a text means, as `actuators.parameters` writes it; empty where it is none."""
    plain = text.strip().strip("[]()").strip()
    for name in (plain, _SPELT.get(plain.lower(), ""), plain.replace("_", "/")):
        with suppress(LegwattError):
            return spelt(name)
    return ""


@lru_cache(maxsize=1)
def _whole_file(path: Path, kind: str, facts: object) -> tuple[Any, tuple[str, ...]]:
    """A file of arrays, or a bag, as a pyarrow table, and remarks; by its `facts` once."""
    if kind == "feather":
        from pyarrow import feather

        return feather.read_table(path, memory_map=False), ()
    return _read_bag(path) if kind == "bag" else _arrays(path, kind)


def _arrays(path: Path, kind: str) -> tuple[Any, tuple[str, ...]]:
    """Columns of a file of arrays as a pyarrow table, and a remark on what is none.

    A vector with a number per instant is a column; an array with one row, or one column, per
    instant gives a column for each of the others, called ``name[0]``, ``name[1]`` and so on.
    """
    import pyarrow as pa

    if kind == "mat":
        every = [*_flat("", _matlab(path))]
    else:
        if kind == "h5":
            import h5py
        with h5py.File(path) if kind == "h5" else np.load(path, allow_pickle=False) as file:
            every = [*_flat("", file)]  # a mapping, of which nothing is ever unpickled
    found = {name: x for name, x in every if x.ndim}
    numbers = {n: x for n, x in found.items() if x.dtype.kind in "fiubM" and x.ndim < 3}
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
            del found[name]
    left = ", ".join(f"{name} {x.shape}" for name, x in found.items())
    if rows < 2:
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


def _flat(above: str, value: object) -> Iterator[tuple[str, NDArray[Any]]]:
    """Arrays of nested tables, each by its path."""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _flat(f"{above}/{name}" if above else str(name), inner)
        return
    x = np.asarray(value)
    if x.dtype.names:  # rows of named fields
        yield from _flat(above, {name: x[name] for name in x.dtype.names})
    elif x.dtype != object:
        yield above, x.squeeze()


def _read_bag(path: Path) -> tuple[Any, tuple[str, ...]]:
    """All joint states of a bag, or of a folder of bags, as a pyarrow table, and remarks.

    The rows are those of the column that most messages tell, of a topic called after states where
    there is one. What others send on stamps of their own is brought, by straight lines, to the rows
    that are nearest to these, and is empty in others.
    """
    import pandas as pd
    import pyarrow as pa

    sent = _messages(path)
    none = sum(sum(stamp <= 0 for stamp in stamps) for stamps, _, _ in sent.values())
    remarks = [
        f"{none} messages have no stamp in their header: the times are those at which messages "
        "were recorded, late by what travelling takes, and unevenly so"
    ] * bool(none)
    parts: dict[tuple[str, str], list[Any]] = defaultdict(list)
    for topic, joints, told in [*sent]:
        stamps, logged, values = sent.pop((topic, joints, told))
        when: _Stamps = np.array(logged if none else stamps, dtype=np.int64)
        names = [f"{j}__{suffix}" for suffix in compress(_SUFFIXES.values(), told) for j in joints]
        block = np.frombuffer(values, dtype=np.float64).reshape(when.size, -1)
        for name, numbers in zip(names, block.T, strict=True):
            parts[topic, name].append(pd.Series(numbers, when, copy=False))
    ranked = sorted(parts, key=lambda c: ("state" not in c[0], -sum(map(len, parts[c]))))
    rows, out, apart, twice = pd.Index([]), dict[str, Array](), [], set[str]()
    for topic, name in ranked:
        own = pd.concat(parts.pop((topic, name))).sort_index(kind="stable")
        rows = rows if out else own.index
        if name in out:
            twice.add(topic)
        elif own.index.isin(rows).all():
            out[name] = own[~own.index.duplicated()].reindex(rows).to_numpy()
        else:
            out[name] = _nearest(own.index.to_numpy(), own.to_numpy(), rows.to_numpy())
            apart.append(name)
    if twice:
        remarks.append(f"{', '.join(sorted(twice))} tells what others told already: left out")
    if apart:
        remarks.append(
            f"{len(apart)} columns come at other times ({one_line(apart[0])}, ...) and are brought "
            "to those of the others by straight lines"
        )
    return pa.table({"time_s": 1e-9 * (rows - rows[0]).to_numpy(), **out}), tuple(remarks)


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
        if not any(wanted):
            topics = ", ".join(sorted({f"{c.topic} ({c.msgtype})" for own in every for c in own}))
            raise LegwattError(
                f"{where}: no topic holds joint states ({JOINTS}); it has {topics or 'no topic'}"
            )
        total, count, apart = sum(c.msgcount for own in wanted for c in own), 0, 0
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
                for x in numbers:
                    if x.size not in (0, len(names)):
                        raise LegwattError(
                            f"{where}: a message of {JOINTS} holds {x.size} numbers for "
                            f"{len(names)} names ({one_line(', '.join(names))})"
                        )
                apart = apart or int(np.ceil(8 * total * len(names) * sum(told) / _MOST_OF_BAG))
                stamps, times, values = sent[connection.topic, names, told]
                stamps.append(message.header.stamp.sec * 10**9 + message.header.stamp.nanosec)
                times.append(logged)
                values.frombytes(np.concatenate(numbers).tobytes())
        bar.close()
    if not sent:
        raise LegwattError(f"{where}: its topics of joint states hold no message")
    return sent


def _nearest(own: _Stamps, values: Array, times: _Stamps) -> Array:
    """A sender's numbers (N,) in the rows that are nearest to its own, by straight lines."""
    first, out = times[0], np.full(times.size, np.nan)
    after = np.clip(np.searchsorted(times, own), 1, max(times.size - 1, 1))
    near = after - (own - times[after - 1] < times[after] - own)
    # Stamps of today are too large for a float to tell 100 ns.
    out[near] = np.interp(times[near] - first, own - first, values, left=np.nan, right=np.nan)
    return out
