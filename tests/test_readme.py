"""What the pages' tables say is so: those from a run are current, the others are complete."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pipeline.logs.log_format import BASE_COLUMNS, FOOT_COLUMNS, JOINT_COLUMNS
from pipeline.logs.reading.mapping import ColumnTable, Mapping
from pipeline.robot.robot_tables import GAIT_SCHEMA, OwnLegTable, RobotTable
from tests.pages import pages
from tests.readme import BLOCKS, PAGES, SHOWN, number, renewed


@pytest.fixture(scope="module")
def readme(root: Path) -> str:
    return (root / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("page", PAGES)
def test_generated_tables_are_current(root: Path, page: str, out: Path) -> None:
    text = (root / page).read_text(encoding="utf-8")
    assert renewed(page, text, out) == text, "run `make readme`"


def test_every_block_between_markers_is_generated(root: Path) -> None:
    for page in pages():
        text = (root / page).read_text(encoding="utf-8")
        for name in re.findall(r"<!-- begin: ([\w ]+) -->", text):
            assert BLOCKS[name][0] == page.as_posix()


def test_pictures_are_small(root: Path, readme: str) -> None:
    for name in SHOWN:
        assert f"reports/example/{name}" in readme
        assert (root / "reports/example" / name).stat().st_size < 200_000


def test_named_targets_exist_and_are_in_the_help(root: Path, readme: str) -> None:
    makefile = (root / "Makefile").read_text(encoding="utf-8")
    helped = set(re.findall(r"^([a-z-]+):.*##", makefile, flags=re.M))
    phony = re.search(r"^\.PHONY: (.*)$", makefile, flags=re.M)
    assert phony
    assert helped == set(phony[1].split())
    named = set(re.findall(r"(?:`|^)make ([a-z-]+)", readme, flags=re.M))
    assert {"reports", "gap", "test", "bench"} <= named <= helped


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
    for key in (*GAIT_SCHEMA, *RobotTable.model_fields, *OwnLegTable.model_fields):
        assert f"`{key}`" in robot, key
    logs = (root / "pipeline/logs/README.md").read_text(encoding="utf-8")
    fields = {**Mapping.model_fields, **ColumnTable.model_fields}
    for key in (field.alias or name for name, field in fields.items()):
        assert re.search(rf"\b{key}\b", logs), key


@pytest.mark.parametrize(
    ("text", "shown"),
    [("0.80345", "0.803"), ("-0.0", "0"), ("37.766", "37.8"), ("215.94", "216"), ("1e-17", "0")],
)
def test_three_digits(text: str, shown: str) -> None:
    assert number(text) == shown
