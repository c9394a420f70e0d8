"""ROS bags (MCAP, SQLite, ROS 1): joint states become one table, row by stamp."""

from __future__ import annotations

from array import array
from collections import defaultdict
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError, one_line
from pipeline.logs.formats import BAGS, MOST_BYTES, bag_files
from pipeline.logs.log_format import JOINT_COLUMNS, TIME

JOINTS: Final = "sensor_msgs/msg/JointState"
DYNAMIC: Final = "control_msgs/msg/DynamicJointState"
#: control_msgs is no part of the types that ROS itself brings.
_DYNAMIC_TYPES: Final = {
    "control_msgs/msg/InterfaceValue": "string[] interface_names\nfloat64[] values\n",
    DYNAMIC: "std_msgs/Header header\nstring[] joint_names\n"
    "control_msgs/InterfaceValue[] interface_values\n",
}
#: Times the usual step beyond which nothing is drawn between two messages.
_GAP: Final = 5.0
#: Of numbers at once [B]: read message by message and sorted by stamp they are held several times.
_MOST_BYTES: Final = MOST_BYTES // 3
#: Messages that are read, or left out, in a row where a bag does not fit in memory.
_STRETCH: Final = 50_000
#: What ROS calls a quantity, and its column's end in the log format.
_SUFFIX: Final = {quantity: suffix for suffix, (quantity, _) in JOINT_COLUMNS.items()} | {
    "effort": "torque_Nm"
}
_Stamps = NDArray[np.int64]


class _Column(NamedTuple):
    """Whose numbers these are, by topic, joint and quantity."""

    topic: str
    joint: str
    quantity: str


@dataclass
class _Sent:
    """Messages with the same columns."""

    stamps: Any = field(default_factory=lambda: array("q"))  # of their headers [ns]
    logged: Any = field(default_factory=lambda: array("q"))  # when they were recorded [ns]
    values: Any = field(default_factory=lambda: array("d"))


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
    none = sum(int((np.array(s.stamps) <= 0).sum()) for s in sent.values())
    remarks = [
        f"{none} messages have no stamp in their header: the times are those at which messages "
        "were recorded, late by what travelling takes, and unevenly so"
    ] * bool(none)
    parts: dict[_Column, list[tuple[_Stamps, Array]]] = defaultdict(list)
    back = 0
    for columns in [*sent]:
        s = sent.pop(columns)
        when: _Stamps = np.array(s.logged if none else s.stamps, dtype=np.int64)
        back += int((np.diff(when) < 0).sum())
        block = np.frombuffer(s.values, dtype=np.float64).reshape(when.size, -1)
        for column, values in zip(columns, block.T, strict=True):
            parts[column].append((when, values))
    if back:
        remarks.append(f"{back} messages are stamped before the one that came before; sorted")
    series = {}
    for column in [*parts]:
        own = parts.pop(column)
        stamps = np.concatenate([when for when, _ in own])
        order = np.argsort(stamps, kind="stable")
        series[column] = stamps[order], np.concatenate([values for _, values in own])[order]
    ranked = sorted(series, key=lambda c: ("state" not in c.topic, -series[c][0].size))
    times = series[ranked[0]][0]
    names, others = _names(ranked)
    out, apart = {TIME: 1e-9 * (times - times[0])}, []
    for column in ranked:
        own_times, values = series[column]
        if np.array_equal(own_times, times):
            out[names[column]] = values
        elif np.isin(own_times, times).all():
            out[names[column]] = np.full(times.size, np.nan)
            out[names[column]][np.searchsorted(times, own_times)] = values
        else:
            out[names[column]] = _between(own_times, values, times)
            apart.append(names[column])
    if apart:
        others.append(
            f"{len(apart)} columns come at other times ({one_line(apart[0])}, ...) and are brought "
            "to those of the others by straight lines"
        )
    return pa.table(out), (*remarks, *others)


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


def _messages(readers: list[Any], where: str) -> dict[tuple[_Column, ...], _Sent]:
    """Numbers of all messages of joint states, by their columns."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    from tqdm import tqdm

    wanted = {id(r): [c for c in r.connections if c.msgtype in (JOINTS, DYNAMIC)] for r in readers}
    total = sum(c.msgcount for connections in wanted.values() for c in connections)
    if not any(wanted.values()):
        topics = sorted({f"{c.topic} ({c.msgtype})" for r in readers for c in r.connections})
        raise LegwattError(
            f"{where}: no topic holds joint states ({JOINTS} or {DYNAMIC}); "
            f"it has {', '.join(topics) or 'no topic'}"
        )
    sent: dict[tuple[_Column, ...], _Sent] = defaultdict(_Sent)
    count, every = 0, 0
    bar = tqdm(total=total, desc=where, unit=" messages", leave=False, disable=None)
    for reader in (r for r in readers if wanted[id(r)]):
        ros1 = type(reader).__module__.startswith("rosbags.rosbag1")
        store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
        for name, text in _DYNAMIC_TYPES.items():
            store.register(get_types_from_msg(text, name))
        read: Any = store.deserialize_ros1 if ros1 else store.deserialize_cdr
        for connection, logged, raw in reader.messages(connections=wanted[id(reader)]):
            bar.update()
            stretch, count = count // _STRETCH, count + 1
            if every > 1 and stretch % every:
                continue
            message = read(raw, connection.msgtype)
            columns, values = _numbers(message, connection, where)
            every = every or int(np.ceil(8 * total * len(columns) / _MOST_BYTES))
            own, stamp = sent[columns], message.header.stamp
            own.stamps.append(stamp.sec * 10**9 + stamp.nanosec)
            own.logged.append(logged)
            own.values.frombytes(values.tobytes())
    bar.close()
    if not sent:
        raise LegwattError(f"{where}: its topics of joint states hold no message")
    return sent


def _numbers(message: Any, connection: Any, where: str) -> tuple[tuple[_Column, ...], Array]:
    """Columns and numbers of a message, whatever is left out."""
    topic, kind = connection.topic, connection.msgtype
    if kind == JOINTS:
        quantities = ("position", "velocity", "effort")
        parts = [([(j, q) for j in message.name], getattr(message, q)) for q in quantities]
    else:
        pairs = zip(message.joint_names, message.interface_values, strict=False)
        parts = [([(j, name) for name in x.interface_names], x.values) for j, x in pairs]
    columns: list[_Column] = []
    blocks = [np.zeros(0)]
    for named, values in parts:
        if values.size == 0:  # ROS allows what is not known to be left out
            continue
        if values.size != len(named):
            raise LegwattError(
                f"{where}: a message of {kind} holds {values.size} numbers for {len(named)} names "
                f"({one_line(', '.join(joint for joint, _ in named))})"
            )
        columns += [_Column(topic, *name) for name in named]
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


def _names(ranked: list[_Column]) -> tuple[dict[_Column, str], list[str]]:
    """Every column's name in the table, and a remark where topics tell the same.

    What several topics tell of one joint is taken from the first; the others' columns, and those of
    quantities that the log format does not know, keep their topic's name.
    """
    names: dict[_Column, str] = {}
    others: dict[str, None] = {}
    for column in ranked:
        suffix = _SUFFIX.get(column.quantity)
        name = f"{column.joint}__{suffix}"
        if not suffix or name in names.values():
            name = f"{column.topic}/{column.joint}/{column.quantity}"
            others[column.topic] = None
        names[column] = name
    text = f"some columns of {', '.join(others)} are kept as TOPIC/JOINT/QUANTITY"
    return names, [text] * bool(others)
