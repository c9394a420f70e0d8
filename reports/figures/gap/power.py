"""The supply's power: over time, and its shares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
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


@dataclass(frozen=True)
class PowerTrace:
    """Samples of one log's supply, each shape (K,).

    Attributes:
        time: Of the samples [s].
        measured: [W].
        model: Sum over the drives [W].
        explained: The same with all terms [W].
        held_out: Held-out samples, shaded.
    """

    time: Array
    measured: Array
    model: Array
    explained: Array
    held_out: NDArray[np.bool_]


@house_style()
def power_time_figure(trace: PowerTrace, *, title: str, subtitle: str = "") -> Figure:
    """Draw measured, model's and explained power; below, what is left."""
    figure = new_figure(4.8, title, subtitle)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
    t = trace.time
    top.plot(t, trace.measured, color=_PALE, linewidth=3.2, label="measured at the supply")
    top.plot(t, trace.model, color=ORANGE, linewidth=1.1, label="model's sum over the drives")
    top.plot(t, trace.explained, color=BLUE, linewidth=1.1, label="with all terms found")
    top.set_ylabel("power [W]")
    top.set_ylim(bottom=min(0.0, float(np.min([trace.measured, trace.explained]))))
    zero_line(bottom)
    bottom.plot(t, trace.measured - trace.explained, color=BLUE, linewidth=1.0)
    bottom.set_ylabel("unexplained [W]")
    bottom.set_xlabel("time [s]")
    edges = np.flatnonzero(np.diff(np.concatenate([[0], trace.held_out.astype(np.int8), [0]])))
    for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        for axes in (top, bottom):
            axes.axvspan(
                t[max(start - 1, 0)], t[stop - 1], color=YELLOW, alpha=0.18, linewidth=0, zorder=0
            )
    figure.legend(*top.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


@dataclass(frozen=True)
class PowerBar:
    """One term's mean power with its 95 % interval [W].

    Attributes:
        name: Of the term.
        mean: [W].
        low: [W].
        high: [W].
        kind: ``"model"``, ``"found"`` or ``"left"``.
    """

    name: str
    mean: float
    low: float
    high: float
    kind: str


@house_style()
def power_shares_figure(
    bars: Sequence[PowerBar],
    measured: float,
    *,
    title: str,
    subtitle: str = "",
    width: float = WIDTH,
) -> Figure:
    """Draw terms from the top, each where those above it end, and what was measured as a line.

    Args:
        bars: Terms in order, what is unexplained last.
        measured: [W].
        title: Headline.
        subtitle: Second line.
        width: [in]; labels stand above their bars where it is less than usual.
    """
    narrow = width < WIDTH
    figure = new_figure((0.54 if narrow else 0.42) * len(bars) + 1.5, title, subtitle, width=width)
    axes, thick = figure.subplots(), 0.42 if narrow else 0.62
    colors = {"model": BLUE, "found": GREEN, "left": ORANGE}
    at = 0.0
    for row, bar in enumerate(bars):
        axes.barh(row, bar.mean, left=at, color=colors[bar.kind], height=thick)
        if bar.high > bar.low:
            axes.plot([at + bar.low, at + bar.high], [row, row], color=INK, linewidth=1.2)
        text = f" {number(bar.mean)} W"
        end = max(at, at + bar.mean, at + bar.high)
        # On white, so that the line of what was measured does not run through the number.
        paper = {"facecolor": "white", "edgecolor": "none", "pad": 0}
        axes.text(end, row, text, va="center", fontsize=8.5, bbox=paper, zorder=4)
        at += bar.mean
    axes.axvline(measured, color=QUIET, linewidth=1.0, linestyle=(0, (4, 2)), zorder=1)
    axes.text(
        *(measured, -0.62, f"measured {number(measured)} W "),
        ha="right",
        va="bottom",
        fontsize=8,
        color=QUIET,
    )
    name_rows(axes, [bar.name for bar in bars], thick, above=narrow)
    axes.set_xlim(min(0.0, at), 1.16 * max(measured, at))
    axes.set_ylim(len(bars) - 0.45, -1.05)
    axes.set_xlabel("mean power on held-out samples [W]")
    return figure
