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
    NARROW,
    ORANGE,
    QUIET,
    WIDTH,
    house_style,
    new_figure,
    on_white,
)
from reports.typeset import TIMES, number, unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pipeline.identification.supply.account import Share

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
    width: float = WIDTH,
) -> Figure:
    """Electrical energy of all alternatives, one stacked bar each, split by joint.

    Args:
        joints: Labels of the parts, J of them.
        alternatives: Name to energy per joint, shape (J,) [J].
        reference: The alternative to which the ratio at the end of a bar is; None for no ratio.
        width: [in]; names stand above their bars where it is less than usual.
    """
    totals = {name: float(a.sum()) for name, a in alternatives.items()}
    base = totals[reference] if reference is not None else 0.0
    widest = max(*totals.values(), 1e-9)
    narrow = width < WIDTH
    row_height, rest = (0.5, 1.35) if narrow else (0.62, 1.55)  # [in]
    figure = new_figure(row_height * len(alternatives) + rest, title, subtitle, width=width)
    axes = figure.subplots()
    thick, names = 0.45 if narrow else 0.62, []
    for row, (name, parts) in enumerate(alternatives.items()):
        left = 0.0
        for j, value in enumerate(parts):
            color = CYCLE[j % len(CYCLE)]
            axes.barh(row, value, left=left, height=thick, color=color, edgecolor="white")
            if value > (0.1 if narrow else 0.05) * widest:
                middle = left + value / 2
                axes.text(middle, row, number(value), ha="center", va="center", color="white")
            left += value
        total = f"{number(left)} J"
        if name != reference and base > 0:
            total += f"{', ' if narrow else '   '}{number(totals[name] / base)} {TIMES}"
        names.append(f"{shorten(name, 44)}: {total}" if narrow else name)
        if not narrow:
            axes.text(left + 0.008 * widest, row, total, va="center")
    _name_joints(axes, joints, 0.18 if narrow else 0.12)
    _name_rows(axes, names, thick, above=narrow)
    axes.set_ylim(len(alternatives) - 0.5, -0.95)
    axes.set_xlim(0, (1.02 if narrow else 1.25) * widest)
    label, apart = "electrical energy per cycle [J]", "\n" if narrow else "; "
    if reference is not None and len(alternatives) > 1:
        label += f"{apart}1 {TIMES} is that of {shorten(reference, 44)}"
    axes.set_xlabel(label)
    return figure


def _name_joints(axes: Axes, joints: Sequence[str], apart: float) -> None:
    """Joint names in their colours above the first bar, spaced like the words they are."""
    for j, joint in enumerate(joints):
        x, color = 0.005 + min(apart, 0.98 / len(joints)) * j, CYCLE[j % len(CYCLE)]
        at = axes.transAxes
        axes.text(x, 1.0, joint, transform=at, color=color, fontweight="bold", va="top")
    axes.axvline(0, color=QUIET, linewidth=0.8)


def _name_rows(axes: Axes, names: Sequence[str], thick: float, *, above: bool) -> None:
    """Names of bars from the top down, beside them or, in a narrow figure, above them."""
    axes.set_yticks(range(len(names)), [] if above else names)
    for row, name in enumerate(names if above else ()):
        clear = on_white(1.0)  # of what lies behind
        axes.text(0, row - thick / 2 - 0.04, shorten(name, 62), va="bottom", bbox=clear)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)


