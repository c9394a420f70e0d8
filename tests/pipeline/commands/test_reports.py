"""`make reports` from the outside: every table, every figure, twice the same."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.command_line import Command
from tests.reports.read_page import checked

FIGURES = (
    "joint_demand",  # Fig. 2 to 4
    *(f"stage_energy_{a}" for a in ("ideal", "rotor", "reversible", "irreversible")),  # 14 to 20
    "electrical_energy",
    "robot",
    "gait",
)


@pytest.fixture(scope="module")
def reports(
    module_sketched: None, tmp_path_factory: pytest.TempPathFactory, command: Command
) -> Path:
    folder = tmp_path_factory.mktemp("reports")
    assert command("reports", folder) == 0
    return folder


def test_every_table_of_standing_and_walking(reports: Path, out: Path) -> None:
    """The same input gives the same bytes, whichever verb asks."""
    for path in out.glob("*.csv"):
        assert path.read_bytes() == (reports / path.name).read_bytes(), path.name


def test_the_page_is_whole_and_shows_the_tables_numbers(reports: Path) -> None:
    page = checked(reports)
    text = "".join(page.texts)
    assert "N·m" in text
    assert not re.search(r"N\*m|\d%", text)
    for name in ("robot_energy", "reproduction", "conclusions", "break_even", "omissions"):
        assert f"{name}.csv" in page.tables
    assert "energy_per_minute_middle_legs.svg" in page.targets
    assert all((reports / f"{name}.svg").exists() for name in FIGURES)


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
