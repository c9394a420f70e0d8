"""The committed robots: built from their TOML, physical, and read alike by others."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.dynamics.joint_demand import check_with_gait
from pipeline.robot.robot_file import load_robot_file
from pipeline.robot.urdf_builder import build_urdf

ROBOTS = ["hexapod.toml", "hexapod_axis90.toml", "leg.toml"]


@pytest.mark.parametrize("name", ROBOTS)
def test_committed_robots_are_built_from_their_files_and_pass_every_check(
    root: Path, name: str
) -> None:
    spec = load_robot_file(root / "urdf" / name)
    assert spec.urdf.read_text(encoding="utf-8") == build_urdf(spec), "run `make urdf`"
    assert not [f for f in check_with_gait(root / "urdf" / name) if not f.passed]
