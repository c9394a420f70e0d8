"""Files that are one table as a whole: arrays (MATLAB, HDF5, npz), Feather, and bags of ROS.

MATLAB is read by SciPy and pymatreader, HDF5 by h5py, bags (MCAP, SQLite, ROS 1) by rosbags: joint
states become one table, row by stamp. Nothing is ever unpickled.
"""

from __future__ import annotations

from array import array
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError, one_line
from pipeline.logs.formats import BAGS, MOST_BYTES, TIMES, bag_files
from pipeline.logs.log import TIME, column_name

JOINTS: Final = "sensor_msgs/msg/JointState"
#: What ROS calls a quantity, and the log format.
_QUANTITIES: Final = {"position": "position", "velocity": "velocity", "effort": "torque"}
#: Times the usual step beyond which nothing is drawn between two messages.
_GAP: Final = 5.0
#: Of numbers at once [B]: read message by message and sorted by stamp they are held several times.
_MOST_BYTES: Final = MOST_BYTES // 3
#: Messages that are read, or left out, in a row where a bag does not fit in memory.
_STRETCH: Final = 50_000
_Stamps = NDArray[np.int64]
#: Topic, and name in the log format.
_Column = tuple[str, str]


@lru_cache(maxsize=1)
def whole_file(path: Path, kind: str, facts: object) -> tuple[Any, tuple[str, ...]]:
    """A file of arrays, or a bag, as a pyarrow table, and remarks; by its `facts` once."""
    if kind == "feather":
        from pyarrow import feather

        return feather.read_table(path, memory_map=False), ()
    return read_bag(path) if kind == "bag" else _arrays(path, kind)


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

    found = dict(_flat("", {"mat": _matlab, "h5": _hdf5, "npz": _numpy}[kind](path)))
    shapes = {name: f"{name} {x.shape}" for name, x in found.items() if x.ndim}
    numbers = {n: x for n, x in found.items() if x.dtype.kind in "fiubM" and x.ndim in (1, 2)}
    # The length of the time vector, else the one that most numbers share.
    sizes = Counter[int]()
    for name, x in numbers.items():
        is_time = x.ndim == 1 and name.rpartition("/")[2].lower() in TIMES
        sizes[max(x.shape)] += x.size + is_time * 10**12
    rows = sizes.most_common(1)[0][0] if sizes else 0
    columns: dict[str, NDArray[Any]] = {}
    for name, x in numbers.items():
        if rows in x.shape:
            block = x.reshape(rows, -1) if x.shape[0] == rows else x.T
            for k, column in enumerate(block.T):
                columns[name if x.ndim == 1 else f"{name}[{k}]"] = np.ascontiguousarray(column)
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

    with h5py.File(path, "r") as file:  # a mapping of groups and data sets
        return dict(_flat("", file))


def _numpy(path: Path) -> Mapping[str, Any]:
    with np.load(path, allow_pickle=False) as file:  # nothing is ever unpickled
        return {name: file[name] for name in file.files}


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


def read_bag(path: Path) -> tuple[Any, tuple[str, ...]]:
    """All joint states of a bag, or of a folder of bags, as a pyarrow table, rows by time.

    The rows are those of the column that most messages tell, of a topic called after states where
    there is one. Columns with stamps among those stand in their rows, empty between them; what
    others send on stamps of their own is brought to the rows by straight lines.

    Returns:
        The table, and what a reader should know of times and topics.

    Raises:
        LegwattError: It has no joint states, or a message that cannot be one.
    """
    import pyarrow as pa

    where = one_line(path.name)
    with ExitStack() as stack:
        sent = _messages([stack.enter_context(reader) for reader in _readers(path, where)], where)
    none = sum(int((np.array(stamps) <= 0).sum()) for stamps, _, _ in sent.values())
    remarks = [
        f"{none} messages have no stamp in their header: the times are those at which messages "
        "were recorded, late by what travelling takes, and unevenly so"
    ] * bool(none)
    parts: dict[_Column, list[tuple[_Stamps, Array]]] = defaultdict(list)
    back = 0
    for columns in [*sent]:
        stamps, logged, values = sent.pop(columns)
        when: _Stamps = np.array(logged if none else stamps, dtype=np.int64)
        back += int((np.diff(when) < 0).sum())
        block = np.frombuffer(values, dtype=np.float64).reshape(when.size, -1)
        for column, numbers in zip(columns, block.T, strict=True):
            parts[column].append((when, numbers))
    if back:
        remarks.append(f"{back} messages are stamped before the one that came before; sorted")
    ranked = sorted(parts, key=lambda c: ("state" not in c[0], -sum(w.size for w, _ in parts[c])))
    times, out, apart, twice = np.zeros(0, np.int64), dict[str, Array](), [], []
    for topic, name in ranked:
        own = parts.pop((topic, name))
        stamps = np.concatenate([when for when, _ in own])
        order = np.argsort(stamps, kind="stable")
        stamps, numbers = stamps[order], np.concatenate([numbers for _, numbers in own])[order]
        times = times if out else stamps
        if name in out:
            twice.append(topic)
        elif np.array_equal(stamps, times):
            out[name] = numbers
        elif np.isin(stamps, times).all():
            out[name] = np.full(times.size, np.nan)
            out[name][np.searchsorted(times, stamps)] = numbers
        else:
            out[name] = _between(stamps, numbers, times)
            apart.append(name)
    if twice:
        remarks.append(f"{', '.join(sorted({*twice}))} tells what others told already: left out")
    if apart:
        remarks.append(
            f"{len(apart)} columns come at other times ({one_line(apart[0])}, ...) and are brought "
            "to those of the others by straight lines"
        )
    return pa.table({TIME: 1e-9 * (times - times[0]), **out}), tuple(remarks)


