"""What a page makes of texts, cells and tables."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actuators.errors import LegwattError
from pipeline.columns import frame
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
    rows = [("a", "j", "speed", "rad/s", 2.0, 1.0, 0.0, 0.0, False)]
    rows.append(("b", "j", "share", "1", 2.0, float("nan"), 0.0, 0.0, True))
    tables = {"motor_limits": frame("motor_limits", rows)}
    block = table_block(tables, "motor_limits", keep=[True, False])
    assert block.headers[3:7] == ("unit", "limit", "peak", "at time [s]")
    assert block.hints[0] == "actuator alternative"
    assert block.rows == (("a", "j", "speed", "rad/s", 2.0, 1.0, 0.0, 0.0, False),)
    assert block.numeric[3:6] == (False, True, True)
    assert block.file == "motor_limits.csv"
    assert table_block(tables, "motor_limits").rows[1][3:6] == ("", 2.0, None)
    assert table_block(tables, "motor_limits", {"peak": "v"}).headers == ("v",)
    with pytest.raises(LegwattError, match="no column 'speeed'"):
        table_block(tables, "motor_limits", {"speeed": "v"})
