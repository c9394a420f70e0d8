"""Energy and power as bars and lines: what a whole is made of, stages, break-even, a choice."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from textwrap import shorten
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.arrays import Array
from reports.figures.style import (
    BLUE,
    CYCLE,
    FORWARD,
    GREEN,
    INK,
    ORANGE,
    QUIET,
    REVERSE,
    VERMILION,
    horizontal_grid,
    house_style,
    new_figure,
    note,
    on_white,
    zero_line,
)
from reports.typeset import TIMES, number, unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from actuators.energy.energy import StageEnergy
    from pipeline.identification.supply.account import Share

#: Of a bar; names stand between them.
_THICK = 0.45
#: A change below this share of the whole gap is none.
_NOTHING = 0.003


@house_style()
def electrical_energy_figure(
    joints: Sequence[str],
    alternatives: Mapping[str, Array],
    *,
    reference: str | None,
    title: str,
    subtitle: str = "",
) -> Figure:
    """Electrical energy of all alternatives, one stacked bar each, split by joint.

    Args:
        joints: Labels of the parts, J of them.
        alternatives: Name to energy per joint, shape (J,) [J].
        reference: The alternative to which the ratio in a bar's name is; None for no ratio.
    """
    from matplotlib.patches import Patch

    totals = {name: float(a.sum()) for name, a in alternatives.items()}
    base = totals[reference] if reference is not None else 0.0
    widest = max(*totals.values(), 1e-9)
    names = []
    for name, total in totals.items():
        ratio = f", {number(total / base)} {TIMES}" if name != reference and base > 0 else ""
        names.append(f"{shorten(name, 48)}: {number(total)} J{ratio}")
    figure, axes = _rows(names, title, subtitle)
    for row, parts in enumerate(alternatives.values()):
        left = 0.0
        for j, value in enumerate(parts):
            color = CYCLE[j % len(CYCLE)]
            axes.barh(row, value, left=left, height=_THICK, color=color, edgecolor="white")
            if value > 0.08 * widest:
                middle = left + value / 2
                axes.text(middle, row, number(value), ha="center", va="center", color="white")
            left += value
    axes.set_xlim(0, 1.02 * widest)
    label = "electrical energy per cycle [J]"
    if reference is not None and len(alternatives) > 1:
        label += f"\n1 {TIMES} is that of {shorten(reference, 44)}"
    axes.set_xlabel(label)
    keys = [Patch(color=CYCLE[j % len(CYCLE)], label=joint) for j, joint in enumerate(joints)]
    figure.legend(handles=keys, loc="outside lower center", ncols=min(4, len(keys)))
    return figure


def _rows(names: Sequence[str], title: str, subtitle: str = "") -> tuple[Figure, Axes]:
    """A figure with a row for each bar from the top down, its name above it."""
    figure = new_figure(0.5 * len(names) + 1.4, title, subtitle)
    axes = figure.subplots()
    axes.set_yticks(range(len(names)), [])
    for row, name in enumerate(names):
        look: dict[str, Any] = {"va": "bottom", "bbox": on_white(0.5), "zorder": 3}
        note(axes, shorten(name, 62), (0, row - _THICK / 2), (0, 1), **look)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.axvline(0, color=QUIET, linewidth=0.8)
    axes.set_ylim(len(names) - 0.6, -0.75)
    return figure, axes


@house_style()
def gap_waterfall_figure(
    before: float,
    steps: Sequence[tuple[str, float]],
    noise_floor: float,
    unit: str,
    *,
    title: str,
    subtitle: str = "",
) -> Figure:
    """How the gap shrinks effect by effect from top to bottom, down to the noise floor.

    Args:
        before: Gap of the model as it was.
        steps: Effects in the order of acceptance, each with the gap after it.
        noise_floor: What no model can explain.
    """
    gaps, unit = [before, *(gap for _, gap in steps)], unit_text(unit)
    last = len(gaps)
    floor = f"dashed: noise floor, {number(noise_floor)} {unit}"
    labels = ["model as it was", *(label for label, _ in steps), "what is left"]
    figure, axes = _rows(labels, title, f"{subtitle}; {floor}" if subtitle else floor)
    axes.barh([0, last], [gaps[0], gaps[-1]], color=[ORANGE, BLUE], height=_THICK)
    words = [number(gaps[0])]
    for k, (old, new) in enumerate(pairwise(gaps), start=1):
        axes.barh(k, old - new, left=new, color=GREEN if new < old else ORANGE, height=_THICK)
        sign = "\N{MINUS SIGN}" if new <= old else "+"
        nothing = abs(new - old) < _NOTHING * gaps[0]
        words.append("0" if nothing else f"{sign}{number(abs(old - new), 2)}")
    tops = [gaps[0], *(max(pair) for pair in pairwise(gaps)), gaps[-1]]
    for k, (top, word) in enumerate(zip(tops, [*words, number(gaps[-1])], strict=True)):
        look: dict[str, Any] = {"va": "center", "fontsize": 8.5, "bbox": on_white(0)}
        axes.text(top, k, f" {word}", zorder=3, **look)
        if k:
            ends = [k - 1 + _THICK / 2, k - _THICK / 2]
            axes.plot([gaps[k - 1]] * 2, ends, color=QUIET, linewidth=0.8)
    axes.axvline(noise_floor, color=INK, linewidth=1.0, linestyle=(0, (4, 2)))
    axes.set_xlim(0, 1.2 * max([*gaps, noise_floor]))
    axes.set_xlabel(f"gap on held-out data, root mean square [{unit}]")
    return figure


@house_style()
def power_shares_figure(shares: Sequence[Share], *, title: str) -> Figure:
    """Draw terms from the top, each where those above it end, and what was measured as a line.

    Args:
        shares: Terms in order with their 95 % intervals, what was measured among them.
    """
    # Here, and not above: it brings the statistics with which terms are chosen.
    from pipeline.identification.supply.account import BASIS_FOUND, MEASURED

    bars = [s for s in shares if s.term != MEASURED]
    measured = next(s.watts for s in shares if s.term == MEASURED)
    subtitle = "blue: by log and model; green: found; orange: unexplained; dashed: measured, "
    subtitle += f"{number(measured)} W"
    figure, axes = _rows([bar.term.replace("_", " ") for bar in bars], title, subtitle)
    colors = {BASIS_FOUND: GREEN, "": ORANGE}
    at = 0.0
    for row, bar in enumerate(bars):
        mean, low, high = bar.watts, bar.watts_low, bar.watts_high
        axes.barh(row, mean, left=at, color=colors.get(bar.basis, BLUE), height=_THICK)
        if high > low:
            axes.plot([at + low, at + high], [row, row], color=INK, linewidth=1.2)
        # On white, so that the line of what was measured does not run through the number.
        look: dict[str, Any] = {"va": "center", "fontsize": 8.5, "bbox": on_white(0), "zorder": 4}
        axes.text(max(at, at + mean, at + high), row, f" {number(mean)} W", **look)
        at += mean
    axes.axvline(measured, color=QUIET, linewidth=1.0, linestyle=(0, (4, 2)), zorder=1)
    axes.set_xlim(min(0.0, at), 1.22 * max(measured, at))
    axes.set_xlabel("mean power on held-out samples [W]")
    return figure


@house_style()
def day_figure(modes: Sequence[str], losses: Mapping[str, Array], hours: Sequence[float]) -> Figure:
    """Where the energy of a day goes, a bar for each mode.

    Args:
        modes: Names, from the top down.
        losses: What takes it: energy of every mode [Wh], shape (M,).
        hours: Of each mode in a day.
    """
    title = "Where the energy of a day goes"
    figure = new_figure(1.7 + 0.5 * len(modes), title)
    axes = figure.subplots()
    left, at = np.zeros(len(modes)), np.arange(len(modes))
    for color, (name, energy) in zip(CYCLE, losses.items(), strict=False):
        axes.barh(at, energy, left=left, height=0.55, color=color, label=name, zorder=2)
        left = left + energy
    for k, total in enumerate(left):
        axes.text(total, k, f" {number(total)} Wh", va="center", color=INK, fontsize=8)
    labels = [f"{mode}\n{number(h)} h" for mode, h in zip(modes, hours, strict=True)]
    axes.set_yticks(at, labels)
    axes.set_xlim(0, 1.25 * float(left.max()))
    axes.invert_yaxis()
    axes.set_xlabel("energy in a day [Wh]")
    axes.grid(axis="x", zorder=0)
    figure.legend(loc="outside lower center", ncols=3, fontsize=8)
    return figure


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
    table: DataFrame,
    names: Mapping[str, str],
    *,
    title: str,
    subtitle: str = "",
    break_even: BreakEven | None = None,
) -> Figure:
    """One line per alternative, what is known without it as bands; the crossing enlarged beside it.

    Args:
        table: `energy_per_minute`; the alternatives have the same shares of the time standing.
        names: Alternative to what the legend calls it.
        break_even: Marked and enlarged; None where there is none.
    """
    from matplotlib.lines import Line2D

    lines = dict([*table.groupby("alternative", sort=False)])
    energy = {name: line["energy_J"].to_numpy() for name, line in lines.items()}
    share = next(iter(lines.values()))["standing_fraction"].to_numpy()
    ratios = [1.5] if break_even is None else [1.5, 1.0]
    figure = new_figure(1.6 + 2.0 * sum(ratios), title, subtitle)
    panels = figure.subplots(len(ratios), 1, height_ratios=ratios, squeeze=False)[:, 0]
    for axes in panels:
        for k, (name, line) in enumerate(lines.items()):
            color = CYCLE[k % len(CYCLE)]
            for what, alpha in (("prior", PRIOR_ALPHA), ("left_out", LEFT_OUT_ALPHA)):
                band = line[[f"{what}_low_J", f"{what}_high_J"]].to_numpy().T
                if np.isfinite(band).all():
                    axes.fill_between(share * 100, *band, color=color, alpha=alpha, lw=0)
            axes.plot(share * 100, energy[name], color=color)
        horizontal_grid(axes)
        axes.set_ylabel("energy per minute [J]")
    panels[0].set_xlim(float(share[0]) * 100, float(share[-1]) * 100)
    panels[0].set_ylim(bottom=0)
    panels[-1].set_xlabel("share of the time standing [%]")
    # Names below the panels, where no line crosses them, ordered as the lines at the left.
    handles = [
        Line2D([], [], color=CYCLE[k % len(CYCLE)], label=names[name])
        for k, name in sorted(enumerate(energy), key=lambda one: -float(energy[one[1]][0]))
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, columnspacing=1.6)
    if break_even is not None:
        _enlarge(panels[1], share, [*energy.values()], break_even)
    return figure


def _enlarge(axes: Axes, share: Array, lines: Sequence[Array], break_even: BreakEven) -> None:
    at = 100 * break_even.share
    spread = [100 * end for end in break_even.prior or ()]
    low, high = max(at - _REACH, 100 * float(share[0])), min(at + _REACH, 100 * float(share[-1]))
    axes.set_xlim(low, high)
    window = np.linspace(low, high, 50) / 100
    crossing = [
        line
        for line in lines
        if abs(float(np.interp(break_even.share, share, line)) - break_even.energy)
        < 0.02 * max(break_even.energy, 1e-9)
    ]
    values = np.array([np.interp(window, share, line) for line in crossing or lines])
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


@house_style()
def stage_energy_figure(
    stages: Sequence[StageEnergy],
    joints: Mapping[str, str],
    *,
    places: Mapping[str, str],
    title: str,
    subtitle: str = "",
    limits: tuple[float, float] | None = None,
) -> Figure:
    """One panel per joint, one pair of bars per stage: E(+) upwards, E(-) downwards.

    Args:
        stages: From the joint to the supply, energy in one cycle.
        joints: Those to draw, name to label of the panel.
        places: Stage to the words that say where it is, as `Alternative.stage_names` has them.
        limits: Largest E(+) and E(-) to scale for [J], to give several figures the same scale.
    """
    from matplotlib.patches import Patch

    forward, reverse = _energies(stages, joints)
    top, bottom = limits or energy_limits([stages], joints)
    # A stage's energy as a formula; what TeX would read otherwise stands for itself.
    plain = [re.sub(r"([_#%&${}])", r"\\\1", s.stage) for s in stages]
    symbols = [rf"$E_{{\mathrm{{{stage}}}}}$" for stage in plain]
    words = [places[s.stage].replace("$", r"\$") for s in stages]  # no formula
    # Words too long for a bar stand once, in the key.
    long = [f"{s}  {w}" for s, w in zip(symbols, words, strict=True) if " " in w]
    figure = new_figure(1.4 + 1.75 * len(joints) + 0.2 * len(long), title, subtitle)
    panels = figure.subplots(len(joints), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    room = 0.11 * (top + bottom)  # for the values at the ends of the bars
    panels[0].set_ylim(-bottom - room, top + room)
    panels[0].yaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
    x = np.arange(len(stages))
    for j, (axes, joint) in enumerate(zip(panels, joints.values(), strict=True)):
        for values, sign, color in ((forward[:, j], 1, FORWARD), (reverse[:, j], -1, REVERSE)):
            axes.bar(x, sign * values, width=0.72, color=color)
            look: dict[str, Any] = {"fontsize": 8, "ha": "center", "color": INK}
            look |= {"bbox": on_white(0.4), "va": "bottom" if sign > 0 else "top"}
            for at, value in zip(x, values, strict=True):
                text = "0" if value < 5e-4 else number(value, 3 if value >= 1 else 2)
                note(axes, text, (float(at), sign * float(value)), (0, 2 * sign), **look)
        zero_line(axes)
        horizontal_grid(axes)
        axes.tick_params(axis="x", length=0)
        axes.spines["bottom"].set_visible(False)
        axes.set_title(joint, fontweight="bold")
        axes.set_ylabel("energy [J]")
    short = ["" if " " in w else w for w in words]
    panels[-1].set_xticks(x, [f"{s}\n{w}" for s, w in zip(symbols, short, strict=True)])
    panels[-1].set_xlim(-0.6, len(stages) - 0.4)
    handles = [
        Patch(color=FORWARD, label="E(+): from supply to joint"),
        Patch(color=REVERSE, label="E(\N{MINUS SIGN}): from joint to supply"),
        *(Patch(alpha=0.0, label=text) for text in long),
    ]
    figure.legend(handles=handles, loc="outside lower center")
    return figure


def energy_limits(
    every: Iterable[Sequence[StageEnergy]], joints: Iterable[str]
) -> tuple[float, float]:
    """Largest E(+) and largest E(-) of several alternatives at the joints shown [J]."""
    pairs = [_energies(stages, list(joints)) for stages in every]
    forward = max((float(f.max()) for f, _ in pairs), default=0.0)
    return max(forward, 1e-9), max((float(r.max()) for _, r in pairs), default=0.0)


def _energies(stages: Sequence[StageEnergy], joints: Iterable[str]) -> tuple[Array, Array]:
    """E(+) and E(-), each of shape (stages, joints) [J]."""
    shown = list(joints)
    own = [(s, [s.joints.index(joint) for joint in shown]) for s in stages]
    return np.array([s.forward[c] for s, c in own]), np.array([s.reverse[c] for s, c in own])
