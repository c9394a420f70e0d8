"""What a page makes of texts, cells and tables, and the page of every kind of run."""

import csv
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import unquote

import lxml.html
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.columns import frame
from pipeline.effects.model_file import model_text, new_model_file
from pipeline.identification.results import Residual
from reports.page import cell_text, html, marked, plain, table
from reports.pages.gap_page import answer
from tests.command_line import HIDDEN, edit_of, exit_code


class Page:
    """What stands in a page, as HTML is read."""

    def __init__(self, text: str) -> None:
        self.tree: Any = lxml.html.fromstring(text)
        self.tags = {str(node.tag) for node in self.tree.iter()}
        self.targets: list[str] = self.tree.xpath("//img/@src|//a/@href")
        self.text: str = "".join(self.tree.xpath("//text()[not(ancestor::style)]"))

    def rows(self, name: str) -> list[list[tuple[str, str]]]:
        """Class and text of each cell by row, of the tables that show a CSV."""
        captions = self.tree.xpath(f"//p[@class='caption'][a/@href='{name}']")
        every = (row for one in captions for row in one.xpath("preceding::table[1]//tr[td]"))
        return [
            [(cell.xpath("string(span/@class)"), cell.text_content()) for cell in row.xpath("td")]
            for row in every
        ]


def checked(folder: Path) -> Page:
    """Read a run's page: what it links to is there, its tables' numbers are the CSVs'."""
    page = Page((folder / "index.html").read_text(encoding="utf-8"))
    ids = page.tree.xpath("//@id")
    assert len(ids) == len({*ids})
    assert "script" not in page.tags
    for target in map(unquote, page.targets):
        assert target[1:] in ids if target[0] == "#" else (folder / target).is_file(), target
    for name in {*page.tree.xpath("//p[@class='caption']/a/@href")}:
        with (folder / name).open(encoding="utf-8", newline="") as file:
            cells = [cell for row in csv.reader(file) for cell in row]
        known = {"\N{EN DASH}", "0"}
        for cell in cells:
            try:
                known |= {cell_text(float(cell), digits) for digits in (3, 4)}
            except ValueError:
                continue
            known |= {cell_text(int(cell))} if cell.lstrip("-").isdigit() else set()
        numbers = [text for row in page.rows(name) for kind, text in row if kind == "n"]
        assert {*numbers} <= known, name
    return page


BAD = '"><script>alert(1)</script>'


def limits() -> dict[str, pd.DataFrame]:
    rows = [("a", BAD, "speed", "rad/s", 2.0, 1.0, False)]
    rows.append(("b", "j", "share", "1", 2.0, float("nan"), True))
    return {"motor_limits": frame("motor_limits", rows)}


def test_a_text_from_outside_is_never_markup():
    numbers = "power_W power_low_W power_high_W battery_h price_EUR actuator_mass_kg"
    numbers += " robot_mass_kg bus_V chance_within"
    whole = dict.fromkeys(numbers.split(), 1.0) | {"battery": BAD, "answer": BAD}
    bad = pd.DataFrame({BAD: [BAD]})
    content = {"title": BAD, "notices": (BAD,), "buy": (BAD,), "whole": whole, "best": whole}
    content |= {"figures": ("front",), "pack": BAD, "trust": (BAD, BAD), "notes": (BAD,)}
    content |= {"columns": {}, "parts": bad, "measured": bad, "missed": 0, "files": {BAD: BAD}}
    content |= {"today": True, "sections": {"parts": BAD, "measured": "Measured"}}
    read = Page(html("choice", limits(), **content))
    assert "script" not in read.tags
    assert read.text.count(BAD) == 17
    cells = Page(str(table(limits(), "motor_limits"))).rows("motor_limits.csv")
    assert cells[0][1][1] == BAD


@settings(deadline=None)
@given(st.lists(st.sampled_from([*"ab_[]()*`<>&\"'/:;. \n", "**"])).map("".join))
def test_marked_text_never_smuggles_markup(text):
    tags = re.findall(r"<[^>]*>", str(marked(text)))
    assert {*tags} <= {"<strong>", "</strong>", "<code>", "</code>", "<wbr>"}


