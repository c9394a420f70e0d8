"""ROS bags (MCAP, SQLite, ROS 1): joint states become one table, row by stamp.

Messages of one layout hold stamp and numbers at the same bytes. These places are found once, by
serialising a message of that layout twice with other numbers in it; all messages of that layout
are then read as one array. What remains is deserialised by `rosbags`, message by message.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuators.errors import LegwattError, one_line
from pipeline.logs.formats.spool import Column, Spool

Bytes = NDArray[np.uint8]
#: Joint and quantity of every number, in the message's order.
_Names = tuple[tuple[str, str], ...]
JOINTS: Final = "sensor_msgs/msg/JointState"
DYNAMIC: Final = "control_msgs/msg/DynamicJointState"
SUFFIXES: Final = (".mcap", ".db3", ".bag")
#: control_msgs is no part of the types that ROS itself brings.
_DYNAMIC_TYPES: Final = {
    "control_msgs/msg/InterfaceValue": "string[] interface_names\nfloat64[] values\n",
    DYNAMIC: "std_msgs/Header header\nstring[] joint_names\n"
    "control_msgs/InterfaceValue[] interface_values\n",
}
_BATCH: Final = 2048  # messages of one length that are read together
NEEDS: Final = (
    "reading bags, MATLAB 7.3 and HDF5 files needs the extra 'bags': pip install -e '.[bags]'"
)


class _Layout(NamedTuple):
    """Where messages of one layout hold what changes, and what they hold everywhere else."""

    fixed: NDArray[np.intp]
    text: Bytes
    stamp: slice
    numbers: NDArray[np.intp]
    columns: _Names


def read_bag(path: Path, spool: Spool) -> None:
    """Read all joint states of a bag, or of a folder of bags, into a spool.

    Args:
        path: File or folder.
        spool: Takes the numbers.

    Raises:
        LegwattError: The extra is missing, the bag is damaged or has no joint states; one line.
    """
    where = one_line(path.name)
    try:
        with ExitStack() as stack:
            readers = [stack.enter_context(reader) for reader in _readers(path)]
            _read(readers, where, spool)
    except LegwattError:
        raise
    except ImportError:
        raise LegwattError(f"{where}: {NEEDS}") from None
    except Exception as error:  # the library raises whatever bytes make it
        reason = one_line(error) or type(error).__name__
        raise LegwattError(f"{where}: the bag cannot be read: {reason}") from None


def _readers(path: Path) -> list[Any]:
    """A reader per file, or one for a folder that says which files it holds."""
    from rosbags.rosbag1 import Reader as Reader1
    from rosbags.rosbag2 import Reader as Reader2

    if path.is_dir() and (path / "metadata.yaml").is_file():
        return [Reader2(path)]
    files = sorted(p for p in path.iterdir() if p.suffix in SUFFIXES) if path.is_dir() else [path]
    return [Reader1(f) if f.suffix == ".bag" else Reader2(f) for f in files]


def _read(readers: list[Any], where: str, spool: Spool) -> None:
    from tqdm import tqdm

    wanted = {id(r): [c for c in r.connections if c.msgtype in (JOINTS, DYNAMIC)] for r in readers}
    total = sum(c.msgcount for connections in wanted.values() for c in connections)
    if not any(wanted.values()):
        topics = sorted({f"{c.topic} ({c.msgtype})" for r in readers for c in r.connections})
        raise LegwattError(
            f"{where}: no topic holds joint states ({JOINTS} or {DYNAMIC}); "
            f"it has {', '.join(topics) or 'no topic'}"
        )
    count = 0
    bar = tqdm(total=total, desc=where, unit=" messages", leave=False, disable=None)
    for reader in readers:
        if not wanted[id(reader)]:
            continue
        decoder = _Decoder(type(reader).__module__.startswith("rosbags.rosbag1"), where, spool)
        for connection in wanted[id(reader)]:
            decoder.refuse_other_definition(connection)
        for connection, logged, raw in reader.messages(connections=wanted[id(reader)]):
            decoder.take(connection.topic, connection.msgtype, logged, raw)
            count += 1
            if count % _BATCH == 0:
                bar.update(_BATCH)
        decoder.finish()
    bar.close()
    if count == 0:
        raise LegwattError(f"{where}: its topics of joint states hold no message")


class _Decoder:
    """Numbers of messages, many at once where they have one layout."""

    def __init__(self, ros1: bool, where: str, spool: Spool) -> None:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        self._store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
        for name, text in _DYNAMIC_TYPES.items():
            self._store.register(get_types_from_msg(text, name))
        self._ros1, self._where, self._spool = ros1, where, spool
        self._waiting: dict[tuple[str, str, int], list[tuple[int, bytes]]] = defaultdict(list)
        self._layouts: dict[tuple[str, int], list[_Layout]] = defaultdict(list)

    def refuse_other_definition(self, connection: Any) -> None:
        """Refuse a type of the same name and another definition, where the bag has hashes."""
        kind = connection.msgtype
        own = self._store.generate_msgdef(kind)[1] if self._ros1 else self._store.hash_rihs01(kind)
        if connection.digest and connection.digest != own:
            raise LegwattError(
                f"{self._where}: {connection.topic} is of a type called {kind} that is not ROS's"
            )

    def take(self, topic: str, kind: str, logged: int, raw: bytes) -> None:
        """Take one message; read those of its length when there are enough."""
        waiting = self._waiting[topic, kind, len(raw)]
        waiting.append((logged, raw))
        if len(waiting) == _BATCH:
            self._flush(topic, kind, waiting)

    def finish(self) -> None:
        """Read what still waits."""
        for (topic, kind, _), waiting in self._waiting.items():
            self._flush(topic, kind, waiting)

    def _flush(self, topic: str, kind: str, waiting: list[tuple[int, bytes]]) -> None:
        if not waiting:
            return
        logged = np.array([t for t, _ in waiting], dtype=np.int64)
        block = np.frombuffer(b"".join(raw for _, raw in waiting), dtype=np.uint8)
        block = block.reshape(len(waiting), -1)
        waiting.clear()
        known = self._layouts[kind, block.shape[1]]
        read = self._store.deserialize_ros1 if self._ros1 else self._store.deserialize_cdr
        left = np.arange(block.shape[0])
        for layout in known:
            left = self._matching(layout, topic, block, logged, left)
        while left.size:
            message = read(bytes(block[left[0]]), kind)
            own = self._layout(message, kind)
            if own is not None and (block[left[0], own.fixed] == own.text).all():
                known.insert(0, own)
                del known[16:]
                left = self._matching(own, topic, block, logged, left)
                continue
            stamp, columns, values = self._numbers(message, kind)  # e.g. of the other byte order
            first, left = left[0], left[1:]
            self._add(topic, columns, np.array([stamp]), logged[first : first + 1], values[None])

    def _matching(
        self, layout: _Layout, topic: str, block: Bytes, logged: NDArray[np.int64], left: Any
    ) -> Any:
        """Read those of the messages `left` that have a layout; return the others."""
        if not left.size or block.shape[1] <= layout.fixed[-1]:
            return left
        rows = block[left]
        same = (rows[:, layout.fixed] == layout.text).all(axis=1)
        rows = rows[same]
        parts = np.ascontiguousarray(rows[:, layout.stamp]).view("<u4").astype(np.int64)
        stamps = parts[:, 0] * 10**9 + parts[:, 1]
        values = np.ascontiguousarray(rows[:, layout.numbers]).view("<f8")
        self._add(topic, layout.columns, stamps, logged[left[same]], values)
        return left[~same]

    def _add(
        self,
        topic: str,
        columns: Sequence[tuple[str, str]],
        stamps: NDArray[np.int64],
        logged: NDArray[np.int64],
        values: NDArray[np.float64],
    ) -> None:
        if stamps.size:
            named = tuple(Column(topic, joint, quantity) for joint, quantity in columns)
            self._spool.add(named, stamps, logged, values)

    def _numbers(self, message: Any, kind: str) -> tuple[int, _Names, NDArray[np.float64]]:
        """Stamp [ns], names and numbers of a message, whatever its layout."""
        stamp = message.header.stamp
        columns: list[tuple[str, str]] = []
        blocks = [np.zeros(0)]
        if kind == JOINTS:
            parts = [
                ([(joint, quantity) for joint in message.name], getattr(message, quantity))
                for quantity in ("position", "velocity", "effort")
            ]
        else:
            parts = [
                ([(joint, name) for name in value.interface_names], value.values)
                for joint, value in zip(message.joint_names, message.interface_values, strict=False)
            ]
        for named, values in parts:
            if values.size == 0:  # ROS allows what is not known to be left out
                continue
            if values.size != len(named):
                raise LegwattError(
                    f"{self._where}: a message of {kind} holds {values.size} numbers for "
                    f"{len(named)} names ({one_line(', '.join(joint for joint, _ in named))})"
                )
            columns += named
            blocks.append(values)
        nanoseconds = stamp.sec * 10**9 + stamp.nanosec
        return nanoseconds, tuple(columns), np.concatenate(blocks)

    def _layout(self, message: Any, kind: str) -> _Layout | None:
        """Where messages like this one hold stamp and numbers; None where that is not plain."""
        columns = self._numbers(message, kind)[1]
        none, full = (self._filled(message, kind, bits) for bits in (0x00, 0xFF))
        changes = np.flatnonzero(none != full)
        seq = 4 if self._ros1 else 0  # ROS 1 counts its messages in the header
        if changes.size != seq + 8 + 8 * len(columns):
            return None
        start = int(changes[seq])
        fixed = np.flatnonzero(none == full)
        return _Layout(fixed, none[fixed], slice(start, start + 8), changes[seq + 8 :], columns)

    def _filled(self, message: Any, kind: str, bits: int) -> Bytes:
        """The message's bytes with every bit of stamp and numbers as said."""
        number = np.frombuffer(bytes([bits] * 8), "<f8")[0]
        unsigned = int.from_bytes(bytes([bits] * 4), "little")
        counted = {"seq": unsigned} if self._ros1 else {}
        stamp = replace(message.header.stamp, sec=-1 if bits else 0, nanosec=unsigned)
        changes: dict[str, Any] = {"header": replace(message.header, stamp=stamp, **counted)}
        if kind == JOINTS:
            for quantity in ("position", "velocity", "effort"):
                changes[quantity] = np.full(getattr(message, quantity).size, number)
        else:
            changes["interface_values"] = [
                replace(value, values=np.full(value.values.size, number))
                for value in message.interface_values
            ]
        write = self._store.serialize_ros1 if self._ros1 else self._store.serialize_cdr
        return np.frombuffer(write(replace(message, **changes), kind), dtype=np.uint8)
