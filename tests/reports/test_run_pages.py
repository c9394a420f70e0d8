"""The page of every kind of run: it is whole, its links lead somewhere, its numbers are the CSVs'.

That of the hexapod's reports is looked at in `tests/pipeline/cli/test_reports.py`, that of a whole
run of `gap` in `tests/pipeline/cli/gap/test_run.py`.
"""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from pipeline.effects.model_file import Edit, EditParameter, new_model_file
from pipeline.identification.workflow.written import model_text
from reports.pages.choice_page import PartSource, write_choice_page
from reports.table import Table
from reports.tables.choice import AnswerRow, BestRow, DayRow, FrontRow
from tests.command_line import exit_code
from tests.demo import HIDDEN
from tests.reports.read_page import PageReader, checked

NAME = '<img src=x onerror="alert(1)"> & `co` **mp**'


@pytest.fixture(scope="module")
def solo(module_sketched: None, root: Path, tmp_path_factory: pytest.TempPathFactory) -> PageReader:
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
    # Its name is shown and no markup; motors are assumed, and heavier than the robot.
    assert any("actuate <img src=x" in one for one in solo.texts)
    assert "x" not in solo.targets
    for said in ("maxon RE 40", "5.76 kg", "weigh more than the robot", "Beyond the motors"):
        assert said in text


@pytest.mark.usefixtures("sketched")
def test_a_gaps_page_with_findings(root: Path, short_demo: Path, tmp_path: Path) -> None:
    torque = EditParameter("torque", HIDDEN.parameters["torque"], "N*m", (1.9, 2.1))
    edit = Edit(HIDDEN.effect, HIDDEN.place, (torque,), source="walk")
    file = new_model_file(root / "urdf" / "hexapod.toml", "rotor").with_edits([edit])
    model = tmp_path / "model.toml"
    model.write_text(model_text(file, tmp_path), encoding="utf-8")
    named = tmp_path / "<b>walk.parquet"
    named.write_bytes(short_demo.read_bytes())
    out = tmp_path / "out"
    arguments = ["gap", "shrink", str(named), "--model", str(model), "--out", str(out)]
    assert exit_code(arguments) == 1  # so short a log leaves its voltages open
    page = checked(out)
    text = "".join(page.texts)
    assert "by log '<b>walk'" in text
    assert "b" in page.tags  # of the numbers; none holds the log's name
    assert "Found, confirmed: coulomb_friction at rm_joint_1 (torque 2 N·m" in text
    assert "effect_1_coulomb_friction.svg" in page.targets
    assert {"where.csv", "found.csv"} <= {*page.tables}


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
