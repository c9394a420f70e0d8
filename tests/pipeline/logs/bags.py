"""Writes bags as robots do, for tests."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from pipeline.logs.bags import _DYNAMIC_TYPES, DYNAMIC, JOINTS

#: A message: topic, header stamp [ns], recording time [ns], names, and numbers by quantity.
Sent = tuple[str, int, int, Sequence[str], dict[str, Sequence[float]]]


def _store(ros1: bool) -> Any:
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    for name, text in _DYNAMIC_TYPES.items():
        store.register(get_types_from_msg(text, name))
    return store


def _message(store: Any, sent: Sent, *, dynamic: bool, ros1: bool) -> Any:
    _, stamp, _, names, numbers = sent
    time = store.types["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9)
    counted = {"seq": int(stamp // 10**6 % 1000)} if ros1 else {}
    header = store.types["std_msgs/msg/Header"](stamp=time, frame_id="", **counted)
    if dynamic:
        one = store.types["control_msgs/msg/InterfaceValue"]
        rows = zip(*numbers.values(), strict=True)
        values = [one(list(numbers), np.array(row, dtype=float)) for row in rows]
        return store.types[DYNAMIC](header, list(names), values)
    arrays = [np.array(numbers.get(q, ()), dtype=float) for q in ("position", "velocity", "effort")]
    return store.types[JOINTS](header, list(names), *arrays)


def write_bag(
    path: Path,
    messages: Iterable[Sent],
    *,
    kind: str = "mcap",
    dynamic: Sequence[str] = (),
    compressed: str = "",
) -> Path:
    """Write a bag.

    Args:
        path: Folder for ROS 2, file for ROS 1.
        messages: In recording order.
        kind: ``"mcap"``, ``"db3"`` or ``"bag"``.
        dynamic: Topics of DynamicJointState; the others are JointState's.
        compressed: ``"file"``, ``"message"`` or ``"storage"``; for ROS 1 ``"lz4"`` or ``"bz2"``.
    """
    ros1 = kind == "bag"
    store = _store(ros1)
    writer: Any
    if ros1:
        writer = Writer1(path)
        if compressed:
            writer.set_compression(writer.CompressionFormat[compressed.upper()])
    else:
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        writer = Writer(path, version=9, storage_plugin=plugin)
        if compressed:
            writer.set_compression(CompressionMode[compressed.upper()], CompressionFormat.ZSTD)
    write = store.serialize_ros1 if ros1 else store.serialize_cdr
    with writer:
        connections: dict[str, Any] = {}
        for sent in messages:
            topic, _, logged, _, _ = sent
            of = DYNAMIC if topic in dynamic else JOINTS
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, of, typestore=store)
            message = _message(store, sent, dynamic=topic in dynamic, ros1=ros1)
            writer.write(connections[topic], logged, write(message, of))
    return path
