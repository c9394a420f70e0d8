"""What reading a bag costs per message, and how much memory against how many messages."""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from pipeline.logs.formats.bags import JOINTS
from pipeline.logs.formats.convert import plain

#: Messages of the bags, and joints of each.
MESSAGES, NAMES = (50_000, 200_000), tuple(f"leg_{k // 3}_joint_{k % 3}" for k in range(12))


def bag_costs() -> None:
    """Print seconds per 10^6 messages and peak memory, each bag in a process of its own."""
    print(f"bags, MCAP, {len(NAMES)} joints: CPU seconds per 10^6 messages, peak memory")
    for messages in MESSAGES:
        with tempfile.TemporaryDirectory() as folder:
            bag = write(Path(folder) / "bag", messages)
            command = [sys.executable, "-m", "tests.bench_bags", str(bag)]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
        seconds, memory = map(float, done.stdout.split())
        print(f"  {messages:8d} messages {1e6 * seconds / messages:5.1f} s  {memory:6.0f} MB")


def write(path: Path, messages: int) -> Path:
    """A bag of joint states at 1 kHz."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/joint_states", JOINTS, typestore=store)
        for stamp, raw in _messages(store, messages):
            writer.write(connection, stamp, raw)
    return path


def _messages(store: object, messages: int) -> Iterator[tuple[int, bytes]]:
    """Stamps and bytes: one message is serialised, stamp and numbers of the others put into it."""
    types = store.types  # type: ignore[attr-defined]
    none = np.zeros(len(NAMES))
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](0, 0), "")
    message = types[JOINTS](header, list(NAMES), none, none, none)
    raw = bytearray(store.serialize_cdr(message, JOINTS))  # type: ignore[attr-defined]
    rng = np.random.default_rng(1)
    for k in range(messages):
        stamp = 10**18 + k * 10**6
        raw[4:12] = np.array([stamp // 10**9, stamp % 10**9], dtype="<u4").tobytes()
        for block in range(3):
            end = len(raw) - (2 - block) * (len(none) * 8 + 8)
            raw[end - len(none) * 8 : end] = rng.standard_normal(len(none)).tobytes()
        yield stamp, bytes(raw)


if __name__ == "__main__":
    begun = time.process_time()
    plain(Path(sys.argv[1]))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    print(time.process_time() - begun, peak)
