"""The measure finds what a reader would object to, and nothing else."""

from __future__ import annotations

from matplotlib.figure import Figure

from reports.figures.style import new_figure
from tests.reports import geometry


def figure(*texts: tuple[float, float, str], line: bool = False) -> Figure:
    out = new_figure(3.0)
    axes = out.subplots()
    axes.set_xlim(0, 1)
    axes.set_ylim(0, 1)
    for x, y, text in texts:
        axes.text(x, y, text)
    if line:
        axes.plot([0.2, 0.8], [0.2, 0.8])
    return out


def test_a_line_through_a_text_is_found() -> None:
    assert geometry.crossed(figure((0.5, 0.5, "crossed"), line=True)) == ["crossed"]
    assert geometry.crossed(figure((0.1, 0.8, "apart"), line=True)) == []
    assert geometry.crossed(figure((0.5, 0.5, "alone"))) == []


def test_an_edge_an_arrow_and_a_grid_line_through_a_text_are_found() -> None:
    edge = figure((0.5, 0.5, "text"))
    edge.axes[0].axvspan(0.1, 0.52, fill=False, edgecolor="black")
    arrow = figure((0.5, 0.5, "text"))
    arrow.axes[0].annotate("", (0.9, 0.52), (0.1, 0.52), arrowprops={"arrowstyle": "->"})
    grid = figure((0.5, 0.49, "text"))
    grid.axes[0].set_yticks([0.5])
    grid.axes[0].grid(True, axis="y")
    for each in (edge, arrow, grid):
        assert geometry.crossed(each) == ["text"]


def test_a_text_with_a_background_may_lie_on_a_line() -> None:
    out = figure(line=True)
    out.axes[0].text(0.5, 0.5, "text", bbox={"facecolor": "white"})
    assert geometry.crossed(out) == []


def test_texts_on_one_another_and_cut_texts_are_found() -> None:
    assert geometry.overlapping(figure((0.5, 0.5, "one"), (0.51, 0.51, "two"))) == [("one", "two")]
    assert geometry.overlapping(figure((0.1, 0.5, "one"), (0.7, 0.5, "two"))) == []
    out = figure()
    out.text(0.98, 0.5, "cut by the edge")
    assert geometry.outside(out) == ["cut by the edge"]


def test_size_of_letters_is_that_on_the_page() -> None:
    out = figure()
    out.text(0.5, 0.5, "small", fontsize=5.0)
    assert geometry.smallest_letters(out) == 5.0 * geometry.PAGE / (72 * 9.5)
