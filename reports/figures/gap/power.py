"""The supply's power: over time, and its shares."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pipeline.identification.supply.account import BASIS_FOUND, MEASURED, Account, Share
from pipeline.logs.signals.grid import runs_of
from reports.figures.style import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    QUIET,
    WIDTH,
    YELLOW,
    house_style,
    name_rows,
    new_figure,
    number,
    zero_line,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PALE = "#b4bac1"


@house_style()
def power_time_figure(balance: Account, *, title: str) -> Figure:
    """Draw measured, model's and explained power of the first log; below, what is left."""
    own = balance.rows.log == 0
    count = np.count_nonzero(own)
    subtitle = f"log '{balance.logs[0]}', {count} samples; shaded: held-out samples"
    figure = new_figure(4.8, title, subtitle)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
    t, measured, explained = balance.rows.end[own], balance.rows.power[own], balance.explained[own]
    model = balance.rows.predicted[own]
    top.plot(t, measured, color=_PALE, linewidth=3.2, label="measured at the supply")
    top.plot(t, model, color=ORANGE, linewidth=1.1, label="model's sum over the drives")
    top.plot(t, explained, color=BLUE, linewidth=1.1, label="with all terms found")
    top.set_ylabel("power [W]")
    top.set_ylim(bottom=min(0.0, float(np.min([measured, explained]))))
    zero_line(bottom)
    bottom.plot(t, measured - explained, color=BLUE, linewidth=1.0)
    bottom.set_ylabel("unexplained [W]")
    bottom.set_xlabel("time [s]")
    for start, stop in np.column_stack(runs_of(balance.proves[own])).tolist():
        for axes in (top, bottom):
            axes.axvspan(
                t[max(start - 1, 0)], t[stop - 1], color=YELLOW, alpha=0.18, linewidth=0, zorder=0
            )
    figure.legend(*top.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


@house_style()
def power_shares_figure(shares: Sequence[Share], *, title: str, width: float = WIDTH) -> Figure:
    """Draw terms from the top, each where those above it end, and what was measured as a line.

    Args:
        shares: Terms in order with their 95 % intervals, what was measured among them.
        width: [in]; labels stand above their bars where it is less than usual.
    """
    bars = [s for s in shares if s.term != MEASURED]
    measured = next(s.watts for s in shares if s.term == MEASURED)
    narrow, subtitle = width < WIDTH, "blue: by log and model; green: found; orange: unexplained"
    figure = new_figure((0.54 if narrow else 0.42) * len(bars) + 1.5, title, subtitle, width=width)
    axes, thick = figure.subplots(), 0.42 if narrow else 0.62
    colors = {BASIS_FOUND: GREEN, "": ORANGE}
    at = 0.0
    for row, bar in enumerate(bars):
        mean, low, high = bar.watts, bar.watts_low, bar.watts_high
        axes.barh(row, mean, left=at, color=colors.get(bar.basis, BLUE), height=thick)
        if high > low:
            axes.plot([at + low, at + high], [row, row], color=INK, linewidth=1.2)
        text = f" {number(mean)} W"
        # On white, so that the line of what was measured does not run through the number.
        paper = {"facecolor": "white", "edgecolor": "none", "pad": 0}
        end = max(at, at + mean, at + high)
        axes.text(end, row, text, va="center", fontsize=8.5, bbox=paper, zorder=4)
        at += mean
    axes.axvline(measured, color=QUIET, linewidth=1.0, linestyle=(0, (4, 2)), zorder=1)
    axes.text(
        *(measured, -0.62, f"measured {number(measured)} W "),
        ha="right",
        va="bottom",
        fontsize=8,
        color=QUIET,
    )
    name_rows(axes, [bar.term.replace("_", " ") for bar in bars], thick, above=narrow)
    axes.set_xlim(min(0.0, at), 1.16 * max(measured, at))
    axes.set_ylim(len(bars) - 0.45, -1.05)
    axes.set_xlabel("mean power on held-out samples [W]")
    return figure
