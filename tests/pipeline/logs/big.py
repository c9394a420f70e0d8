"""What logs of many rows take: ``python -m tests.pipeline.logs.big bag`` (2 GB), or ``hour``.

An hour of an arm's six joints at 1 kHz in Parquet, or a bag of joint states of 30 joints of which
six are the arm's; printed are size, computing time and peak of memory up to `gap where`.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

ROBOT = "ur5"
ARM = tuple(f"{x}_joint" for x in ("shoulder_pan", "shoulder_lift", "elbow"))
ARM += tuple(f"wrist_{k}_joint" for k in (1, 2, 3))
KIND = "sensor_msgs/msg/JointState"


def series(rows: int, rate: float, joints: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (N,), positions and torques (N, J)."""
    rng, t = np.random.default_rng(0), np.arange(rows) / rate
    w = 2 * np.pi * rng.uniform(0.2, 0.9, joints)
    q = 0.3 * np.sin(w * t[:, None]) + 1e-5 * rng.standard_normal((rows, joints))
    return t, q, np.cos(w * t[:, None]) + 0.05 * rng.standard_normal((rows, joints))


def hour(path: Path) -> None:
    """Columns of an hour."""
    t, q, torque = series(3_600_000, 1000.0, len(ARM))
    columns = {f"{name}__position_rad": x for name, x in zip(ARM, q.T, strict=True)}
    columns |= {f"{name}__torque_Nm": x for name, x in zip(ARM, torque.T, strict=True)}
    pq.write_table(pa.table({"time_s": t, **columns}), path)


def bag(path: Path) -> None:
    """1.6 million messages of positions, velocities and efforts."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    types = (KIND, "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    state, header, stamp = (store.types[name] for name in types)
    names = [*ARM, *(f"other_{k}" for k in range(24))]
    t, q, torque = series(1_600_000, 500.0, 30)
    stamps = np.round(1e9 * t).astype(int) + 10**18
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topic = writer.add_connection("/joint_states", KIND, typestore=store)
        for at, *numbers in zip(stamps, q, 0 * q, torque, strict=True):
            head = header(stamp(int(at // 10**9), int(at % 10**9)), "")
            message = store.serialize_cdr(state(head, names, *numbers), KIND)
            writer.write(topic, int(at), message)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / ("log.parquet" if sys.argv[1] == "hour" else "log")
        {"hour": hour, "bag": bag}[sys.argv[1]](log)
        files = log.rglob("*") if log.is_dir() else [log]
        size = sum(file.stat().st_size for file in files)
        before = time.monotonic()
        words = ["gap", "where", str(log), "--robot", ROBOT, "--out", folder]
        subprocess.run([sys.executable, "-m", "pipeline", *words], check=True)
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        print(f"{size / 1e9:.2f} GB: {used.ru_utime + used.ru_stime:.0f} s of computing, ", end="")
        print(f"{time.monotonic() - before:.0f} s by the clock, {used.ru_maxrss / 1e6:.2f} GB")
