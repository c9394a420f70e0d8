"""Power and energy over what a designer varies: time spent standing, mass, a sweep's number."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from reports.figures.style import CYCLE, INK, QUIET, house_style, new_figure
from reports.typeset import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

#: Widths of bars: what is known without any fit, and without the drive's own figure.
_PRIOR, _LEFT_OUT = 1.2, 4.0


@house_style()
def energy_per_minute_figure(
    table: DataFrame,
    names: Mapping[str, str],
    *,
    title: str,
    subtitle: str = "",
    crossing: Mapping[Any, Any] | None = None,
) -> Figure:
    """A line for each option, at its left end what is known without it as bars; the crossing.

    Args:
        table: `energy_per_minute`; the options have the same shares of the time standing.
        names: Option to what the legend calls it.
        crossing: The row of `break_even`, marked; None where there is none.
    """
    figure = new_figure(4.4, title, subtitle)
    axes, left = figure.subplots(), 0.0
    for (name, line), color in zip(table.groupby("alternative", sort=False), CYCLE, strict=False):
        share = 100 * line["standing_fraction"]
        axes.plot(share, line["energy_J"], color=color, label=names[str(name)])
        for what, width in (("prior", _PRIOR), ("left_out", _LEFT_OUT)):
            ends = line[[f"{what}_low_J", f"{what}_high_J"]].iloc[0]
            if np.isfinite(ends).all():
                axes.plot([left - 2] * 2, ends, color=color, linewidth=width)
        left -= 2
    axes.set_xlim(left - 2, 100)
    axes.set_ylim(bottom=0)
    axes.set_xlabel("share of the time standing [%]")
    axes.set_ylabel("energy per minute [J]")
    if crossing is not None:
        at = 100 * crossing["standing_fraction"]
        axes.axvline(at, color=INK, linewidth=0.8, linestyle=(0, (3, 3)))
        text = f"break-even {number(at)} %"
        fit = 100 * np.array([crossing["prior_low"], crossing["prior_high"]], float)
        if np.isfinite(fit).all():
            axes.axvspan(*fit, color=QUIET, alpha=0.12, linewidth=0)
            text += f" (fitted), before the fit {number(fit[0])} to {number(fit[1])} %"
        axes.set_title(text, fontweight="bold", fontsize=9)
    figure.legend(loc="outside lower center", ncols=2, columnspacing=1.6)
    return figure


@house_style()
def sweep_figure(rows: DataFrame, axis: str) -> Figure:
    """Mean power by actuator; shaded from the least to the greatest over what else is varied.

    Args:
        rows: Of the cases that walk, as `pipeline/columns.csv` has the table ``sweep``.
        axis: The column that is drawn along.
    """
    words = axis.replace("_", " ")
    figure = new_figure(3.6, f"Mean power over {words}", "cases that walk")
    axes = figure.subplots()
    for (name, own), color in zip(rows.groupby("alternative", sort=False), CYCLE, strict=False):
        power = own.groupby(axis, sort=not isinstance(own[axis].iloc[0], str))["average_power_W"]
        middle, low, high = power.median(), power.min(), power.max()
        axes.plot(middle.index, middle, "o-", color=color, markersize=3, label=str(name))
        axes.fill_between(middle.index, low, high, color=color, alpha=0.15, linewidth=0)
    axes.set_xlabel(words)
    axes.set_ylabel("mean power [W]")
    figure.legend(loc="outside lower center", ncols=4)
    return figure
