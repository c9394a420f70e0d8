"""A page in a browser: nothing cut at any width, and nothing cut in print."""

from __future__ import annotations

from pathlib import Path

import pytest

from reports.figures.save import save_figure
from reports.figures.style import new_figure
from reports.forms import write_pages
from reports.page import FigureBlock, Page, Section, TableBlock
from tests.reports.browser import layout, needs_chromium, needs_poppler, printed

pytestmark = needs_chromium
LONG = "a sentence of the kind that a verdict needs, with walking_ratio_reversible in it"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """As many columns as the widest table of a run, and three times as many."""
    folder = tmp_path_factory.mktemp("page")
    figure = new_figure(4.0)
    figure.subplots().plot([0, 1], [0, 1])
    save_figure(figure, folder, "figure")
    columns = 11
    fits = TableBlock(
        (*(f"heading in words {k}" for k in range(columns - 1)), "verdict"),
        ((LONG, "section IV.B", *[-0.0012345] * (columns - 3), "Z0"),) * 3,
        "fits",
    )
    wide = TableBlock(
        (*(f"heading in words {k}" for k in range(3 * columns - 1)), "verdict"),
        ((LONG, LONG, *[-0.0012345] * (3 * columns - 3), "Z1"),) * 3,
        "wide",
    )
    title = "A page whose title is long enough for two lines on a telephone"
    blocks = (LONG, fits, FigureBlock(folder / "figure.svg", "f"), wide)
    write_pages(Page(title, (LONG,) * 2, (Section("s", blocks),)), folder)
    return folder / "index.html"


@pytest.mark.parametrize("width", [1280, 400])
def test_nothing_is_wider_than_the_window(page: Path, tmp_path: Path, width: int) -> None:
    """Tables that are, scroll in a frame that is not; pictures shrink and keep their shape."""
    seen = layout(page, width, tmp_path)
    assert seen.window <= width
    assert seen.page <= seen.window
    assert seen.beyond == []
    for picture in seen.pictures:
        assert 0 <= picture["left"] < picture["right"] <= seen.window  # its frame, which scrolls
        assert picture["shape"] == pytest.approx(1.0, abs=0.06)  # with its frame
    assert len(seen.tables) == 2
    for table in seen.tables:
        assert table["right"] <= seen.window
        assert table["table"] <= table["frame"] or table["scrolls"] == "auto"
    fits, wide = (table["table"] <= table["frame"] for table in seen.tables)
    assert fits == (width == 1280)
    assert not wide


@needs_poppler
def test_print_cuts_no_column(page: Path, tmp_path: Path) -> None:
    words = printed(page, tmp_path)
    assert all(word.right <= 1.0 and word.bottom <= 1.0 for word in words)
    for k in range(2):
        assert sum(word.text == f"Z{k}" for word in words) == 3
