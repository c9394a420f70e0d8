"""What the pages' tables say is so: those from a run are current, the others are complete."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pipeline.logs.log_format import BASE_COLUMNS, FOOT_COLUMNS, JOINT_COLUMNS
from pipeline.logs.mapping import ColumnTable, Mapping
from pipeline.robot.robot_tables import GAIT_SCHEMA, LegSpec, RobotTable
from tests.readme import BLOCKS, renewed


@pytest.mark.parametrize("name", BLOCKS)
def test_generated_tables_are_current(root: Path, name: str, out: Path) -> None:
    text = (root / BLOCKS[name][0]).read_text(encoding="utf-8")
    assert renewed(name, text, out) == text, "run `make readme`"


def test_named_files_are_left_by_a_run(root: Path, out: Path) -> None:
    page = (root / "reports/tables/README.md").read_text(encoding="utf-8")
    section = page.split("<!-- files: stand, walk -->")[1].split("\n\n")[0]
    named = set(re.findall(r"`(\w+\.csv)`", section))
    assert named == {path.name for path in out.glob("*.csv")}


def test_every_column_of_the_log_format_is_described(root: Path) -> None:
    page = (root / "pipeline/logs/README.md").read_text(encoding="utf-8")
    table = page.split("## The log format")[1].split("\n## ")[0]
    for column in (*JOINT_COLUMNS, *FOOT_COLUMNS, *BASE_COLUMNS):
        assert re.search(rf"(__|`){column}`", table), column


def test_every_key_of_robot_and_mapping_files_is_described(root: Path) -> None:
    robot = (root / "urdf/README.md").read_text(encoding="utf-8")
    for key in (*GAIT_SCHEMA, *RobotTable.model_fields, *LegSpec.model_fields):
        assert f"`{key}`" in robot, key
    logs = (root / "pipeline/logs/README.md").read_text(encoding="utf-8")
    fields = {**Mapping.model_fields, **ColumnTable.model_fields}
    for key in (field.alias or name for name, field in fields.items()):
        assert re.search(rf"\b{key}\b", logs), key
