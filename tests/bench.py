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
import subprocess
import sys
import tempfile
from pathlib import Path

import pyarrow as pa
import pyarrow.csv as pacsv

import pipeline as lw
from actuators.loading.build import load_catalog
from pipeline.dynamics.joint_demand import motion_demand
from pipeline.motion.motion import Motion
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.simulation.walk_stand import joint_series
from reports.tables.walking import walking_joint_demand
from reports.writer import csv_bytes
from tests.bench_bags import bag_costs
from tests.bench_choice import choice_ratios
from tests.bench_demand import demand_ratios, support
from tests.bench_gap import gap_costs
from tests.bench_kinematics import inverse_kinematics
from tests.bench_supply import supply_ratios, sweep_ratio
from tests.bench_timing import Call, ratio, spread, timed

ROOT = Path(__file__).parents[1]
SAMPLES = 3000  # of the whole cycle
QUADRUPEDS = ("solo12", "anymal_c")


def chain_ratios(robot: Robot, motion: Motion) -> None:
    """The actuators against the batch demand."""
    series = joint_series(motion_demand(robot, motion))
    chains = load_catalog().chains()
    calls: dict[str, Call] = {
        "demand": lambda: motion_demand(robot, motion),
        "split": lambda: joint_series(motion_demand(robot, motion)),
    }
    for name, chain in chains.items():
        calls[name] = lambda chain=chain: chain.inverse(series)  # type: ignore[misc]
    seconds = timed(calls)
    joints = len(robot.joints)
    print(f"chains, {joints} joints, {series.time.size} rows after splitting at velocity zeros")
    for name in chains:
        own = [1e6 * s / series.time.size for s in seconds[name]]
        relative = ratio(seconds[name], seconds["demand"])
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


def energy_of_a_search() -> None:
    """What a search repeats: energy of a demand, and of a machine with one number changed."""
    machine = lw.load(ROOT / "urdf" / "hexapod.toml")
    demand = lw.demand(machine, samples=51)
    calls: dict[str, Call] = {
        "all alternatives": lambda: lw.energy(machine, demand),
        "one alternative": lambda: lw.energy(machine, demand, "reversible"),
        "one, a number changed": lambda: lw.energy(
            machine.with_values({"harmonic_drive.viscous": 1.0}), demand, "reversible"
        ),
        "the bare chain": lambda: machine.ready.chain("reversible").inverse(demand.series),
    }
    print("energy of 51 samples of 18 joints, no file read")
    for name, seconds in timed(calls, turns=200).items():
        print(f"  {name:21s} {spread([1e3 * s for s in seconds])} ms")


#: Module, function in it, and the phase of a run that its CPU time counts for.
COUNTED = (
    ("pipeline.cli.walking", "settings_of", "loading"),
    ("pipeline.api.reports", "stood", "computing"),
    ("pipeline.api.reports", "walked", "computing"),
    ("pipeline.api.reports", "write_table", "CSV and sidecars"),
    ("pipeline.api.judgement", "judged", "judging"),
    ("pipeline.api.figures", "write_figures", "figures"),
    ("reports.pages.summary", "summary", "pages"),
    ("reports.page", "write_page", "pages"),
)
#: Times the phases of one run from within, heavy imports first so that they are counted as such.
PHASES = """
import importlib, json, os, sys
clock = lambda: sum(os.times()[:4])  # the process that helps with the figures counted
marks = {"interpreter": clock()}
start = clock()
import numpy, pinocchio, pyarrow.csv, matplotlib.figure, matplotlib.backends.backend_agg
import matplotlib.backends.backend_svg, matplotlib.path
import pipeline.cli.main
counted = json.loads(sys.argv.pop(1))
modules = [importlib.import_module(module) for module, _, _ in counted]
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
for module, (_, name, phase) in zip(modules, counted):
    count(module, name, phase)
begin = clock()
sys.stdout = sys.stderr
code = pipeline.cli.main.main(sys.argv[1:])
marks["the rest"] = clock() - begin - sum(
    marks.get(phase, 0.0) for phase in {phase for _, _, phase in counted}
)
sys.__stdout__.write(json.dumps(marks))
sys.exit(code)
"""


def cold_run() -> None:
    """Where one `make reports` in a new process spends its CPU time."""
    with tempfile.TemporaryDirectory() as folder:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(
            [sys.executable, "-c", PHASES, json.dumps(COUNTED), "reports", "--out", folder],
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
    for name in QUADRUPEDS:
        four = load_robot(load_robot_file(ROOT / "urdf" / f"{name}.toml"))
        demand_ratios(name, four, support(four, SAMPLES))
    robot = load_robot(load_robot_file(ROOT / "urdf" / "hexapod.toml"))
    motion = walking_motion(robot, samples=SAMPLES // 2)
    demand_ratios("hexapod", robot, motion)
    inverse_kinematics(ROOT, timed)
    chain_ratios(robot, motion)
    csv_ratio(robot, motion)
    energy_of_a_search()
    sweep_ratio()
    supply_ratios()
    choice_ratios()
    cold_run()
    gap_costs()
    bag_costs()


if __name__ == "__main__":
    main()
