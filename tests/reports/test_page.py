"""A page says the same in HTML and Markdown, holds its pictures, and fetches nothing."""

from __future__ import annotations

import base64
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import OutputError, ReportError
from reports.forms import html, markdown, marked, write_pages
from reports.page import (
    FigureBlock,
    Page,
    Section,
    TableBlock,
    cell_text,
    table_block,
)
from reports.table import Table

SVG = '<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"></svg>'


class Links(HTMLParser):
    """Everything a browser would load or follow."""

    def __init__(self) -> None:
        super().__init__()
        self.loaded: list[str] = []
        self.followed: list[str] = []
        self.tags: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        for name, value in attrs:
            if name == "src" or (tag == "link" and name == "href"):
                self.loaded.append(value or "")
            elif name == "href":
                self.followed.append(value or "")


def read(text: str) -> Links:
    links = Links()
    links.feed(text)
    return links


@pytest.fixture
def page(tmp_path: Path) -> Page:
    picture = tmp_path / "figure.svg"
    picture.write_text(SVG, encoding="utf-8")
    table = TableBlock(
        ("id", "value [J]", "verdict"),
        (("a|b", -1.23456, "reproduced"), ("c", None, "not reproduced")),
        "Two rows.",
        "t.csv",
        {"reproduced": "good", "not reproduced": "bad"},
    )
    return Page(
        "Answer",
        ("**94 %** of the *time*, see `x < y`.",),
        (
            Section("One", ("A [file](t.csv) & <tag>.", table)),
            Section("Two", (FigureBlock(picture, "A picture."), ("p", "q"))),
            Section("Three", (("r",),)),
        ),
        {"t.csv": "the table"},
        "legwatt",
    )


def test_page_is_self_contained(page: Page, tmp_path: Path) -> None:
    links = read(html(page, tmp_path))
    assert links.loaded
    assert all(target.startswith("data:") for target in links.loaded)
    assert set(links.followed) == {"t.csv", "figure.svg", "#s1", "#s2", "#s3", "#files"}
    assert "script" not in links.tags
    picture = next(t for t in links.loaded if "svg" in t)
    assert base64.b64decode(picture.split(",")[1]).decode() == SVG


def test_text_is_marked_and_escaped(page: Page, tmp_path: Path) -> None:
    text = html(page, tmp_path)
    for expected in (
        "<strong>94\N{NO-BREAK SPACE}%</strong>",
        "<em>time</em>",
        "<code>x &lt; y</code>",
        '<a href="t.csv">file</a> &amp; &lt;tag&gt;',
        '<span class="tone bad">not reproduced</span>',
        "\N{MINUS SIGN}1.235",
    ):
        assert expected in text


def test_answer_comes_first_in_both_forms(page: Page, tmp_path: Path) -> None:
    for text in (html(page, tmp_path), markdown(page, tmp_path)):
        text = text.replace("\N{NO-BREAK SPACE}", " ")
        assert text.index("94 %") < text.index("One") < text.index("Two")


def test_markdown_tables_and_pictures(page: Page, tmp_path: Path) -> None:
    text = markdown(page, tmp_path)
    assert "| id | value [J] | verdict |\n| --- | ---: | --- |" in text
    assert "| a\\|b | \N{MINUS SIGN}1.235 | reproduced |" in text
    assert "![A picture.](figure.svg)" in text
    assert "- p\n- q" in text
    assert str(tmp_path) not in text


def test_both_are_written_whole(page: Page, tmp_path: Path) -> None:
    write_pages(page, tmp_path / "out", "summary.md")
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["index.html", "summary.md"]
    text = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert 'href="../figure.svg"' in text
    assert str(tmp_path) not in text
    with pytest.raises(OutputError):
        write_pages(page, tmp_path / "figure.svg")


def test_missing_or_foreign_picture_is_one_clear_line(tmp_path: Path) -> None:
    for name, says in (("no.svg", "draw the figure before"), ("a.gif", "SVG or PNG")):
        page = Page("t", (), (Section("s", (FigureBlock(tmp_path / name, "c"),)),))
        with pytest.raises(ReportError, match=says):
            html(page, tmp_path)


def test_ragged_table_is_refused() -> None:
    with pytest.raises(ReportError, match="row 1: 1 cells under 2 headers"):
        TableBlock(("a", "b"), ((1, 2), (1,)))


