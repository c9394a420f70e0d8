"""Horizontal bars: what a whole is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from textwrap import shorten
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.arrays import Array
from reports.figures.style import (
    BLUE,
    CYCLE,
    GREEN,
    INK,
    ORANGE,
    QUIET,
    house_style,
    new_figure,
    note,
    on_white,
)
from reports.typeset import TIMES, number, unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
