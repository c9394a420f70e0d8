"""The page of every kind of run: it is whole, its links lead somewhere, its numbers are the CSVs'.

That of the hexapod's reports is looked at in `tests/pipeline/cli/test_reports.py`, that of a whole
run of `gap` in `tests/pipeline/cli/gap/test_run.py`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from pipeline.api.machine import load
from pipeline.effects.model_file import Edit, EditParameter, new_model_file
from pipeline.identification.workflow.written import model_text
from reports.figures import style as saving
from reports.page import plain
from reports.pages.choice_page import PartSource, write_choice_page
from reports.pages.robot_page import limits_text, motors_text
from reports.table import Table
from reports.tables.choice import AnswerRow, BestRow, DayRow, FrontRow
from tests.command_line import exit_code
from tests.conftest import SKETCH
from tests.demo import HIDDEN
from tests.reports.read_page import PageReader, checked

NAME = '<img src=x onerror="alert(1)"> & `co` **mp**'


@pytest.fixture(scope="module")
def quick() -> Iterator[None]:
    """Figures are files, but not drawn."""

    def save(figure: object, folder: Path, name: str) -> None:
        (folder / f"{name}.svg").write_text(SKETCH, encoding="utf-8")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(saving, "save_figure", save)
        yield


@pytest.fixture(scope="module")
def solo(quick: None, root: Path, tmp_path_factory: pytest.TempPathFactory) -> PageReader:
    """Of another robot, without the motors that its file states, under a name of markup."""
    folder = tmp_path_factory.mktemp("solo")
    text, _, _ = (root / "urdf" / "solo12.toml").read_text("utf-8").partition("[actuators]")
    text = re.sub(r'(?m)^name = ".*"', f"name = '{NAME}'", text, count=1)
    robot = folder / "robot.toml"
    robot.write_text(text, encoding="utf-8")
    out = folder / "out"
    assert exit_code(["reports", "--robot", str(robot), "--samples", "51", "--out", str(out)]) == 0
    return checked(out)


def test_another_robots_page_is_whole_and_has_no_word_of_the_paper(solo: PageReader) -> None:
    text = " ".join(solo.texts)
    assert not re.search(r"\bpaper\b|Fig\. \d|hexapod|reproduced", text.split("What went in")[1])
    assert {"robot_energy.csv", "walking_stability.csv", "parameters.csv"} <= {*solo.tables}
    assert "joint_demand_FL_HAA.svg" in solo.targets


def test_a_robots_name_is_shown_and_no_markup(solo: PageReader) -> None:
    assert any(text.startswith("What it costs to actuate <img src=x") for text in solo.texts)
    assert "x" not in solo.targets


def test_motors_that_are_assumed_are_said_with_their_mass(solo: PageReader) -> None:
    text = "".join(solo.texts)
    for said in ("none are stated", "maxon RE 40", "400:1", "5.76 kg", "init-actuator"):
        assert said in text
    assert "weigh more than the robot" in text
    assert "Beyond the motors: walking takes " in text


def test_motors_that_are_stated_are_no_assumption(root: Path) -> None:
    folder = root / "tests" / "pipeline" / "data_files" / "xl330_actuators"
    text = motors_text(load(root / "urdf" / "solo12.toml", actuators=folder).ready.motors)
    assert "as stated for this robot, XL330-M288" in text
    assert "state no `mass`" in text
    assert "init-actuator" not in text
    assert "weigh" not in text


def test_what_motors_cannot_give_is_said_once_for_each_quantity() -> None:
    names = ("alternative", "joint", "quantity", "unit", "limit", "peak", "breach")
    rows = [
        ("belt", "knee", "current", "A", 4.0, 9.0, True),
        ("belt", "hip", "current", "A", 4.0, 8.0, True),
        ("gear", "hip", "speed", "rad/s", 4.0, 3.0, False),
    ]
    columns = dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))
    table = Table("motor_limits", columns, dict.fromkeys(names, ("", "")))
    (line,) = limits_text({"motor_limits": table}, {"belt": "a belt", "gear": "a gear"}, None)
    assert plain(line) == (
        "Beyond the motors: walking takes current 9 A, limit 4 A (knee, a belt, 1 of 2 "
        "alternatives)."
    )


def shrunk(root: Path, log: Path, folder: Path, *edits: Edit) -> tuple[PageReader, str]:
    file = new_model_file(root / "urdf" / "hexapod.toml", "rotor").with_edits(edits)
    model = folder / "model.toml"
    model.write_text(model_text(file, folder), encoding="utf-8")
    named = folder / "<b>walk.parquet"
    named.write_bytes(log.read_bytes())
    out = folder / "out"
    arguments = ["gap", "shrink", str(named), "--model", str(model), "--out", str(out)]
    assert exit_code(arguments) == 1  # so short a log leaves its voltages open
    return checked(out), "".join(checked(out).texts)


def test_a_gaps_page_with_findings(root: Path, short_demo: Path, tmp_path: Path) -> None:
    torque = EditParameter("torque", HIDDEN.parameters["torque"], "N*m", (1.9, 2.1))
    edit = Edit(HIDDEN.effect, HIDDEN.place, (torque,), source="walk")
    page, text = shrunk(root, short_demo, tmp_path, edit)
    assert "by log '<b>walk'" in text
    assert "b" in page.tags  # of the numbers; none holds the log's name
    assert "Found, confirmed: coulomb_friction at rm_joint_1 (torque 2 N·m" in text
    assert "effect_1_coulomb_friction.svg" in page.targets
    assert {"where.csv", "found.csv"} <= {*page.tables}


def test_a_gaps_page_without_findings(root: Path, short_demo: Path, tmp_path: Path) -> None:
    page, text = shrunk(root, short_demo, tmp_path)
    assert "found.csv" not in page.tables
    assert "no effect of the catalogue explains it" in text
    assert "What stays unexplained by the model as written: " in text


def rows_table(kind: Any, rows: list[dict[str, Any]]) -> Table:
    """Columns that a row does not state are zero or empty."""
    names = {field.name: field.metadata["column"] for field in fields(kind)}
    columns = {
        name: [row.get(name, 0.0 if meaning[1] else "") for row in rows]
        for name, meaning in names.items()
    }
    return Table(kind.table, columns, names)


def test_a_choices_page_has_every_parts_source(tmp_path: Path) -> None:
    from reports.writer import write_table

    mass = {"actuator_mass_kg": 3.0, "power_W": 12.0}
    best = [{"group": "hip", "rank": k, "motor": f"motor_{k % 2}"} for k in range(1, 5)]
    tables = [
        rows_table(AnswerRow, [{"group": "hip", "motor": "motor_1"}, {"group": "robot"} | mass]),
        rows_table(BestRow, best),
        rows_table(FrontRow, [mass, {"actuator_mass_kg": 2.0, "power_W": 20.0}]),
        rows_table(DayRow, [{"mode": "walk", "group": "robot", "hours": 24.0, "winding_W": 1.0}]),
    ]
    for table in tables:
        write_table(table, tmp_path, meta={})
    parts = {
        "motor_0": PartSource("Motor A", "datasheet", "maker's page <i>", "peak is a range"),
        "motor_1": PartSource("Motor B", "assumed", "nobody's"),
        "motor_2": PartSource("Motor C, in no table", "datasheet", "elsewhere"),
    }
    named = {t.name: t for t in tables}
    assert write_choice_page(named, parts, ["Build **A**."], tmp_path, title="Which") == 3
    page = checked(tmp_path)
    text = "".join(page.texts)
    assert "maker's page <i>" in text
    assert "nobody's" in text
    assert "Motor C" not in text
    assert {"front_map.svg", "day_energy.svg"} <= {*page.targets}
