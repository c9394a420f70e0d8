"""What the README says is so: tables from a run, links, targets and options that exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pipeline.cli.main import parser
from tests.readme import SHOWN, number, renewed

LINK = re.compile(r"\]\(([^)#:]+)\)")


@pytest.fixture(scope="module")
def readme(root: Path) -> str:
    return (root / "README.md").read_text(encoding="utf-8")


def test_tables_are_current(readme: str, out: Path) -> None:
    assert renewed(readme, out) == readme, "run `make readme`"


def test_links_lead_somewhere(root: Path, readme: str) -> None:
    links = LINK.findall(readme)
    assert len(links) > 8
    assert not [link for link in links if not (root / link).exists()]


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
    assert {"reports", "test", "urdf", "bench"} <= named <= helped


def test_named_files_are_left_by_a_run(readme: str, out: Path) -> None:
    section = readme.split("## What a run leaves")[1].split("**In a spreadsheet.**")[0]
    named = set(re.findall(r"`(\w+\.csv)`", section))
    assert named == {path.name for path in out.glob("*.csv")}


def test_named_options_exist(readme: str) -> None:
    text = parser().format_help()
    for action in parser()._subparsers._group_actions[0].choices.values():  # type: ignore[union-attr]
        text += action.format_help()
    for option in set(re.findall(r"(?<!-)--[a-z][a-z-]+", readme)):
        assert option in text or option == "--help", option


@pytest.mark.parametrize(
    ("text", "shown"),
    [("0.80345", "0.803"), ("-0.0", "0"), ("37.766", "37.8"), ("215.94", "216"), ("1e-17", "0")],
)
def test_three_digits(text: str, shown: str) -> None:
    assert number(text) == shown
