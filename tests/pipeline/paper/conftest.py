"""Fixtures shared by the tests of the paper's room."""

import json
from pathlib import Path
from typing import Any

import pytest

from actuators.loading.build import Catalog, load_catalog
from pipeline.paper.hexapod import RobotPart, robot_part
from pipeline.paper.judgement import STUDY, Judgement, judge
from pipeline.paper.published import Published, load_published
from pipeline.robot.robot import Robot
from pipeline.robot.robot_file import RobotSpec, load_robot_file


@pytest.fixture(scope="session")
def spec(root: Path) -> RobotSpec:
    return load_robot_file(root / "urdf" / "hexapod.toml")


@pytest.fixture(scope="session")
def catalog() -> Catalog:
    return load_catalog()


@pytest.fixture(scope="session")
def part(spec: RobotSpec) -> RobotPart:
    return robot_part(spec)


@pytest.fixture(scope="session")
def published() -> dict[str, Published]:
    return load_published()


@pytest.fixture(scope="session")
def study() -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads((STUDY / "fitted.json").read_text(encoding="utf-8"))
    return loaded


@pytest.fixture(scope="session")
def judgement(hexapod: Robot, catalog: Catalog, study: dict[str, Any]) -> Judgement:
    """Of the files as they are."""
    return judge(hexapod, Judgement(study, catalog, ""), samples=151)
