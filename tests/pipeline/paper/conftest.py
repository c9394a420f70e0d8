"""Fixtures shared by the tests of the paper's room."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from actuators.loading.build import Catalog, load_catalog
from pipeline.paper.hexapod import RobotPart, robot_part
from pipeline.paper.judgement.basis import STUDY, Basis
from pipeline.paper.judgement.judge import Judgement, judge
from pipeline.paper.prior import Prior, load_prior
from pipeline.paper.published import Published, load_published
from pipeline.robot.robot import Robot
from pipeline.robot.robot_file import RobotSpec, load_robot_file


@pytest.fixture(scope="session")
def robot_file(root: Path) -> str:
    return str(root / "urdf" / "hexapod.toml")


@pytest.fixture(scope="session")
def spec(robot_file: str) -> RobotSpec:
    return load_robot_file(Path(robot_file))


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
def prior() -> Prior:
    return load_prior()


@pytest.fixture(scope="session")
def results() -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads((STUDY / "fitted.json").read_text(encoding="utf-8"))
    return loaded


@pytest.fixture(scope="session")
def judgement(
    hexapod: Robot,
    catalog: Catalog,
    published: dict[str, Published],
    results: dict[str, Any],
) -> Judgement:
    """Of the files as they are."""
    return judge(hexapod, Basis(published, results, (), catalog), samples=151)
