"""The page of every kind of run: it is whole, its links lead somewhere, its numbers are the CSVs'.

Those of the hexapod's reports, of `choose` and of a whole run of `gap` are looked at in
`tests/pipeline/commands`.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pipeline.effects.model_file import Edit, EditParameter, model_text, new_model_file
from tests.command_line import exit_code
from tests.demo import HIDDEN
from tests.reports.read_page import Page, checked

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


def test_another_robots_page_is_whole_and_has_no_word_of_the_paper(solo: Page) -> None:
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
def test_a_gaps_page_with_findings(root: Path, short_demo: Path, tmp_path: Path) -> None:
    torque = EditParameter(
        name="torque", value=HIDDEN.parameters["torque"], unit="N*m", interval=(1.9, 2.1)
    )
    edit = Edit(effect=HIDDEN.effect, place=HIDDEN.place, parameters=(torque,))
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
