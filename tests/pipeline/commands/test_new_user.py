"""What a new user's files may be: a URDF, meshes that are nowhere."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.command_line import Command, rows_of
from tests.pipeline.commands.robots import own_robot


def test_own_urdf_walks_like_the_built_one(
    root: Path, tmp_path: Path, command: Command, out: Path
) -> None:
    """The robot of the refusals above is sound before it is spoilt, and gives the same numbers."""
    assert command("stand", tmp_path, robot=own_robot(root, tmp_path, "</robot>", "</robot>")) == 0
    for own, built in zip(
        rows_of(tmp_path / "standing.csv"), rows_of(out / "standing.csv"), strict=True
    ):
        for column, value in built.items():
            if column in ("alternative", "joint"):
                assert own[column] == value
            else:
                assert float(own[column]) == pytest.approx(float(value), rel=1e-6, abs=1e-9)


def test_cost_of_transport_has_the_mass_of_the_forces(
    root: Path, tmp_path: Path, command: Command
) -> None:
    """Stated masses are rounded: within half a percent the URDF's own counts, everywhere."""
    pattern = r'(<link name="base_link">.*?<mass value=)"([\d.]+)"'
    robot = own_robot(root, tmp_path, pattern, r'\1"24.15"')
    # Without the links' inertia the feet carry the weight alone.
    assert command("walk", tmp_path, "--quasi-static", robot=robot) == 0
    forces = rows_of(tmp_path / "walking_contact_forces.csv")
    weight = sum(float(forces[0][k] or 0) for k in forces[0] if k.endswith("__force_z_N"))
    assert weight != pytest.approx(40 * 9.81, rel=1e-3)
    for row in rows_of(tmp_path / "robot_energy.csv"):
        transport = float(row["average_power_W"]) / (weight * 0.16)
        assert float(row["cost_of_transport"]) == pytest.approx(transport, rel=1e-6)


@pytest.mark.usefixtures("sketched")
def test_a_robot_of_ones_own_is_reported(
    root: Path, tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    """Meshes that are nowhere are skipped, legs are sticks; nothing is held against a paper."""
    robot = own_robot(root, tmp_path, "</robot>", "</robot>")
    urdf = tmp_path / "own.urdf"
    mesh = '<mesh filename="package://nowhere/link.stl"/>'
    text = re.sub(r"<(box|sphere) [^>]*/>", mesh, urdf.read_text(encoding="utf-8"))
    urdf.write_text(text, encoding="utf-8")
    assert command("reports", tmp_path / "out", "--samples", "51", robot=robot) == 0
    assert capsys.readouterr().err == ""
    for figure in ("robot", "gait"):
        assert (tmp_path / "out" / f"{figure}.svg").exists()
    assert not (tmp_path / "out" / "reproduction.csv").exists()