def _rows(count: int, title: str, subtitle: str, width: float) -> tuple[Figure, Axes, bool, float]:
    """A figure with room for rows and a line above them, its axes, if narrow, a bar's thickness."""
    narrow = width < WIDTH
    figure = new_figure((0.54 if narrow else 0.42) * count + 1.5, title, subtitle, width=width)
    return figure, figure.subplots(), narrow, 0.42 if narrow else 0.62


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
    """How the gap shrinks effect by effect from top to bottom, down to the noise floor.

    Args:
        before: Gap of the model as it was.
        steps: Effects in the order of acceptance, each with the gap after it.
        noise_floor: What no model can explain.
        width: [in]; labels stand above their bars where it is less than usual.
    """
    labels = ["model as it was", *(label for label, _ in steps), "what is left"]
    figure, axes, narrow, thick = _rows(len(labels), title, subtitle, width)
    gaps, unit = [before, *(gap for _, gap in steps)], unit_text(unit)
    last = len(gaps)
    _falls(axes, gaps, thick)
    beside = max(gaps[-1], noise_floor if gaps[-1] > 0.5 * noise_floor else 0.0)
    axes.text(beside, last, f" {number(gaps[-1])}", va="center", fontsize=8.5)
    axes.axvline(noise_floor, color=INK, linewidth=1.0, linestyle=(0, (4, 2)))
    floor = f" noise floor {number(noise_floor)} {unit}"
    axes.text(noise_floor, -0.62, floor, va="bottom", fontsize=8, color=QUIET)
    _name_rows(axes, labels, thick, above=narrow)
    axes.set_xlim(0, (1.2 if narrow else 1.14) * max([*gaps, noise_floor]))
    axes.set_ylim(last + 0.55, -1.05)
    axes.set_xlabel(f"gap on held-out data, root mean square [{unit}]")
    return figure


def _falls(axes: Axes, gaps: Sequence[float], thick: float) -> None:
    """The gap before, each fall or rise, and what is left."""
    axes.barh(0, gaps[0], color=ORANGE, height=thick)
    axes.text(gaps[0], 0, f" {number(gaps[0])}", va="center", fontsize=8.5)
    for k, (old, new) in enumerate(pairwise(gaps), start=1):
        axes.barh(k, old - new, left=new, color=GREEN if new < old else ORANGE, height=thick)
        axes.plot([old, old], [k - 1 + thick / 2, k - thick / 2], color=QUIET, linewidth=0.8)
        sign = "\N{MINUS SIGN}" if new <= old else "+"
        change = f"{sign}{number(abs(old - new), 2)}"
        if abs(new - old) < _NOTHING * gaps[0]:
            change = "0"
        axes.text(max(old, new), k, f" {change}", va="center", fontsize=8.5)
    last = len(gaps)
    axes.barh(last, gaps[-1], color=BLUE, height=thick)
    if last > 1:
        ends = [last - 1 + thick / 2, last - thick / 2]
        axes.plot([gaps[-1]] * 2, ends, color=QUIET, linewidth=0.8)


@house_style()
def power_shares_figure(shares: Sequence[Share], *, title: str, width: float = WIDTH) -> Figure:
    """Draw terms from the top, each where those above it end, and what was measured as a line.

    Args:
        shares: Terms in order with their 95 % intervals, what was measured among them.
        width: [in]; labels stand above their bars where it is less than usual.
    """
    # Here, and not above: it brings the statistics with which terms are chosen.
    from pipeline.identification.supply.account import BASIS_FOUND, MEASURED

    bars = [s for s in shares if s.term != MEASURED]
    measured = next(s.watts for s in shares if s.term == MEASURED)
    subtitle = "blue: by log and model; green: found; orange: unexplained"
    figure, axes, narrow, thick = _rows(len(bars), title, subtitle, width)
    colors = {BASIS_FOUND: GREEN, "": ORANGE}
    at = 0.0
    for row, bar in enumerate(bars):
        mean, low, high = bar.watts, bar.watts_low, bar.watts_high
        axes.barh(row, mean, left=at, color=colors.get(bar.basis, BLUE), height=thick)
        if high > low:
            axes.plot([at + low, at + high], [row, row], color=INK, linewidth=1.2)
        # On white, so that the line of what was measured does not run through the number.
        look: dict[str, Any] = {"va": "center", "fontsize": 8.5, "bbox": on_white(0), "zorder": 4}
        axes.text(max(at, at + mean, at + high), row, f" {number(mean)} W", **look)
        at += mean
    axes.axvline(measured, color=QUIET, linewidth=1.0, linestyle=(0, (4, 2)), zorder=1)
    words = f"measured {number(measured)} W "
    axes.text(measured, -0.62, words, ha="right", va="bottom", fontsize=8, color=QUIET)
    _name_rows(axes, [bar.term.replace("_", " ") for bar in bars], thick, above=narrow)
    axes.set_xlim(min(0.0, at), 1.16 * max(measured, at))
    axes.set_ylim(len(bars) - 0.45, -1.05)
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
    figure = new_figure(1.7 + 0.5 * len(modes), title, width=NARROW)
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