def test_table_block_shows_a_written_table() -> None:
    table = Table(
        "t",
        {"id": ["x", "y"], "energy_J": [1.0, float("nan")], "speed": [3, 4]},
        {"id": ("short name", ""), "energy_J": ("energy", "J"), "speed": ("speed", "m/s")},
        "Energies.",
    )
    block = table_block(table, keep=[True, False])
    assert block.headers == ("id", "energy [J]", "speed [m/s]")
    assert block.hints == ("short name", "energy", "speed")
    assert block.rows == (("x", 1.0, 3),)
    assert block.numeric == (False, True, True)
    assert (block.caption, block.file) == ("Energies.", "t.csv")
    assert table_block(table, ("speed",)).headers == ("speed [m/s]",)
    assert table_block(table, {"speed": "v"}).headers == ("v",)
    with pytest.raises(ReportError, match="no column 'speeed'"):
        table_block(table, {"speeed": "v"})


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "\N{EN DASH}"),
        (float("nan"), "\N{EN DASH}"),
        (-0.0, "0"),
        (1e-7, "1×10⁻⁷"),
        (0.59996, "0.6000"),
        (float("-inf"), "\N{MINUS SIGN}\N{INFINITY}"),
        (True, "yes"),
        (-3, "\N{MINUS SIGN}3"),
        ("a-b", "a-b"),
    ],
)
def test_cells(value: object, text: str) -> None:
    assert cell_text(value) == text


def test_marks_inside_a_link_target_stay_out_of_the_markup() -> None:
    assert str(marked("[a](*b*) [c](d.csv) *e*")) == 'a <a href="d.csv">c</a> <em>e</em>'


@settings(deadline=None)
@given(
    st.lists(st.sampled_from([*"ab[]()*`<>&\"'/:;. \n", "](", "javascript:"])).map("".join),
)
def test_marked_text_never_smuggles_markup(text: str) -> None:
    out = str(marked(text))
    tags = re.findall(r"<[^>]*>", out)
    assert all(re.fullmatch(r'</?(strong|em|code|a)>|<a href="[^"<>]*">', tag) for tag in tags)
    assert 'href="javascript' not in out
    assert 'href="/' not in out


def test_cell_of_a_unit_is_written_as_people_write_it() -> None:
    table = Table(
        "t",
        {"x": [1.0, 2.0], "unit": ["N*m", "1"], "gap": [1.0, 2.0], "gap_unit": ["mN*m/A", "A"]},
        {
            "x": ("x", "see unit"),
            "unit": ("unit of x", ""),
            "gap": ("gap", "see gap_unit"),
            "gap_unit": ("unit of gap", ""),
        },
    )
    block = table_block(table)
    assert block.headers == ("x", "unit", "gap", "gap unit")
    assert block.rows == ((1.0, "N·m", 1.0, "mN·m/A"), (2.0, "", 2.0, "A"))


def test_units_and_percentages_are_written_one_way_in_both_forms(tmp_path: Path) -> None:
    page = Page(
        "Torque in N*m",
        ("**2.00 N*m**, 94.0% of *time*, -3 m/s^2, `a*b` [x](m/s^2.csv).",),
        (Section("In N*m", (("94%",), TableBlock(("N*m",), (("-2 N*m",),), "N*m"))),),
    )
    for text in (html(page, tmp_path), markdown(page, tmp_path)):
        words = (
            text.replace("\N{NO-BREAK SPACE}", " ")
            .replace("a*b", "")
            .replace("m/s^2.csv", "")
            .split("</style>")[-1]
        )
        assert "N*m" not in words
        assert not re.search(r"\d%", words)
        for expected in ("2.00 N·m", "94.0 %", "\N{MINUS SIGN}3 m/s²", "\N{MINUS SIGN}2 N·m"):
            assert expected in words
        assert "a*b" in text
        assert "m/s^2.csv" in text


def test_long_names_in_cells_may_break_and_stay_the_same_text(tmp_path: Path) -> None:
    block = TableBlock(("name",), (("walking_ratio_reversible",),))
    text = html(Page("t", (), (Section("s", (block,)),)), tmp_path)
    assert "walking_<wbr>ratio_<wbr>reversible" in text