NAME = '<img src=x onerror="alert(1)"> & `co` **mp**'


@pytest.fixture(scope="module")
def solo(sketched: None, root: Path, tmp_path_factory: pytest.TempPathFactory) -> Page:
    """Of another robot, without the motors that its file states, under a name of markup."""
    folder = tmp_path_factory.mktemp("solo")
    text, _, _ = (root / "urdf" / "solo12.toml").read_text("utf-8").partition("[actuators]")
    text = re.sub(r'(?m)^name = ".*"', f"name = '{NAME}'", text, count=1)
    robot = folder / "robot.toml"
    robot.write_text(text, encoding="utf-8")
    out = folder / "out"
    assert exit_code(["reports", "--robot", str(robot), "--samples", "51", "--out", str(out)]) == 0
    return checked(out)


def test_another_robots_page_is_whole_and_has_no_word_of_the_paper(solo):
    text = solo.text
    assert not re.search(r"\bpaper\b|Fig\. \d|hexapod|reproduced", text.split("What went in")[1])
    assert {"robot_energy.csv", "walking_stability.csv", "parameters.csv"} <= {*solo.targets}
    assert "joint_demand.svg" in solo.targets
    # Its name is shown and no markup; motors are assumed, and heavier than the robot.
    assert "actuate <img src=x" in text
    assert "x" not in solo.targets
    for said in ("maxon RE 40", "5.76 kg", "more than the robot", "with assumed motors"):
        assert said in text
    first = text.index("peak torque"), text.index("peak mechanical power"), text.index("to walk,")
    assert [*first] == sorted(first)  # what no motor is needed for leads


@pytest.mark.usefixtures("sketched")
def test_a_gaps_page_with_findings(root, short_demo, tmp_path):
    edit = edit_of(HIDDEN.effect, *HIDDEN.place, within=0.05, **HIDDEN.parameters)
    file = new_model_file(root / "urdf" / "hexapod.toml", "rotor").with_edits([edit])
    model = tmp_path / "model.toml"
    model.write_text(model_text(file, tmp_path), encoding="utf-8")
    named = tmp_path / "<b>walk.parquet"
    named.write_bytes(short_demo.read_bytes())
    out = tmp_path / "out"
    arguments = ["gap", "shrink", str(named), "--model", str(model), "--out", str(out)]
    assert exit_code(arguments) == 1  # so short a log leaves its voltages open
    page = checked(out)
    text = page.text
    assert "by log '<b>walk'" in text
    assert "Missing, confirmed: Coulomb friction at rm_joint_1: torque 2 N·m" in text
    assert "in_time.svg" in page.targets
    assert {"where.csv", "found.csv"} <= {*page.targets}


def said(left: Residual) -> str:
    """The answer of a machine of two joints of which nothing was found."""
    whole = {"by": "joint", "joint": "a", "gap": 2.0, "unit": "N*m", "share_of_total": 0.9}
    effect = ["effect", "place", "joint"]
    outcome: Any = SimpleNamespace(
        gaps=(2.0, 0.3),
        noise=0.25,
        suspected=(),
        energy=None,
        unit="N*m",
        held=SimpleNamespace(left=(left,)),
        given=SimpleNamespace(alternative="", model=SimpleNamespace(joints=("a", "b"))),
        compared=SimpleNamespace(logs=(SimpleNamespace(channels=("torque",), recording=None),)),
    )
    tables = {
        "found": pd.DataFrame(columns=[*effect, "parameter", "value", "level", "written"]),
        "candidates": pd.DataFrame(columns=["effect", "place", "verdict"], dtype=str),
        "where": pd.DataFrame([whole]),
    }
    lines = [plain(line) for line in answer(outcome, tables)]
    assert len(lines) <= 10
    return " ".join(lines)


@pytest.mark.parametrize("significant", [True, False])
def test_noise_is_said_only_where_no_joint_leaves_more(significant):
    told = said(Residual("a", "torque", 0.9, 0.3, "N*m", significant, "falls in time"))
    assert ("is noise: at most 3 times its floor, at a" in told) != significant
    assert ("a 0.9 N·m, 3 times its floor, falls in time" in told) == significant
