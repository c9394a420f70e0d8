"""Ranges of what is predicted with what was measured in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from reports.figures.style import BLUE, INK, NARROW, SHADE_DARK, VERMILION, house_style, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Range:
    """One row of the figure."""

    label: str  #: What it is, a few words a line.
    predicted: tuple[float, float, float]  #: Least, nominal and greatest.
    measured: Sequence[float] = ()  #: As measured; none, one, or the ends of a range.


@house_style()
def ranges_figure(rows: Sequence[Range], *, title: str, unit: str, subtitle: str = "") -> Figure:
    """A bar from least to greatest for each row, on a logarithmic axis.

    Args:
        rows: From the top down; all numbers above zero.
        unit: Of the axis, with the quantity.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    figure = new_figure(1.5 + 0.62 * len(rows), title, subtitle, width=NARROW)
    axes = figure.subplots()
    for k, row in enumerate(rows):
        low, nominal, high = row.predicted
        axes.barh(k, high - low, left=low, height=0.44, color=SHADE_DARK, zorder=2)
        axes.plot([nominal, nominal], [k - 0.22, k + 0.22], color=BLUE, linewidth=2.4, zorder=3)
        if row.measured:
            axes.plot(row.measured, [k] * len(row.measured), "-o", color=VERMILION, zorder=4)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.set_yticks(range(len(rows)), [row.label for row in rows])
    axes.set_ylim(len(rows) - 0.45, -0.55)
    axes.set_xlabel(unit)
    axes.grid(axis="x", zorder=0)
    keys = [
        Patch(color=SHADE_DARK, label="predicted range"),
        Line2D([], [], color=BLUE, linewidth=2.4, label="likeliest"),
        Line2D([], [], color=VERMILION, marker="o", label="measured"),
    ]
    figure.legend(handles=keys, loc="outside lower center", ncols=3, labelcolor=INK)
    return figure
