"""Speed as ratios measured in one run: `make bench`.

Each row sets what the project does against the bare library below it: CPU time of one thread, the
two taking turns, so that a noisy machine disturbs them alike; shown are the median and the range
over the turns. No test looks at a clock.
"""

# ruff: noqa: E402  (threads are set before NumPy is imported)
import os

for _library in ("OMP", "OPENBLAS", "MKL", "VECLIB_MAXIMUM", "NUMEXPR"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pinocchio as pin

import pipeline as lw
from pipeline.dynamics.joint_demand import motion_demand
from pipeline.motion.walking import walking_motion
from tests.command_line import DEMO

ROOT = Path(__file__).parents[1]
Call = Callable[[], object]


def cpu(call: Call) -> float:
    """CPU seconds of a call, those of its processes counted."""
    before = time.process_time() + sum(os.times()[2:4])
    call()
    return time.process_time() + sum(os.times()[2:4]) - before


def show(name: str, ours: Call, against: str, other: Call, turns: int = 9) -> None:
    """Measure and print a row; one turn to warm up is not counted."""
    pairs = [(cpu(ours), cpu(other)) for _ in range(turns + 1)][1:]
    own, ratios = statistics.median(a for a, _ in pairs), sorted(b / a for a, b in pairs)
    middle = statistics.median(ratios)
    times = f"{middle:.3g} times as long ({ratios[0]:.3g} to {ratios[-1]:.3g})"
    print(f"{name:44s} {1e3 * own:9.1f} ms   {against} takes {times}", flush=True)


def main() -> None:
    """Print every row."""
    for name in ("hexapod", "solo12", "anymal_c"):
        machine = lw.load(ROOT / "urdf" / f"{name}.toml")
        robot, demand = machine.robot, lw.demand(machine, samples=51)
        motion, pool = walking_motion(robot, samples=1500), pin.ModelPool(robot.model, 1)

        def batch(motion=motion, pool=pool) -> None:
            for s in motion.segments:
                pin.rneaInParallel(1, pool, s.configuration.T, s.velocity.T, s.acceleration.T)

        own = partial(motion_demand, robot, motion)
        show(f"{name}: demand of 1 cycle", own, "bare rneaInParallel", batch)
        energy = partial(lw.energy, machine, demand)
        show(f"{name}: energy of all options, 51 samples", energy, "the demand", own)

    def python(*words: str) -> None:
        subprocess.run([sys.executable, *words], cwd=ROOT, check=False, stdout=subprocess.DEVNULL)

    bare = partial(python, "-c", "import numpy, scipy.optimize, pinocchio, pyarrow, matplotlib")
    with tempfile.TemporaryDirectory() as folder:
        for words in (["reports"], ["gap", str(DEMO)], ["choose"]):
            run = partial(python, "-m", "pipeline", *words, "--out", f"{folder}/{words[0]}")
            show(f"cold: {words[0]}", run, "importing the libraries", bare, turns=1)


if __name__ == "__main__":
    main()
