"""Speed as ratios measured in one run: `make bench`.

Each row sets what the project does against what one would write first, or against the bare library
below it: CPU time of one thread, the two taking turns, so that a noisy machine disturbs them alike;
shown are the median and the range over the turns. No test looks at a clock.
"""

# ruff: noqa: E402  (threads are set before NumPy is imported)
from __future__ import annotations

import os

for _library in ("OMP", "OPENBLAS", "MKL", "VECLIB_MAXIMUM", "NUMEXPR"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"  # before NumPy is imported

import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

import pipeline as lw
from actuators.loading.build import load_catalog
from actuators.loading.parts import load_parts
from pipeline.choice.loads import loads_of
from pipeline.choice.missions.mission import Mode
from pipeline.choice.parts.shelf import Shelf, combinations
from pipeline.choice.search import Demanded, torque_rms
from pipeline.dynamics.joint_demand import motion_demand
from pipeline.logs.formats.bags import JOINTS, read_bag
from pipeline.logs.formats.spool import Spool
from pipeline.motion.motion import Motion
from pipeline.motion.walking import walking_motion
from pipeline.robot.inverse.inverse_kinematics import neutral_postures, reach, solve_rates
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.simulation.walk_stand import joint_series
from pipeline.sweeps.sweep import Order, machine_of, sweep
from tests.demo import DEMO

ROOT = Path(__file__).parents[1]
Array = NDArray[np.float64]
Call = Callable[[], object]
WORLD = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


@dataclass(frozen=True)
class Row:
    """One ratio.

    Attributes:
        name: What is done.
        ours: Does it.
        against: What the other is.
        other: Does it.
        share: Of the work of `ours` that `other` does; its time is scaled up.
        turns: How often.
    """

    name: str
    ours: Call
    against: str
    other: Call
    share: float = 1.0
    turns: int = 9


def cpu(call: Call) -> float:
    """CPU seconds of a call, those of its processes counted."""

    def spent() -> float:
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        return time.process_time() + children.ru_utime + children.ru_stime

    before = spent()
    call()
    return spent() - before


def show(row: Row) -> None:
    """Measure and print a row; one turn to warm up is not counted."""
    pairs = [(cpu(row.ours), cpu(row.other)) for _ in range(row.turns + 1)][1:]
    ours = statistics.median(a for a, _ in pairs)
    ratios = [b / row.share / a for a, b in pairs]
    low, high = min(ratios), max(ratios)
    print(
        f"{row.name:44s} {1e3 * ours:9.1f} ms   {row.against} takes "
        f"{statistics.median(ratios):.3g} times as long ({low:.3g} to {high:.3g})",
        flush=True,
    )


def demand_rows(name: str) -> Iterator[Row]:
    """Joint demand against bare inverse dynamics and the loop that one would write first."""
    robot = load_robot(load_robot_file(ROOT / "urdf" / f"{name}.toml"))
    motion = walking_motion(robot, samples=1500)
    segments = [(s.configuration, s.velocity, s.acceleration) for s in motion.segments]
    pool = pin.ModelPool(robot.model, 1)

    def batch() -> None:
        for q, v, a in segments:
            pin.rneaInParallel(1, pool, q.T, v.T, a.T)

    def demand() -> object:
        return motion_demand(robot, motion)

    loop = np.array(user_loop(robot, motion, motion.samples))
    ours = np.concatenate([part.torque for part in motion_demand(robot, motion).segments])
    np.testing.assert_allclose(loop, ours, atol=1e-8)
    yield Row(f"{name}: demand of 1 cycle", demand, "bare rneaInParallel", batch)
    few = motion.samples // 10
    yield Row(
        f"{name}: demand of 1 cycle",
        demand,
        "a Python loop (rnea, Jacobians, lstsq)",
        lambda: user_loop(robot, motion, few),
        few / motion.samples,
    )
    if name == "hexapod":
        series = joint_series(motion_demand(robot, motion))
        for title, chain in load_catalog().chains().items():
            yield Row(f"actuator '{title}'", partial(chain.inverse, series), "the demand", demand)


def user_loop(robot: Robot, motion: Motion, samples: int) -> list[Array]:
    """Torques of the first samples: rnea, frame Jacobians and lstsq, one after the other.

    With feet on one plane least squares over all forces is least squares over the tangential ones
    and over the normal ones.
    """
    model, data = robot.model, robot.model.createData()
    torques: list[Array] = []
    for segment in motion.segments:
        frames = [
            model.getFrameId(leg.foot) for leg in robot.spec.legs if leg.name in segment.stance
        ]
        rows = zip(segment.configuration, segment.velocity, segment.acceleration, strict=True)
        for q, v, a in rows:
            if len(torques) == samples:
                return torques
            tau = pin.rnea(model, data, q, v, a)
            pin.computeJointJacobians(model, data, q)
            pin.updateFramePlacements(model, data)
            jacobian = np.vstack([pin.getFrameJacobian(model, data, f, WORLD)[:3] for f in frames])
            force, *_ = np.linalg.lstsq(jacobian[:, :6].T, tau[:6], rcond=None)
            torques.append((tau - jacobian.T @ force)[robot.velocity_index])
    return torques


def kinematics_rows(name: str) -> Iterator[Row]:
    """Inverse kinematics of a closed path, a tenth of the reach wide, against Pinocchio's forward.

    The loop evaluates feet and Jacobians once per sample; a solver of its own would do so often.
    """
    robot = load_robot(load_robot_file(ROOT / "urdf" / f"{name}.toml"))
    chains, start, time_ = robot.chains, neutral_postures(robot), np.linspace(0.0, 1.0, 1501)
    angle = 2 * np.pi * time_[:, None, None]
    size = 0.1 * chains.reach[:, None] * np.array([0.5, 0.1, 0.25])
    shift = np.concatenate([np.sin(angle), np.sin(angle), 1 - np.cos(angle)], axis=-1)
    speed = np.concatenate([np.cos(angle), np.cos(angle), np.sin(angle)], axis=-1)
    target, velocity = foot_positions(chains, start[None]) + size * shift, 2 * np.pi * size * speed
    still = np.zeros_like(velocity)
    q, _ = reach(chains, target, start)
    model, data = robot.model, robot.model.createData()
    frames = [model.getFrameId(leg.foot) for leg in robot.spec.legs]
    rows = robot.configuration(robot.joint_positions(q))

    def ours() -> None:
        solve_rates(chains, reach(chains, target, start)[0], velocity, still, time_)

    def pinocchio() -> None:
        for row in rows:
            pin.computeJointJacobians(model, data, row)
            pin.updateFramePlacements(model, data)
            for frame in frames:
                pin.getFrameJacobian(model, data, frame, WORLD)

    yield Row(f"{name}: inverse kinematics, 1501 samples", ours, "Pinocchio forward", pinocchio)


def sweep_rows() -> Iterator[Row]:
    """A sweep against the same walks without rows, parts and file."""
    speeds = [0.02 + 0.02 * k for k in range(8)]  # [m/s]
    order = Order(samples=51)
    varied = machine_of(order)

    def walks() -> None:
        for speed in speeds:
            given = order.walking(varied.with_values({"gait.speed": f"{speed!r} m/s"}))
            given.walk(given.chains())

    def swept() -> None:
        with tempfile.TemporaryDirectory() as folder:
            sweep(order, ["speed=" + ",".join(map(repr, speeds)) + " m/s"], Path(folder))

    yield Row("sweep of 8 speeds, 4 alternatives", swept, "the walks alone", walks, turns=5)


def choice_rows() -> Iterator[Row]:
    """Net energy and RMS of many designs against a loop over designs."""
    walk = Mode("walk", 24.0, False, None, {}, "motor", True, "walking")
    loads = loads_of(lw.load(ROOT / "urdf" / "hexapod.toml"), [walk], samples=101)
    series, duration = loads[0].series, loads[0].duration
    demanded = Demanded.of("all", series.joints, loads)
    shelf = Shelf.of(load_parts())
    designs = shelf.designs(combinations(shelf))
    many, few = designs.taken(np.arange(1_000_000) % len(designs)), 300
    one = designs.taken(np.arange(few) % len(designs))  # a number of all is computed at each call
    tau, w, a = series.torque, series.velocity, series.acceleration

    def net_and_rms() -> None:
        demanded.net(many)
        torque_rms(demanded.tracks[0], many)

    def one_by_one() -> None:
        for i in range(few):
            n, s = one.ratio[i], np.sign(w)
            t = tau / n + one.load[i] / n * np.abs(tau) * s + one.coulomb[i] * s
            t = t + one.viscous[i] * n * w + one.inertia[i] * n * a
            power = (t * n * w + one.ohmic[i] * t**2).sum(axis=1)
            np.trapezoid(power, series.time) / duration
            np.sqrt(np.trapezoid(t**2, series.time, axis=0) / duration)

    share = few / len(many)
    yield Row("net energy and RMS of 1e6 designs", net_and_rms, "a loop", one_by_one, share, 3)


def bag_rows(folder: Path) -> Iterator[Row]:
    """A bag of 100 000 joint states at 1 kHz against the library's own messages."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    names, zeros = [f"leg_{k // 3}_joint_{k % 3}" for k in range(12)], np.zeros(12)
    stamp, head = (store.types[k] for k in ("builtin_interfaces/msg/Time", "std_msgs/msg/Header"))
    state, path = store.types[JOINTS], folder / "bag"
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topic = writer.add_connection("/joint_states", JOINTS, typestore=store)
        for k in range(100_000):
            now = 10**18 + k * 10**6
            message = state(head(stamp(now // 10**9, now % 10**9), ""), names, *[zeros + k] * 3)
            writer.write(topic, now, store.serialize_cdr(message, JOINTS))

    def ours() -> None:
        with Spool(folder) as spool:
            read_bag(path, spool)

    def messages() -> None:
        with Reader(path) as reader:
            for _, _, raw in reader.messages():
                store.deserialize_cdr(raw, JOINTS)

    yield Row("bag of 100 000 joint states", ours, "rosbags' own messages", messages, turns=3)


def cold_rows(folder: Path) -> Iterator[Row]:
    """Whole commands, in new processes, against importing the libraries that they stand on."""

    def python(*words: str) -> None:
        subprocess.run([sys.executable, *words], cwd=ROOT, check=False, stdout=subprocess.DEVNULL)

    bare = partial(python, "-c", "import numpy, scipy.optimize, pinocchio, pyarrow, matplotlib")
    for name, words in (
        ("reports", ["reports"]),
        ("the demonstration of gap", ["gap", str(DEMO)]),
        ("choose", ["choose"]),
    ):
        run = partial(python, "-m", "pipeline", *words, "--out", str(folder / words[0]))
        yield Row(f"cold: {name}", run, "importing the libraries", bare, turns=1)


def main() -> None:
    """Print every row."""
    with tempfile.TemporaryDirectory() as folder:
        for case in (
            *(partial(demand_rows, name) for name in ("hexapod", "solo12", "anymal_c")),
            *(partial(kinematics_rows, name) for name in ("hexapod", "solo12", "anymal_c")),
            *(sweep_rows, choice_rows),
            *(partial(bag_rows, Path(folder)), partial(cold_rows, Path(folder))),
        ):
            for row in case():
                show(row)


if __name__ == "__main__":
    main()
