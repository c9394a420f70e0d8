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
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.loading.build import load_catalog
from pipeline.dynamics.joint_demand import motion_demand
from pipeline.motion.motion import Motion
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.simulation.walk_stand import joint_series
from tests.demo import DEMO

ROOT = Path(__file__).parents[1]
WORLD = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


class Row(NamedTuple):
    """One ratio."""

    name: str  #: What is done.
    ours: Callable[[], object]  #: Does it.
    against: str  #: What the other is.
    other: Callable[[], object]  #: Does it.
    share: float = 1.0  #: Of the work of `ours` that `other` does; its time is scaled up.
    turns: int = 9  #: How often.


def cpu(call: Callable[[], object]) -> float:
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
    print(
        f"{row.name:44s} {1e3 * ours:9.1f} ms   {row.against} takes "
        f"{statistics.median(ratios):.3g} times as long ({min(ratios):.3g} to {max(ratios):.3g})",
        flush=True,
    )


def demand_rows(name: str) -> Iterator[Row]:
    """Joint demand against bare inverse dynamics and the loop that one would write first."""
    robot = load_robot(load_robot_file(ROOT / "urdf" / f"{name}.toml"))
    motion = walking_motion(robot, samples=1500)
    pool = pin.ModelPool(robot.model, 1)
    title, demand = f"{name}: demand of 1 cycle", partial(motion_demand, robot, motion)

    def batch() -> None:
        for s in motion.segments:
            pin.rneaInParallel(1, pool, s.configuration.T, s.velocity.T, s.acceleration.T)

    ours = np.concatenate([part.torque for part in demand().segments])
    np.testing.assert_allclose(user_loop(robot, motion, motion.samples), ours, atol=1e-8)
    yield Row(title, demand, "bare rneaInParallel", batch)
    few = motion.samples // 10
    loop = partial(user_loop, robot, motion, few)
    yield Row(title, demand, "a Python loop (rnea, Jacobians, lstsq)", loop, few / motion.samples)
    if name == "hexapod":
        series = joint_series(demand())
        for title, chain in load_catalog().chains().items():
            yield Row(f"actuator '{title}'", partial(chain.inverse, series), "the demand", demand)


def user_loop(robot: Robot, motion: Motion, samples: int) -> list[NDArray[np.float64]]:
    """Torques of the first samples: rnea, frame Jacobians and lstsq, one after the other.

    With feet on one plane least squares over all forces is least squares over the tangential ones
    and over the normal ones.
    """
    model, data = robot.model, robot.model.createData()
    torques: list[NDArray[np.float64]] = []
    for s in motion.segments:
        frames = [model.getFrameId(leg.foot) for leg in robot.spec.legs if leg.name in s.stance]
        for q, v, a in zip(s.configuration, s.velocity, s.acceleration, strict=True):
            if len(torques) == samples:
                return torques
            tau = pin.rnea(model, data, q, v, a)
            pin.computeJointJacobians(model, data, q)
            pin.updateFramePlacements(model, data)
            jacobian = np.vstack([pin.getFrameJacobian(model, data, f, WORLD)[:3] for f in frames])
            force, *_ = np.linalg.lstsq(jacobian[:, :6].T, tau[:6], rcond=None)
            torques.append((tau - jacobian.T @ force)[robot.velocity_index])
    return torques


def cold_rows(folder: Path) -> Iterator[Row]:
    """Whole commands, in new processes, against importing the libraries that they stand on."""

    def python(*words: str) -> None:
        subprocess.run([sys.executable, *words], cwd=ROOT, check=False, stdout=subprocess.DEVNULL)

    bare = partial(python, "-c", "import numpy, scipy.optimize, pinocchio, pyarrow, matplotlib")
    for words in (["reports"], ["gap", str(DEMO)], ["choose"]):
        run = partial(python, "-m", "pipeline", *words, "--out", str(folder / words[0]))
        yield Row(f"cold: {words[0]}", run, "importing the libraries", bare, turns=1)


def main() -> None:
    """Print every row."""
    with tempfile.TemporaryDirectory() as folder:
        robots = (partial(demand_rows, name) for name in ("hexapod", "solo12", "anymal_c"))
        for case in (*robots, partial(cold_rows, Path(folder))):
            for row in case():
                show(row)


if __name__ == "__main__":
    main()
