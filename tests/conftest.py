"""Fixtures shared by all rooms."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

from pipeline.dynamics.joint_demand import MotionDemand, motion_demand
from pipeline.motion.motion import Motion
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from tests.command_line import Command, exit_code, stand_and_walk

# No clock in a test: a loaded machine is no failure.
settings.register_profile("legwatt", deadline=None)
settings.load_profile("legwatt")

ROOT = Path(__file__).parents[1]
os.environ.setdefault("MPLBACKEND", "Agg")


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def hexapod() -> Robot:
    return load_robot(load_robot_file(ROOT / "urdf" / "hexapod.toml"))


@pytest.fixture(scope="session")
def walk(hexapod: Robot) -> Motion:
    return walking_motion(hexapod)


@pytest.fixture(scope="session")
def walk_demand(hexapod: Robot, walk: Motion) -> MotionDemand:
    return motion_demand(hexapod, walk)


@pytest.fixture(scope="session")
def command(root: Path) -> Command:
    def run(verb: str, out: Path, *more: str, robot: str | Path = "hexapod.toml") -> int:
        return exit_code([verb, "--robot", str(root / "urdf" / robot), "--out", str(out), *more])

    return run


@pytest.fixture(scope="session")
def out(tmp_path_factory: pytest.TempPathFactory, command: Command) -> Path:
    """The tables of standing and walking with every option at its default."""
    return stand_and_walk(tmp_path_factory.mktemp("out"), command)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the measured logs of real machines."""
    root = os.environ.get("LEGWATT_SHARED")
    if not root or not (Path(root) / "data").is_dir():
        pytest.skip("LEGWATT_SHARED does not name the folder of the measured logs")
    return Path(root) / "data"
