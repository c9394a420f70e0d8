"""Waterfall: how the gap shrinks effect by effect, down to the noise floor."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

from reports.figures.style import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    QUIET,
    WIDTH,
    house_style,
    name_rows,
    new_figure,
    number,
)
from reports.typeset import unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: A change below this share of the whole gap is none.
_NOTHING = 0.003


@house_style()
def gap_waterfall_figure(
    before: float,
    steps: Sequence[tuple[str, float]],
    noise_floor: float,
    unit: str,
    *,
    title: str,
    subtitle: str = "",
    width: float = WIDTH,
) -> Figure:
    """Draw it from top to bottom.

    Args:
        before: Gap of the model as it was.
        steps: Effects in the order of acceptance, each with the gap after it.
        noise_floor: What no model can explain.
        width: [in]; labels stand above their bars where it is less than usual.
    """
    labels = ["model as it was", *(label for label, _ in steps), "what is left"]
    narrow = width < WIDTH
    height = (0.54 if narrow else 0.42) * len(labels) + 1.5
    figure = new_figure(height, title, subtitle, width=width)
    ax = figure.subplots()
    thick = 0.42 if narrow else 0.62
    gaps = [before, *(gap for _, gap in steps)]
    last = len(labels) - 1
    _bars(ax, gaps, thick)
    beside = max(gaps[-1], noise_floor if gaps[-1] > 0.5 * noise_floor else 0.0)
    ax.text(beside, last, f" {number(gaps[-1])}", va="center", fontsize=8.5)
    ax.axvline(noise_floor, color=INK, linewidth=1.0, linestyle=(0, (4, 2)))
    ax.text(
        noise_floor,
        -0.62,
        f" noise floor {number(noise_floor)} {unit_text(unit)}",
        va="bottom",
        fontsize=8,
        color=QUIET,
    )
    name_rows(ax, labels, thick, above=narrow)
    ax.set_xlim(0, (1.2 if narrow else 1.14) * max([*gaps, noise_floor]))
    ax.set_ylim(last + 0.55, -1.05)
    ax.set_xlabel(f"gap on held-out data, root mean square [{unit_text(unit)}]")
    return figure


def _bars(ax: Axes, gaps: Sequence[float], thick: float) -> None:
    """The gap before, each fall or rise, and what is left."""
    ax.barh(0, gaps[0], color=ORANGE, height=thick)
    ax.text(gaps[0], 0, f" {number(gaps[0])}", va="center", fontsize=8.5)
    for k, (old, new) in enumerate(pairwise(gaps), start=1):
        ax.barh(k, old - new, left=new, color=GREEN if new < old else ORANGE, height=thick)
        ax.plot([old, old], [k - 1 + thick / 2, k - thick / 2], color=QUIET, linewidth=0.8)
        sign = "\N{MINUS SIGN}" if new <= old else "+"
        change = f"{sign}{number(abs(old - new), 2)}"
        if abs(new - old) < _NOTHING * gaps[0]:
            change = "0"
        ax.text(max(old, new), k, f" {change}", va="center", fontsize=8.5)
    last = len(gaps)
    ax.barh(last, gaps[-1], color=BLUE, height=thick)
    if last > 1:
        ends = [last - 1 + thick / 2, last - thick / 2]
        ax.plot([gaps[-1]] * 2, ends, color=QUIET, linewidth=0.8)
