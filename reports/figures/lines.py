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
#: Of the enlarged panel, to either side of the crossing [%].
_REACH = 4.0


@house_style()
def energy_per_minute_figure(
    table: DataFrame,
    names: Mapping[str, str],
    *,
    title: str,
    subtitle: str = "",
    crossing: Mapping[Any, Any] | None = None,
) -> Figure:
    """A line for each option, what is known without it as bars; the crossing enlarged below.

    Lines are straight and all drives but the ideal one differ most at the left, so that bars there
    tell of the whole.

    Args:
        table: `energy_per_minute`; the options have the same shares of the time standing.
        names: Option to what the legend calls it.
        crossing: The row of `break_even`, marked and enlarged; None where there is none.
    """
    lines = dict([*table.groupby("alternative", sort=False)])
    energy = {name: line["energy_J"].to_numpy() for name, line in lines.items()}
    share = 100 * next(iter(lines.values()))["standing_fraction"].to_numpy()
    ratios = [1.5] if crossing is None else [1.5, 1.0]
    figure = new_figure(1.6 + 2.0 * sum(ratios), title, subtitle)
    panels = figure.subplots(len(ratios), 1, height_ratios=ratios, squeeze=False)[:, 0]
    for axes in panels:
        for name, color in zip(lines, CYCLE, strict=False):
            axes.plot(share, energy[name], color=color, label=names[name])
        axes.set_ylabel("energy per minute [J]")
    for k, (line, color) in enumerate(zip(lines.values(), CYCLE, strict=False)):
        for what, width in (("prior", _PRIOR), ("left_out", _LEFT_OUT)):
            ends = line[[f"{what}_low_J", f"{what}_high_J"]].iloc[0]
            if np.isfinite(ends).all():
                panels[0].plot([share[0] - 2 - 2 * k] * 2, ends, color=color, lw=width)
    panels[0].set_xlim(share[0] - 2 * len(lines) - 2, share[-1])
    panels[0].set_ylim(bottom=0)
    panels[-1].set_xlabel("share of the time standing [%]")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, columnspacing=1.6)
    if crossing is not None:
        axes, at = panels[1], 100 * crossing["standing_fraction"]
        height = float(np.interp(at, share, energy["reversible"]))
        low, high = max(at - _REACH, share[0]), min(at + _REACH, share[-1])
        values = np.array([np.interp([low, high], share, line) for line in energy.values()])
        near = np.abs(values.mean(axis=1) - height) < 0.25 * height + 1e-9
        shown = values[near] if near.any() else values
        axes.set_xlim(low, high)
        axes.set_ylim(min(0.0, float(shown.min())), 1.12 * float(shown.max()))
        axes.axvline(at, color=INK, linewidth=0.8, linestyle=(0, (3, 3)))
        axes.plot(at, height, "o", markersize=7, color="white", mec=INK, mew=1.4)
        text = f"break-even {number(at)} %"
        ends = 100 * np.array([crossing["prior_low"], crossing["prior_high"]], float)
        if np.isfinite(ends).all():
            axes.axvspan(*np.clip(ends, low, high), color=QUIET, alpha=0.12, linewidth=0)
            text += f" (fitted), before the fit {number(ends[0])} to {number(ends[1])} %"
        axes.set_title(text, fontweight="bold", fontsize=9)
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
