"""Energy and power of a run, of the paper's judgement, and of a sweep."""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.arrays import Array
from pipeline.simulation.walk_stand import IDEAL
from reports.figures.demand import Run
from reports.figures.style import (
    BLUE,
    CYCLE,
    INK,
    ORANGE,
    QUIET,
    house_style,
    new_figure,
    note,
    zero_line,
)
from reports.page import MINUS, TIMES, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

#: Of a bar; names stand between them.
_THICK = 0.45


@house_style()
def electrical_energy_figure(run: Run) -> Figure:
    """Electrical energy of every drivetrain option, a bar each, split by joint."""
    joints, stages = run.labels, run.tables["walking_stage_energy"]
    reference, alternatives = run.titles.get(IDEAL), dict[str, Array]()
    for name, own in stages.groupby("alternative", sort=False):
        last = own[own["stage"] == own["stage"].iloc[-1]].set_index("joint")
        alternatives[run.titles[str(name)]] = last.loc[[*joints], "forward_J"].to_numpy()
    lost = run.machine.options.regeneration == "none"
    kept = "what the motors draw; robot_energy.csv has what their return saves"
    title = f"Electrical energy, leg {run.leg}"
    subtitle = f"{run.name}: one cycle; {'returned energy is lost' if lost else kept}"
    base = float(alternatives[reference].sum()) if reference is not None else 0.0
    rows = {}
    for name, energy in alternatives.items():
        total = float(energy.sum())
        ratio = f", {number(total / base)} {TIMES}" if name != reference and base > 0 else ""
        rows[f"{textwrap.shorten(name, 48)}: {number(total)} J{ratio}"] = energy
    figure = new_figure(0.5 * len(rows) + 1.4, title, subtitle)
    axes, left, values = figure.subplots(), np.zeros(len(rows)), np.array([*rows.values()])
    widest = max(float(values.sum(axis=1).max()), 1e-9)
    for j, (part, color) in enumerate(zip(joints.values(), itertools.cycle(CYCLE), strict=False)):
        look: dict[str, Any] = {"height": _THICK, "color": color, "edgecolor": "white"}
        axes.barh(range(len(rows)), values[:, j], left=left, label=part, **look)
        for row in np.flatnonzero(values[:, j] > 0.1 * widest).tolist():
            middle = float(left[row] + values[row, j] / 2)
            look = {"ha": "center", "va": "center", "color": "white"}
            axes.text(middle, row, number(values[row, j]), **look)
        left += values[:, j]
    for row, name in enumerate(rows):  # above its bar
        note(axes, textwrap.shorten(name, 62), (0, row - _THICK / 2), (0, 2), ha="left", fontsize=9)
    axes.grid(False)
    axes.set_yticks(range(len(rows)), [])
    axes.axvline(0, color=QUIET, linewidth=0.8)
    axes.set_ylim(len(rows) - 0.6, -0.75)
    axes.set_xlim(0, 1.02 * widest)
    figure.legend(loc="outside lower center", ncols=min(4, len(joints)))
    label = "electrical energy per cycle [J]"
    if base > 0 and len(rows) > 1:
        label += f"\n1 {TIMES} is that of {textwrap.shorten(str(reference), 44)}"
    axes.set_xlabel(label)
    return figure


@house_style()
def stage_energy_figure(run: Run, option: str) -> Figure:
    """One panel per joint, one pair of bars per stage: E(+) upwards, E(-) downwards."""
    joints, rows = run.labels, run.tables["walking_stage_energy"]
    rows = rows[(rows["alternative"] == option) & rows["joint"].isin(joints)]
    named = dict(rows[["stage", "stage_name"]].itertuples(index=False, name=None))
    words = f"{run.name}: energy per cycle at each stage, leg {run.leg}"
    figure = new_figure(1.4 + 1.6 * len(joints), run.titles[option], words)
    panels = figure.subplots(len(joints), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    panels[0].yaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
    for axes, (joint, label) in zip(panels, joints.items(), strict=True):
        own = rows[rows["joint"] == joint]
        ways = (
            (own["forward_J"], 1, BLUE, "E(+): from supply to joint"),
            (own["reverse_J"], -1, ORANGE, f"E({MINUS}): from joint to supply"),
        )
        for values, sign, color, meaning in ways:
            bars = axes.bar(range(len(own)), sign * values, width=0.72, color=color, label=meaning)
            none = "0" if sign > 0 else ""
            texts = [none if v < 5e-4 else number(v, 3 if v >= 1 else 2) for v in values]
            axes.bar_label(bars, texts, padding=2, fontsize=8)
        zero_line(axes)
        axes.margins(y=0.14)
        axes.tick_params(axis="x", length=0)
        axes.spines["bottom"].set_visible(False)
        axes.set_title(label, fontweight="bold")
        axes.set_ylabel("energy [J]")
    names = ["\n".join([s, *textwrap.wrap(w, 64 // len(named))]) for s, w in named.items()]
    panels[-1].set_xticks(range(len(named)), names, parse_math=False)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


#: Widths of bars: what is known without any fit, and without the drive's own figure.
_PRIOR, _LEFT_OUT = 1.2, 4.0


@house_style()
def energy_per_minute_figure(tables: Mapping[str, DataFrame], names: Mapping[str, str]) -> Figure:
    """A line for each option, at its left end what is known without it as bars; the crossing.

    Args:
        tables: Of the judgement: ``energy_per_minute``, whose options have the same shares of the
            time standing, and ``break_even``.
        names: Option to what the legend calls it.
    """
    table, crossing = tables["energy_per_minute"], tables["break_even"].iloc[0].to_dict()
    known = bool(np.isfinite(crossing["standing_fraction"]))
    title = "Energy in one minute: both middle legs, as in Fig. 21"
    subtitle = (
        "computed anew with changed numbers"
        if table["prior_low_J"].isna().any()
        else "line: fitted; thin bar: 95 % of what data sheets and literature say; thick bar: "
        "fitted without the drive's own walking figure"
    )
    subtitle = subtitle if known else str(crossing["note"]).split(";")[0]
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
    if known:
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
