"""Energy and power as bars: parts of a whole, stages of a drivetrain."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from textwrap import shorten
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.arrays import Array
from reports.figures.style import (
    BLUE,
    CYCLE,
    ORANGE,
    QUIET,
    house_style,
    new_figure,
    note,
    zero_line,
)
from reports.typeset import MINUS, TIMES, number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from actuators.energy.energy import StageEnergy

#: Of a bar; names stand between them.
_THICK = 0.45


def _rows(names: Sequence[str], title: str, subtitle: str) -> tuple[Figure, Axes]:
    """A figure with a row for each bar from the top down, its name above it."""
    figure = new_figure(0.5 * len(names) + 1.4, title, subtitle)
    axes = figure.subplots()
    axes.grid(False)
    axes.set_yticks(range(len(names)), [])
    for row, name in enumerate(names):
        note(axes, shorten(name, 62), (0, row - _THICK / 2), (0, 2), ha="left", fontsize=9)
    axes.axvline(0, color=QUIET, linewidth=0.8)
    axes.set_ylim(len(names) - 0.6, -0.75)
    return figure, axes


def _stacked(rows: Mapping[str, Array], parts: Sequence[str], title: str, subtitle: str) -> Figure:
    """A bar for each row, stacked of its parts, shape (len(parts),); the parts in a key."""
    figure, axes = _rows([*rows], title, subtitle)
    widest = max(*(float(own.sum()) for own in rows.values()), 1e-9)
    values = np.array([*rows.values()])
    left = np.zeros(len(rows))
    for j, part in enumerate(parts):
        look: dict[str, Any] = {
            "height": _THICK,
            "color": CYCLE[j % len(CYCLE)],
            "edgecolor": "white",
        }
        axes.barh(range(len(rows)), values[:, j], left=left, label=part, **look)
        for row in np.flatnonzero(values[:, j] > 0.1 * widest).tolist():
            middle = float(left[row] + values[row, j] / 2)
            look = {"ha": "center", "va": "center", "color": "white"}
            axes.text(middle, row, number(values[row, j]), **look)
        left += values[:, j]
    axes.set_xlim(0, 1.02 * widest)
    columns = min(4, len(parts), 60 // (6 + max(map(len, parts))))
    figure.legend(loc="outside lower center", ncols=max(1, columns))
    return figure


@house_style()
def electrical_energy_figure(
    joints: Sequence[str],
    alternatives: Mapping[str, Array],
    *,
    reference: str | None,
    title: str,
    subtitle: str = "",
) -> Figure:
    """Electrical energy of every drivetrain option, a bar each, split by joint.

    Args:
        joints: Labels of the parts, J of them.
        alternatives: Name to energy per joint, shape (J,) [J].
        reference: The option to which the ratio in a bar's name is; None for no ratio.
    """
    base = float(alternatives[reference].sum()) if reference is not None else 0.0
    rows = {}
    for name, energy in alternatives.items():
        total = float(energy.sum())
        ratio = f", {number(total / base)} {TIMES}" if name != reference and base > 0 else ""
        rows[f"{shorten(name, 48)}: {number(total)} J{ratio}"] = energy
    figure = _stacked(rows, joints, title, subtitle)
    label = "electrical energy per cycle [J]"
    if base > 0 and len(rows) > 1:
        label += f"\n1 {TIMES} is that of {shorten(str(reference), 44)}"
    figure.axes[0].set_xlabel(label)
    return figure


@house_style()
def day_figure(modes: Sequence[str], losses: Mapping[str, Array], hours: Sequence[float]) -> Figure:
    """Where the energy of a day goes, a bar for each mode.

    Args:
        modes: Names, from the top down.
        losses: What takes it: energy of every mode [Wh], shape (M,).
        hours: Of each mode in a day.
    """
    values = np.array([*losses.values()]).T
    rows = {
        f"{mode}, {number(h)} h: {number(float(own.sum()))} Wh": own
        for mode, h, own in zip(modes, hours, values, strict=True)
    }
    figure = _stacked(rows, [*losses], "Where the energy of a day goes", "")
    figure.axes[0].set_xlabel("energy in a day [Wh]")
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
    forward, reverse = _energies(stages, joints)
    top, bottom = limits or energy_limits([stages], joints)
    # A stage's energy as a formula; what TeX would read otherwise stands for itself.
    plain = [re.sub(r"([_#%&${}])", r"\\\1", s.stage) for s in stages]
    symbols = [rf"$E_{{\mathrm{{{stage}}}}}$" for stage in plain]
    words = [places[s.stage].replace("$", r"\$") for s in stages]
    # Words too long for a bar stand once, in the key.
    long = [f"{s}  {w}" for s, w in zip(symbols, words, strict=True) if " " in w]
    figure = new_figure(1.4 + 1.75 * len(joints) + 0.2 * len(long), title, subtitle)
    panels = figure.subplots(len(joints), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    room = 0.11 * (top + bottom)  # for the values at the ends of the bars
    panels[0].set_ylim(-bottom - room, top + room)
    panels[0].yaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
    for j, (axes, joint) in enumerate(zip(panels, joints.values(), strict=True)):
        ways = (
            (forward[:, j], 1, BLUE, "E(+): from supply to joint"),
            (reverse[:, j], -1, ORANGE, f"E({MINUS}): from joint to supply"),
        )
        for values, sign, color, label in ways:
            axes.bar(range(len(stages)), sign * values, width=0.72, color=color, label=label)
            for k, value in enumerate(values):
                text = "0" if value < 5e-4 else number(value, 3 if value >= 1 else 2)
                side = "bottom" if sign > 0 else "top"
                note(axes, text, (k, sign * float(value)), (0, 2 * sign), va=side)
        zero_line(axes)
        axes.tick_params(axis="x", length=0)
        axes.spines["bottom"].set_visible(False)
        axes.set_title(joint, fontweight="bold")
        axes.set_ylabel("energy [J]")
    short = ["" if " " in w else w for w in words]
    ticks = [f"{s}\n{w}" for s, w in zip(symbols, short, strict=True)]
    panels[-1].set_xticks(range(len(stages)), ticks)
    keys, labels = panels[0].get_legend_handles_labels()
    keys += [panels[0].plot([], [], " ")[0] for _ in long]
    figure.legend(keys, labels + long, loc="outside lower center")
    return figure


def energy_limits(
    every: Iterable[Sequence[StageEnergy]], joints: Iterable[str]
) -> tuple[float, float]:
    """Largest E(+) and largest E(-) of several options at the joints shown [J]."""
    pairs = [_energies(stages, list(joints)) for stages in every]
    forward = max((float(f.max()) for f, _ in pairs), default=0.0)
    return max(forward, 1e-9), max((float(r.max()) for _, r in pairs), default=0.0)


def _energies(stages: Sequence[StageEnergy], joints: Iterable[str]) -> tuple[Array, Array]:
    """E(+) and E(-), each of shape (stages, joints) [J]."""
    shown = list(joints)
    own = [(s, [s.joints.index(joint) for joint in shown]) for s in stages]
    return np.array([s.forward[c] for s, c in own]), np.array([s.reverse[c] for s, c in own])
