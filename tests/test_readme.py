"""What the pages' tables say is so: those from a run are current, the others are complete."""

import pytest

from pipeline.columns import about, every_table
from tests.readme import BLOCKS, renewed


@pytest.mark.parametrize("name", BLOCKS)
def test_generated_tables_are_current(root, name, out):
    text = (root / BLOCKS[name][0]).read_text(encoding="utf-8")
    assert renewed(name, text, out) == text, "run `make readme`"


def test_every_table_says_what_it_holds():
    assert [name for name in every_table() if not about(name)] == []
