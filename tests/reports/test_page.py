"""What a page makes of texts, cells and tables."""

from __future__ import annotations

import re

import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actuators.errors import LegwattError
from pipeline.columns import frame
from reports.page import html, marked, table
from tests.reports.read_page import Page

BAD = '"><script>alert(1)</script>'


def limits() -> dict[str, pd.DataFrame]:
    rows = [("a", BAD, "speed", "rad/s", 2.0, 1.0, 0.0, 0.0, False)]
    rows.append(("b", "j", "share", "1", 2.0, float("nan"), 0.0, 0.0, True))
    return {"motor_limits": frame("motor_limits", rows)}


def test_a_text_from_outside_is_never_markup() -> None:
    numbers = "power_W power_low_W power_high_W battery_h price_EUR actuator_mass_kg"
    numbers += " robot_mass_kg bus_V chance_within"
    whole = dict.fromkeys(numbers.split(), 1.0) | {"battery": BAD, "answer": BAD}
    bad = pd.DataFrame({BAD: [BAD]})
    content = {"title": BAD, "notices": (BAD,), "buy": (BAD,), "whole": whole, "best": whole}
    content |= {"figures": ("front",), "pack": BAD, "trust": (BAD, BAD), "notes": (BAD,)}
    content |= {"columns": {}, "parts": bad, "measured": bad, "files": {BAD: BAD}}
    content["sections"] = {"parts": BAD, "measured": "Measured"}
    read = Page(html("choice", limits(), **content))
    assert "script" not in read.tags
    assert read.text.count(BAD) == 17
    cells = Page(str(table(limits(), "motor_limits"))).rows("motor_limits.csv")
    assert cells[0][1][1] == BAD


@settings(deadline=None)
@given(st.lists(st.sampled_from([*"ab_[]()*`<>&\"'/:;. \n", "**"])).map("".join))
def test_marked_text_never_smuggles_markup(text: str) -> None:
    tags = re.findall(r"<[^>]*>", str(marked(text)))
    assert {*tags} <= {"<strong>", "</strong>", "<code>", "</code>", "<wbr>"}


def test_a_written_table_is_shown_under_declared_headings() -> None:
    text = str(table(limits(), "motor_limits", keep=[False, True]))
    assert 'title="drivetrain option"' in text
    headings = re.findall(r"<th>.*?>([^<]*)</span></th>", text)
    assert headings[3:7] == ["unit", "limit", "peak", "at time [s]"]
    (shown,) = Page(text).rows("motor_limits.csv")
    assert [cell for _, cell in shown[3:6]] == ["", "2", "\N{EN DASH}"]
    assert [kind for kind, _ in shown[4:5]] == ["n"]
    assert shown[-1][1] == "yes"
    assert ">v</span></th>" in str(table(limits(), "motor_limits", ["peak"], titles={"peak": "v"}))
    with pytest.raises(LegwattError, match="no table 'motor_limit'"):
        table(limits(), "motor_limit")
