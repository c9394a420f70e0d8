"""`make reports` from the outside: every table, every figure as SVG, twice the same."""

from __future__ import annotations

import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from tests.command_line import Command
from tests.reports.browser import layout, needs_chromium
from tests.reports.read_page import checked

FIGURES = (
    *(f"joint_demand_rm_joint_{k}" for k in (1, 2, 3)),  # Fig. 2 to 4
    *(f"stage_energy_{a}" for a in ("ideal", "rotor", "reversible", "irreversible")),  # 14 to 20
    "electrical_energy",
    "robot",
    "gait",
)


@pytest.fixture(scope="module")
def reports(tmp_path_factory: pytest.TempPathFactory, command: Command) -> Path:
    folder = tmp_path_factory.mktemp("reports")
    assert command("reports", folder) == 0
    return folder


def test_every_table_of_standing_and_walking(reports: Path, out: Path) -> None:
    """The same input gives the same bytes, whichever verb asks."""
    for path in out.iterdir():
        assert path.read_bytes() == (reports / path.name).read_bytes(), path.name


@pytest.mark.parametrize("name", FIGURES)
def test_figure(reports: Path, name: str) -> None:
    root = ET.parse(reports / f"{name}.svg").getroot()
    assert root.tag.endswith("svg")


def test_every_csv_has_a_sidecar_and_nothing_else_is_left(reports: Path) -> None:
    for path in reports.iterdir():
        assert path.suffix in (".csv", ".json", ".svg", ".html")
        if path.suffix == ".csv":
            assert path.with_suffix(".meta.json").exists()


def test_headings_are_words_with_units(reports: Path) -> None:
    """No identifier, no "[see unit]", N·m and no other way; each says on pointing what it means."""
    page = (reports / "index.html").read_text(encoding="utf-8")
    headings = re.findall(r'<th scope="col"([^>]*)>(.*?)</th>', page)
    assert len(headings) > 30
    for _, words in headings:
        assert "_" not in words.replace("E_el/E_m", "")
        assert "see " not in words
        assert "*" not in words
    assert sum("title=" in attributes for attributes, _ in headings) > 30


def test_the_page_is_whole_and_shows_the_tables_numbers(reports: Path) -> None:
    page = checked(reports)
    text = "".join(page.texts)
    assert "N·m" in text
    assert not re.search(r"N\*m|\d%", text)
    for name in ("robot_energy", "reproduction", "conclusions", "break_even", "omissions"):
        assert f"{name}.csv" in page.tables
    assert "energy_per_minute_middle_legs.svg" in page.targets


@needs_chromium
@pytest.mark.parametrize("width", [1280, 400])
def test_nothing_of_the_page_is_cut(reports: Path, tmp_path: Path, width: int) -> None:
    """A table or a figure that is wider than the window scrolls in a frame that is not."""
    seen = layout(reports / "index.html", width, tmp_path)
    assert seen.page <= seen.window
    assert seen.beyond == []
    assert seen.tables >= 6
    assert seen.pictures >= 10


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
