"""Writes bags as robots do, for tests."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from pipeline.logs.bags import JOINTS

#: A message: topic, header stamp [ns], recording time [ns], names, and numbers by quantity.
Sent = tuple[str, int, int, Sequence[str], dict[str, Sequence[float]]]


def _message(store: Any, sent: Sent, *, ros1: bool) -> Any:
    _, stamp, _, names, numbers = sent
    time = store.types["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9)
    counted = {"seq": int(stamp // 10**6 % 1000)} if ros1 else {}
    header = store.types["std_msgs/msg/Header"](stamp=time, frame_id="", **counted)
    arrays = [np.array(numbers.get(q, ()), dtype=float) for q in ("position", "velocity", "effort")]
    return store.types[JOINTS](header, list(names), *arrays)


def write_bag(
    path: Path, messages: Iterable[Sent], *, kind: str = "mcap", compressed: str = ""
) -> Path:
    """Write a bag.

    Args:
        path: Folder for ROS 2, file for ROS 1.
        messages: In recording order.
        kind: ``"mcap"``, ``"db3"`` or ``"bag"``.
        compressed: ``"file"``, ``"message"`` or ``"storage"``; for ROS 1 ``"lz4"`` or ``"bz2"``.
    """
    ros1 = kind == "bag"
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
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
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, JOINTS, typestore=store)
            message = _message(store, sent, ros1=ros1)
            writer.write(connections[topic], logged, write(message, JOINTS))
    return path
