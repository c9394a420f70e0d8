"""Bags of ROS, written as robots do and read as the table that a CSV of the same numbers is."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from pipeline.logs.formats import JOINTS
from pipeline.logs.read import read_log
from tests.pipeline.logs.test_read import one_line

Array = NDArray[np.float64]
START = 1_700_000_000 * 10**9


def sent(columns: dict[str, Array], rows: int = 400, topic: str = "/joint_states") -> list[Sent]:
    """Messages with the columns' numbers, recorded 0.3 ms after their stamps."""
    at = START + np.round(columns["time_s"][:rows] * 1e9).astype(int)
    keys = {"position": "position_rad", "velocity": "velocity_rad_s", "effort": "torque_Nm"}
    return [
        (
            topic,
            int(stamp),
            int(stamp) + 300_000,
            ("a", "b"),
            {q: [columns[f"{j}__{key}"][k] for j in "ab"] for q, key in keys.items()},
        )
        for k, stamp in enumerate(at)
    ]


@pytest.mark.parametrize(
    ("kind", "compressed"), [("mcap", "storage"), ("db3", "message"), ("bag", "lz4")]
)
def test_every_kind_of_bag_gives_the_numbers_that_were_sent(
    kind, compressed, columns, two_joints, tmp_path
):
    path = tmp_path / ("walk.bag" if kind == "bag" else "walk")
    write_bag(path, sent(columns), kind=kind, compressed=compressed)
    log = read_log(path, two_joints)
    assert np.allclose(log.time, columns["time_s"][:400], atol=1e-9)
    velocity, torque = log.of("velocity"), log.of("torque")
    assert velocity is not None
    assert torque is not None
    for j, joint in enumerate("ab"):
        assert (log.position[:, j] == columns[f"{joint}__position_rad"][:400]).all()
        assert (velocity[:, j] == columns[f"{joint}__velocity_rad_s"][:400]).all()
        assert (torque[:, j] == columns[f"{joint}__torque_Nm"][:400]).all()
    assert log.findings == ()


def test_joints_in_changing_order_and_efforts_that_are_no_numbers(columns, two_joints, tmp_path):
    messages = []
    for k, (topic, stamp, logged, names, numbers) in enumerate(sent(columns)):
        turned = k % 3 == 1
        given = {q: list(reversed(x)) if turned else list(x) for q, x in numbers.items()}
        if k == 7:
            given["effort"] = [np.nan, np.nan]
        if k == 8:
            del given["effort"]
        order = tuple(reversed(names)) if turned else names
        messages.append((topic, stamp, logged, order, given))
    log = read_log(write_bag(tmp_path / "walk", messages), two_joints)
    torque = log.of("torque")
    for j, joint in enumerate("ab"):
        assert (log.position[:, j] == columns[f"{joint}__position_rad"][:400]).all()
    assert np.flatnonzero(np.isnan(torque).any(axis=1)).tolist() == [7, 8]


def test_publishers_with_stamps_of_their_own_are_brought_to_one_clock(
    columns, two_joints, tmp_path
):
    one, other = [], []
    for topic, stamp, logged, _, numbers in sent(columns):
        a, b = ({q: [x[j]] for q, x in numbers.items()} for j in (0, 1))
        one.append((topic, stamp, logged, ("a",), a))
        other.append((topic, stamp + 700_000, logged + 700_000, ("b",), b))
    both = sorted([*one, *other[:200:2], *other[200:]], key=lambda message: message[2])
    log = read_log(write_bag(tmp_path / "walk", both), two_joints)
    time, q = columns["time_s"][:400], columns["b__position_rad"][:400]
    assert np.allclose(log.time, time, atol=1e-9)
    assert (log.position[:, 0] == columns["a__position_rad"][:400]).all()
    held = np.interp(time, np.delete(time, np.s_[1:200:2]) + 7e-4, np.delete(q, np.s_[1:200:2]))
    told = np.isfinite(log.position[:, 1])
    assert np.flatnonzero(~told).tolist() == [0, *range(1, 200, 2)]  # no message is near these
    assert np.allclose(log.position[told, 1], held[told], atol=1e-12)


def test_what_cannot_be_read_is_one_line(columns, two_joints, tmp_path, monkeypatch):
    def refused(path: Path, words: str) -> None:
        one_line(lambda: read_log(path, two_joints), (words,))

    bag = write_bag(tmp_path / "walk", sent(columns)) / "walk.mcap"
    whole = bag.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: len(whole) // 2])
    refused(cut, "cut.mcap: cannot be read")
    (tmp_path / "empty").mkdir()
    refused(tmp_path / "empty", "without files of a bag")
    wrong = [(t, s, r, n, {**x, "position": [1.0]}) for t, s, r, n, x in sent(columns)[:3]]
    refused(write_bag(tmp_path / "few", wrong), "1, 2, 2 numbers for 2 names")
    none = write_bag(tmp_path / "none", sent(columns)[:1]) / "none.mcap"
    other = tmp_path / "other.mcap"
    other.write_bytes(none.read_bytes().replace(b"msg/JointState", b"msg/JointStatf"))
    refused(other, "other.mcap: ")
    monkeypatch.setitem(sys.modules, "rosbags.rosbag1", None)
    again = tmp_path / "again.mcap"
    again.write_bytes(whole)
    refused(again, "needs the extra 'bags'")


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
