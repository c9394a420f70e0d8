"""The committed robots: built from their TOML, physical, and read alike by others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.robot.check import check_file, check_robot
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.robot.urdf_builder import build_urdf, main

ROBOTS = ["hexapod.toml", "hexapod_axis90.toml", "leg.toml"]


@pytest.mark.parametrize("name", ROBOTS)
def test_the_committed_urdf_is_not_stale(root: Path, name: str) -> None:
    spec = load_robot_file(root / "urdf" / name)
    assert spec.urdf.read_text(encoding="utf-8") == build_urdf(spec), "run `make urdf`"


def test_every_urdf_has_a_robot_file(root: Path) -> None:
    specs = [load_robot_file(p) for p in (root / "urdf").glob("*.toml")]
    assert {p.name for p in (root / "urdf").glob("*.urdf")} <= {spec.urdf.name for spec in specs}


@pytest.mark.parametrize("name", ROBOTS)
def test_committed_robots_pass_every_check(root: Path, name: str) -> None:
    failed = [f for f in check_file(root / "urdf" / name) if not f.passed]
    assert not failed


@pytest.mark.parametrize("name", ROBOTS)
def test_mass_is_the_stated_mass(root: Path, name: str) -> None:
    robot = load_robot(load_robot_file(root / "urdf" / name))
    total = sum(inertia.mass for inertia in robot.model.inertias)
    assert total == pytest.approx(robot.spec.parameters["total_mass"], rel=1e-9)


def test_axis_variants_share_the_zero_pose(root: Path) -> None:
    """The angle of joint 1's axis changes nothing at zero."""
    from pipeline.robot.kinematics import foot_positions

    feet = [
        foot_positions(robot.chains, np.zeros((1, 6, 3)))
        for robot in (load_robot(load_robot_file(root / "urdf" / n)) for n in ROBOTS[:2])
    ]
    np.testing.assert_allclose(feet[0], feet[1], atol=1e-12)
    assert check_robot(load_robot(load_robot_file(root / "urdf" / ROBOTS[1])))


def test_building_says_what_it_built_and_what_not(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own, built = root / "urdf" / "solo12.toml", tmp_path / "hexapod.toml"
    built.write_bytes((root / "urdf" / "hexapod.toml").read_bytes())
    assert main([str(own), str(built)]) == 0
    first, second = capsys.readouterr().out.splitlines()
    assert first == f"{own}: nothing built, its URDF solo12.urdf is its own"
    assert second == f"{tmp_path / 'hexapod.urdf'}: built from {built}"
    assert main([str(tmp_path / "none.toml")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