def _readers(path: Path, where: str) -> list[Any]:
    """A reader per file, or one for a folder that says which files it holds."""
    from rosbags.rosbag1 import Reader as Reader1
    from rosbags.rosbag2 import Reader as Reader2

    if path.is_dir() and (path / "metadata.yaml").is_file():
        return [Reader2(path)]
    files = bag_files(path)
    if not files:
        raise LegwattError(f"{where}: a folder without files of a bag ({', '.join(BAGS)})")
    return [Reader1(f) if f.suffix == ".bag" else Reader2(f) for f in files]


def _messages(readers: list[Any], where: str) -> dict[tuple[_Column, ...], tuple[Any, Any, Any]]:
    """Stamps of headers and of the recording [ns], and numbers, of messages by their columns."""
    from rosbags.typesys import Stores, get_typestore
    from tqdm import tqdm

    wanted = {id(r): [c for c in r.connections if c.msgtype == JOINTS] for r in readers}
    total = sum(c.msgcount for connections in wanted.values() for c in connections)
    if not any(wanted.values()):
        topics = sorted({f"{c.topic} ({c.msgtype})" for r in readers for c in r.connections})
        raise LegwattError(
            f"{where}: no topic holds joint states ({JOINTS}); it has "
            f"{', '.join(topics) or 'no topic'}"
        )
    sent: dict[tuple[_Column, ...], Any] = defaultdict(lambda: (array("q"), array("q"), array("d")))
    count, every = 0, 0
    bar = tqdm(total=total, desc=where, unit=" messages", leave=False, disable=None)
    for reader in (r for r in readers if wanted[id(r)]):
        ros1 = type(reader).__module__.startswith("rosbags.rosbag1")
        store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
        read: Any = store.deserialize_ros1 if ros1 else store.deserialize_cdr
        for connection, logged, raw in reader.messages(connections=wanted[id(reader)]):
            bar.update()
            stretch, count = count // _STRETCH, count + 1
            if every > 1 and stretch % every:
                continue
            message = read(raw, connection.msgtype)
            columns, numbers = _numbers(message, connection.topic, where)
            every = every or int(np.ceil(8 * total * len(columns) / _MOST_BYTES))
            stamp, own = message.header.stamp, sent[columns]
            own[0].append(stamp.sec * 10**9 + stamp.nanosec)
            own[1].append(logged)
            own[2].frombytes(numbers.tobytes())
    bar.close()
    if not sent:
        raise LegwattError(f"{where}: its topics of joint states hold no message")
    return sent


def _numbers(message: Any, topic: str, where: str) -> tuple[tuple[_Column, ...], Array]:
    """Columns and numbers of a message, whatever is left out."""
    columns: list[_Column] = []
    blocks = [np.zeros(0)]
    for called, quantity in _QUANTITIES.items():
        values = getattr(message, called)
        if values.size == 0:  # ROS allows what is not known to be left out
            continue
        if values.size != len(message.name):
            raise LegwattError(
                f"{where}: a message of {JOINTS} holds {values.size} numbers for "
                f"{len(message.name)} names ({one_line(', '.join(message.name))})"
            )
        columns += [(topic, column_name(joint, quantity)) for joint in message.name]
        blocks.append(values)
    return tuple(columns), np.concatenate(blocks)


def _between(own: _Stamps, values: Array, times: _Stamps) -> Array:
    """A sender's numbers (N,) at other times, by straight lines; empty in its gaps."""
    first = times[0]  # stamps of today are too large for a float to tell 100 ns
    out = np.interp(times - first, own - first, values, left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(own, times), 1, max(own.size - 1, 1))
    if own.size > 1:
        wide = own[after] - own[after - 1] > _GAP * np.median(np.diff(own))
        out[wide & ~np.isin(times, own)] = np.nan
    return out
