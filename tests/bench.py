"""Speed as ratios measured in one run: `make bench`.

CPU time of one thread. The candidates of a ratio take turns, so that a noisy machine disturbs them
alike; shown are the median and the range over the turns. No test looks at a clock.
"""

# ruff: noqa: E402  (threads are set before NumPy is imported)
from __future__ import annotations

import os

for _library in ("OMP", "OPENBLAS", "MKL", "VECLIB_MAXIMUM", "NUMEXPR"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"  # before NumPy is imported

import io
import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pinocchio as pin
import pyarrow as pa
import pyarrow.csv as pacsv

from actuators.loading.build import load_catalog
from pipeline.dynamics.joint_demand import MotionDemand, motion_demand
from pipeline.motion.gait import tripod_gait
from pipeline.motion.motion import Motion
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.simulation.walk_stand import joint_series
from reports.tables.walking import walking_joint_demand
from reports.writer import csv_bytes
from tests.bench_gap import gap_costs
from tests.bench_kinematics import inverse_kinematics

ROOT = Path(__file__).parents[1]
SAMPLES = 3000  # of the whole cycle
TURNS = 15
#: Aims of the project: (most, least).
DEMAND_OVER_RNEA = 2.2
LOOP_OVER_DEMAND = 7.0

Call = Callable[[], object]


def timed(calls: Mapping[str, Call], turns: int = TURNS) -> dict[str, list[float]]:
    """CPU seconds of each call, taking turns; one turn to warm up is not counted."""
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    for turn in range(turns + 1):
        for name, call in calls.items():
            start = time.process_time()
            call()
            if turn:
                seconds[name].append(time.process_time() - start)
    return seconds


def spread(values: list[float], digits: int = 2) -> str:
    """Median with range."""
    low, high = min(values), max(values)
    return f"{statistics.median(values):.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def ratio(over: list[float], under: list[float]) -> list[float]:
    """Turn by turn."""
    return [a / b for a, b in zip(over, under, strict=True)]


def bare_rnea(robot: Robot, motion: Motion) -> Call:
    """Pinocchio's batch alone, on the same samples."""
    pool = pin.ModelPool(robot.model, 1)
    inputs = [(s.configuration.T, s.velocity.T, s.acceleration.T) for s in motion.segments]

    def call() -> None:
        for q, v, a in inputs:
            pin.rneaInParallel(1, pool, q, v, a)

    return call


def user_loop(
    robot: Robot, motion: Motion, *, torques_only: bool
) -> Callable[[], list[np.ndarray]]:
    """What one would write first: rnea, frame Jacobians and lstsq, sample by sample.

    With three feet on one plane least squares over all forces is least squares over the tangential
    ones. The batch returns joint torques, foot forces and foot points of all legs; the loop returns
    the same, or, to be strict, does the least that gives torques.
    """
    model, data = robot.model, robot.model.createData()
    frames = [model.getFrameId(leg.foot) for leg in robot.spec.legs]
    world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

    def call() -> list[np.ndarray]:
        torques, forces, points = [], [], []
        for segment in motion.segments:
            stance = [robot.leg_names.index(leg) for leg in segment.stance]
            for q, v, a in zip(
                segment.configuration, segment.velocity, segment.acceleration, strict=True
            ):
                tau = pin.rnea(model, data, q, v, a)
                pin.computeJointJacobians(model, data, q)
                pin.updateFramePlacements(model, data)
                jacobian = np.vstack(
                    [pin.getFrameJacobian(model, data, frames[i], world)[:3] for i in stance]
                )
                force, *_ = np.linalg.lstsq(jacobian[:, :6].T, tau[:6], rcond=None)
                torques.append((tau - jacobian.T @ force)[robot.velocity_index])
                if not torques_only:
                    forces.append(np.zeros((len(frames), 3)))
                    forces[-1][stance] = force.reshape(-1, 3)
                    points.append(np.array([data.oMf[i].translation for i in frames]) - q[:3])
        return [np.array(torques), np.array(forces), np.array(points)]

    return call


def check_same(loop: list[np.ndarray], demand: MotionDemand) -> None:
    """Both ways give the same numbers, or the comparison means nothing."""
    contacts = [part for part in demand.contacts if part is not None]
    ours = (
        np.concatenate([part.torque for part in demand.segments]),
        np.concatenate([part.force_world for part in contacts]),
        np.concatenate([part.position for part in contacts]),
    )
    for theirs, own in zip(loop, ours, strict=True):
        np.testing.assert_allclose(theirs, own, atol=1e-8)


def demand_ratios(robot: Robot, motion: Motion) -> None:
    """Batch demand against bare RNEA, the user's loop, and the chains against the demand."""
    demand = motion_demand(robot, motion)
    check_same(user_loop(robot, motion, torques_only=False)(), demand)
    series = joint_series(demand)
    chains = load_catalog().chains()
    calls: dict[str, Call] = {
        "rnea": bare_rnea(robot, motion),
        "demand": lambda: motion_demand(robot, motion),
        "loop": user_loop(robot, motion, torques_only=True),
        "full loop": user_loop(robot, motion, torques_only=False),
        "split": lambda: joint_series(motion_demand(robot, motion)),
    }
    for name, chain in chains.items():
        calls[f"chain {name}"] = lambda chain=chain: chain.moving(series)  # type: ignore[misc]
    seconds = timed(calls)
    us = {name: [1e6 * s / motion.samples for s in values] for name, values in seconds.items()}
    print(f"hexapod, free-flyer, {motion.samples} samples, us per sample: median (range)")
    print(f"  bare rneaInParallel                  {spread(us['rnea'])}")
    print(f"  batch demand (contacts and RNEA)     {spread(us['demand'])}")
    print(f"  Python loop, torques only            {spread(us['loop'])}")
    print(f"  the same with foot forces and points {spread(us['full loop'])}")
    print("ratios")
    over_rnea = ratio(us["demand"], us["rnea"])
    over_demand = ratio(us["loop"], us["demand"])
    like = ratio(us["full loop"], us["demand"])
    print(f"  batch demand / bare rnea   {spread(over_rnea)}   aim: below {DEMAND_OVER_RNEA}")
    print(f"  torque loop / batch demand {spread(over_demand)}   aim: at least {LOOP_OVER_DEMAND}")
    print(f"  full loop / batch demand   {spread(like)}   the same results")
    print(f"chains, 18 joints, {series.time.size} rows after splitting at velocity zeros")
    for name in chains:
        own = [1e6 * s / series.time.size for s in seconds[f"chain {name}"]]
        relative = ratio(seconds[f"chain {name}"], seconds["demand"])
        print(f"  {name:13s} {spread(own)} us per row, {spread(relative)} of the batch demand")
    extra = [a - b for a, b in zip(seconds["split"], seconds["demand"], strict=True)]
    print(f"  splitting     {spread(ratio(extra, seconds['demand']))} of the batch demand")


def csv_ratio(robot: Robot, motion: Motion) -> None:
    """Our CSV against bare pyarrow on the same columns."""
    table = walking_joint_demand(motion_demand(robot, motion))
    columns = pa.table({name: pa.array(values) for name, values in table.columns.items()})

    def bare() -> None:
        pacsv.write_csv(columns, io.BytesIO())

    seconds = timed({"bare": bare, "ours": lambda: csv_bytes(table)}, turns=7)
    print(f"CSV of {table.rows} rows x {len(table.columns)} columns")
    relative = ratio(seconds["ours"], seconds["bare"])
    print(f"  ours / bare pyarrow write_csv {spread(relative)}")


#: Times the phases of one run from within, heavy imports first so that they are counted as such.
PHASES = """
import json, os, sys
clock = lambda: sum(os.times()[:4])  # the process that helps with the figures counted
marks = {"interpreter": clock()}
start = clock()
import numpy, pinocchio, pyarrow.csv, matplotlib.figure, matplotlib.backends.backend_agg
import matplotlib.backends.backend_svg, matplotlib.path
import pipeline.cli.main, pipeline.api.figures, pipeline.api.judgement, pipeline.cli.run as run
marks["imports"] = clock() - start
def count(module, name, phase):
    real = getattr(module, name)
    def wrapped(*args, **kwargs):
        begin = clock()
        try:
            return real(*args, **kwargs)
        finally:
            marks[phase] = marks.get(phase, 0.0) + clock() - begin
    setattr(module, name, wrapped)
count(run, "settings", "loading")
count(run, "stand", "computing")
count(run, "walk", "computing")
count(run, "write_table", "CSV and sidecars")
count(pipeline.api.judgement, "judged", "judging")
count(pipeline.api.figures, "write_figures", "figures")
count(pipeline.api.judgement, "pages", "pages")
begin = clock()
sys.stdout = sys.stderr
code = pipeline.cli.main.main(sys.argv[1:])
marks["the rest"] = clock() - begin - sum(
    marks.get(phase, 0.0)
    for phase in ("loading", "computing", "CSV and sidecars", "judging", "figures", "pages")
)
sys.__stdout__.write(json.dumps(marks))
sys.exit(code)
"""


def cold_run() -> None:
    """Where one `make reports` in a new process spends its CPU time."""
    with tempfile.TemporaryDirectory() as folder:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(
            [sys.executable, "-c", PHASES, "reports", "--out", folder],
            cwd=ROOT,
            check=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    phases = json.loads(done.stdout)
    total = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"a cold `make reports`: {total:.1f} s of CPU time")
    for name, seconds in phases.items():
        print(f"  {name:17s} {100 * seconds / total:5.1f} %   {seconds:.2f} s")


def main() -> None:
    """Print everything."""
    robot = load_robot(load_robot_file(ROOT / "urdf" / "hexapod.toml"))
    motion = tripod_gait(robot, samples=SAMPLES // 2)
    demand_ratios(robot, motion)
    inverse_kinematics(ROOT, timed)
    csv_ratio(robot, motion)
    cold_run()
    gap_costs()


if __name__ == "__main__":
    main()
