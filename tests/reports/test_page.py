"""What a page makes of texts, cells and tables."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actuators.errors import LegwattError
from reports.page import (
    FigureBlock,
    Number,
    Page,
    Section,
    TableBlock,
    html,
    marked,
    table_block,
)
from reports.table import Table
from tests.reports.read_page import PageReader

BAD = '"><script>alert(1)</script>'


def test_a_text_from_outside_is_never_markup() -> None:
    block = TableBlock((BAD,), ((BAD,), (1.5,)), BAD, BAD, {BAD: "bad"}, hints=(BAD,))
    page = Page(
        BAD,
        (BAD,),
        (Section(BAD, (BAD, (BAD,), block, FigureBlock(BAD, BAD))),),
        {BAD: BAD},
        (BAD,),
        (Number(BAD, BAD),),
        FigureBlock(BAD, BAD),
    )
    text = html(page)
    read = PageReader(text)
    assert "script" not in read.tags
    assert read.open == []
    assert "".join(read.texts).count(BAD) == 18


@settings(deadline=None)
@given(st.lists(st.sampled_from([*"ab_[]()*`<>&\"'/:;. \n", "**"])).map("".join))
def test_marked_text_never_smuggles_markup(text: str) -> None:
    tags = re.findall(r"<[^>]*>", str(marked(text)))
    assert {*tags} <= {"<strong>", "</strong>", "<code>", "</code>", "<wbr>"}


def test_a_written_table_is_shown_under_declared_headings() -> None:
    table = Table(
        "t",
        {"id": ["x", "y"], "energy_J": [1.0, float("nan")], "x": [3, 4], "unit": ["N*m", "1"]},
        {
            "id": ("short name", ""),
            "energy_J": ("energy", "J"),
            "x": ("x", "see unit"),
            "unit": ("of x", ""),
        },
        "Energies.",
    )
    block = table_block(table, keep=[True, False])
    assert block.headers == ("id", "energy [J]", "x", "unit")
    assert block.hints == ("short name", "energy", "x", "of x")
    assert block.rows == (("x", 1.0, 3, "N·m"),)
    assert block.numeric == (False, True, True, False)
    assert (block.caption, block.file) == ("Energies.", "t.csv")
    assert table_block(table, {"x": "v"}).headers == ("v",)
    with pytest.raises(LegwattError, match="no column 'speeed'"):
        table_block(table, {"speeed": "v"})
