"""Fixtures shared by the tests of the paper's room."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from actuators.loading.build import Catalog, load_catalog
from pipeline.paper.calibration.prior import Prior, load_prior
from pipeline.paper.calibration.store import load_results
from pipeline.paper.hexapod import RobotPart, robot_part
from pipeline.paper.judgement.basis import Basis
from pipeline.paper.judgement.judge import Judgement, judge
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
    return load_results()


@pytest.fixture(scope="session")
def judgement(
    hexapod: Robot,
    catalog: Catalog,
    published: dict[str, Published],
    prior: Prior,
    results: dict[str, Any],
) -> Judgement:
    """Of the files as they are."""
    return judge(hexapod, Basis(published, prior, results, (), catalog), samples=151)
