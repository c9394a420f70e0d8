"""Where one actuator begins to pay: energy by the share of standing, and a choice's pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from actuators.arrays import Array
from pipeline.paper.judgement.evidence import EnergyPerMinute
from reports.figures.style import (
    BLUE,
    CYCLE,
    INK,
    QUIET,
    VERMILION,
    horizontal_grid,
    house_style,
    new_figure,
)
from reports.typeset import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: The prior's bands are wide and overlap, so they are fainter than those of figures left out.
PRIOR_ALPHA, LEFT_OUT_ALPHA = 0.10, 0.28
_REACH = 4.0  # to either side of the crossing [%]


@dataclass(frozen=True)
class BreakEven:
    """Share of standing above which one alternative uses less energy than another."""

    share: float  #: From 0 to 1.
    energy: float  #: There [J].
    prior: tuple[float, float] | None = None  #: Ends of what is known without any fit, or None.


@house_style()
def energy_per_minute_figure(
    lines: Sequence[EnergyPerMinute],
    names: Mapping[str, str],
    *,
    title: str,
    subtitle: str = "",
    break_even: BreakEven | None = None,
) -> Figure:
    """One line per alternative, what is known without it as bands; the crossing enlarged beside it.

    Args:
        lines: The alternatives, at the same shares of the time standing.
        names: Alternative to what the legend calls it.
        break_even: Marked and enlarged; None where there is none.
    """
    from matplotlib.lines import Line2D

    share = lines[0].fraction
    ratios = [1.5] if break_even is None else [1.5, 1.0]
    figure = new_figure(1.6 + 2.0 * sum(ratios), title, subtitle)
    panels = figure.subplots(len(ratios), 1, height_ratios=ratios, squeeze=False)[:, 0]
    for axes in panels:
        for k, line in enumerate(lines):
            color = CYCLE[k % len(CYCLE)]
            for band, alpha in ((line.prior, PRIOR_ALPHA), (line.left_out, LEFT_OUT_ALPHA)):
                if band is not None:
                    axes.fill_between(share * 100, *band, color=color, alpha=alpha, lw=0)
            axes.plot(share * 100, line.energy, color=color)
        horizontal_grid(axes)
        axes.set_ylabel("energy per minute [J]")
    panels[0].set_xlim(float(share[0]) * 100, float(share[-1]) * 100)
    panels[0].set_ylim(bottom=0)
    panels[-1].set_xlabel("share of the time standing [%]")
    # Names below the panels, where no line crosses them, ordered as the lines at the left.
    handles = [
        Line2D([], [], color=CYCLE[k % len(CYCLE)], label=names[lines[k].alternative])
        for k in sorted(range(len(lines)), key=lambda k: -float(lines[k].energy[0]))
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, columnspacing=1.6)
    if break_even is not None:
        _enlarge(panels[1], share, lines, break_even)
    return figure


def _enlarge(
    axes: Axes, share: Array, lines: Sequence[EnergyPerMinute], break_even: BreakEven
) -> None:
    at = 100 * break_even.share
    spread = [100 * end for end in break_even.prior or ()]
    low, high = max(at - _REACH, 100 * float(share[0])), min(at + _REACH, 100 * float(share[-1]))
    axes.set_xlim(low, high)
    window = np.linspace(low, high, 50) / 100
    crossing = [
        line
        for line in lines
        if abs(float(np.interp(break_even.share, share, line.energy)) - break_even.energy)
        < 0.02 * max(break_even.energy, 1e-9)
    ]
    values = np.array([np.interp(window, share, line.energy) for line in crossing or lines])
    axes.set_ylim(min(0.0, float(values.min())), 1.12 * float(values.max()))
    if spread:
        shown = (max(spread[0], low), min(spread[1], high))
        axes.axvspan(*shown, color=QUIET, alpha=0.12, linewidth=0)
    axes.plot(
        at, break_even.energy, marker="o", markersize=7, color="white", markeredgecolor=INK, mew=1.4
    )
    axes.axvline(at, color=INK, linewidth=0.8, linestyle=(0, (3, 3)))
    text = f"break-even {number(at)} %"
    if spread:
        text += f" (fitted), before the fit {number(spread[0])} to {number(spread[1])} %"
    axes.set_title(text, fontweight="bold", fontsize=9)


@house_style()
def front_figure(mass: Array, power: Array, answer: tuple[float, float]) -> Figure:
    """Robots that none beats in mass and mean power, and the answer.

    Args:
        mass: Of all actuators [kg], shape (N,).
        power: Mean over the day [W], shape (N,).
        answer: Mass and power of what is recommended.
    """
    figure = new_figure(3.6, "Less mass costs energy", "robots that none beats")
    axes = figure.subplots()
    order = np.argsort(mass)
    axes.plot(mass[order], power[order], "o-", color=BLUE, markersize=3.5, label="front")
    axes.plot(*answer, "D", color=VERMILION, markersize=7, label="answer, recomputed in full")
    axes.set_xlabel("mass of all actuators [kg]")
    axes.set_ylabel("mean power over the day [W]")
    horizontal_grid(axes)
    figure.legend(loc="outside lower center", ncols=2)
    return figure
