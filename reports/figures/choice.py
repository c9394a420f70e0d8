"""Pictures of a choice of actuators: front, day and break-even map."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from actuators.arrays import Array
from reports.figures.style import (
    BLUE,
    CYCLE,
    INK,
    NARROW,
    QUIET,
    SKY,
    VERMILION,
    horizontal_grid,
    house_style,
    new_figure,
    number,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@house_style()
def front_figure(mass: Array, power: Array, answer: tuple[float, float]) -> Figure:
    """Robots that none beats in mass and mean power, and the answer.

    Args:
        mass: Of all actuators [kg], shape (N,).
        power: Mean over the day [W], shape (N,).
        answer: Mass and power of what is recommended.
    """
    figure = new_figure(3.6, "Less mass costs energy", "robots that none beats", width=NARROW)
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
        axes.text(total, k, f" {number(float(total))} Wh", va="center", color=INK, fontsize=8)
    labels = [f"{mode}\n{number(h)} h" for mode, h in zip(modes, hours, strict=True)]
    axes.set_yticks(at, labels)
    axes.set_xlim(0, 1.25 * float(left.max()))
    axes.invert_yaxis()
    axes.set_xlabel("energy in a day [Wh]")
    axes.grid(axis="x", zorder=0)
    figure.legend(loc="outside lower center", ncols=3, fontsize=8)
    return figure


@house_style()
def break_even_figure(
    share: Array, speed: Array, less: Mapping[float, Array], first: str, second: str
) -> Figure:
    """Where which of two candidates takes less, a panel for each idle power.

    Args:
        share: Of standing, increasing, shape (S,).
        speed: Of walking [m/s], increasing, shape (V,).
        less: Idle power of a driver [W] to power of the second less the first [W], shape (V, S).
    """
    from matplotlib.patches import Patch

    title = "Which takes less"
    figure = new_figure(1.2 + 1.75 * len(less), title, width=NARROW)
    panels = figure.subplots(len(less), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (idle, difference) in zip(panels, less.items(), strict=True):
        axes.contourf(
            100 * share, speed, difference, levels=[-1e9, 0.0, 1e9], colors=[CYCLE[4], SKY]
        )
        if difference.min() < 0 < difference.max():
            axes.contour(100 * share, speed, difference, levels=[0.0], colors=[INK])
        axes.set_title(f"{number(idle)} W idle per driver", fontsize=9, color=QUIET)
        axes.set_ylabel("speed [m/s]")
    panels[-1].set_xlabel("share of the time standing [%]")
    keys = [
        Patch(color=SKY, label=f"{first} takes less"),
        Patch(color=CYCLE[4], label=f"{second} takes less"),
    ]
    figure.legend(handles=keys, loc="outside lower center", ncols=1)
    return figure
