from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.blind.twin.machine import Machine, load_machine
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file


@pytest.fixture(scope="session")
def leg(root: Path) -> Robot:
    return load_robot(load_robot_file(root / "urdf" / "leg.toml"))


@pytest.fixture(scope="session")
def machine() -> Machine:
    return load_machine()
