"""The committed robots: built from their TOML, physical, and read alike by others."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.dynamics.joint_demand import check_with_gait
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.robot.urdf_builder import build_urdf, main

ROBOTS = ["hexapod.toml", "hexapod_axis90.toml", "leg.toml"]


@pytest.mark.parametrize("name", ROBOTS)
def test_committed_robots_are_built_from_their_files_and_pass_every_check(
    root: Path, name: str
) -> None:
    spec = load_robot_file(root / "urdf" / name)
    assert spec.urdf.read_text(encoding="utf-8") == build_urdf(spec), "run `make urdf`"
    assert not [f for f in check_with_gait(root / "urdf" / name) if not f.passed]
    mass = load_robot(spec).mass
    assert mass == pytest.approx(spec.parameters["total_mass"], rel=1e-9)


def test_every_urdf_has_a_robot_file(root: Path) -> None:
    specs = [load_robot_file(p) for p in (root / "urdf").glob("*.toml")]
    assert {p.name for p in (root / "urdf").glob("*.urdf")} <= {spec.urdf.name for spec in specs}


def test_building_says_what_it_built(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own, built = root / "urdf" / "solo12.toml", tmp_path / "hexapod.toml"
    built.write_bytes((root / "urdf" / "hexapod.toml").read_bytes())
    assert main([str(own), str(built)]) == 0
    assert capsys.readouterr().out == f"{tmp_path / 'hexapod.urdf'}: built from {built}\n"
    assert main([str(tmp_path / "none.toml")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
