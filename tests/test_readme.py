"""What the pages' tables say is so: those from a run are current, the others are complete."""

import re

import pytest

from tests.readme import BLOCKS, renewed


@pytest.mark.parametrize("name", BLOCKS)
def test_generated_tables_are_current(root, name, out):
    text = (root / BLOCKS[name][0]).read_text(encoding="utf-8")
    assert renewed(name, text, out) == text, "run `make readme`"


def test_named_files_are_left_by_a_run(root, out):
    page = (root / "reports/tables/README.md").read_text(encoding="utf-8")
    section = page.split("<!-- files: stand, walk -->")[1].split("\n\n")[0]
    named = set(re.findall(r"`(\w+\.csv)`", section))
    assert named == {path.name for path in out.glob("*.csv")}
