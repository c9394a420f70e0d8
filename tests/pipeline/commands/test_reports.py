"""`reports` from the outside: every table, every figure, twice the same; of robots of one's own."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from tests.command_line import Command
from tests.pipeline.commands.robots import own_robot
from tests.reports.read_page import checked

FIGURES = (
    "joint_demand",  # Fig. 2 to 4
    *("stage_energy_reversible", "stage_energy_irreversible"),  # Fig. 18 and 20
    *("electrical_energy", "energy_per_minute_middle_legs", "robot", "gait"),
)


@pytest.mark.usefixtures("sketched")
def test_tables_are_those_of_standing_and_walking_and_the_page_shows_them(
    tmp_path: Path, command: Command, out: Path
) -> None:
    """The same input gives the same bytes, whichever verb asks."""
    assert command("reports", tmp_path) == 0
    for path in out.glob("*.csv"):
        assert path.read_bytes() == (tmp_path / path.name).read_bytes(), path.name
    page = checked(tmp_path)
    assert not re.search(r"N\*m|\d%", page.text)
    for name in ("robot_energy", "reproduction", "conclusions", "break_even", "omissions"):
        assert page.rows(f"{name}.csv")
    assert {f"{name}.svg" for name in FIGURES} <= {*page.targets}


@pytest.mark.slow
def test_two_processes_leave_the_same_bytes(root: Path, tmp_path: Path) -> None:
    """Figures included. (Within one process matplotlib numbers clip paths on and on.)"""
    for name in ("first", "second"):
        command = [sys.executable, "-m", "pipeline", "reports", "--out", str(tmp_path / name)]
        subprocess.run(command, cwd=root, check=True, capture_output=True, timeout=300)
    first, second = tmp_path / "first", tmp_path / "second"
    assert {p.name for p in first.iterdir()} == {p.name for p in second.iterdir()}
    for path in first.iterdir():
        assert path.read_bytes() == (second / path.name).read_bytes(), path.name


def test_a_urdf_of_ones_own_stands_like_the_built_one(
    root: Path, tmp_path: Path, command: Command, out: Path
) -> None:
    """The robot of the refusals is sound before it is spoilt, and gives the same numbers."""
    assert command("stand", tmp_path, robot=own_robot(root, tmp_path, "</robot>", "</robot>")) == 0
    own, built = (
        pd.read_csv(folder / "standing.csv", index_col=[0, 1]) for folder in (tmp_path, out)
    )
    pd.testing.assert_frame_equal(own, built, rtol=1e-6, atol=1e-9)
