"""Energy per cycle at every stage of an actuator."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.arrays import Array
from reports.figures.style import (
    FORWARD,
    INK,
    QUIET,
    REVERSE,
    horizontal_grid,
    house_style,
    new_figure,
    note,
    on_white,
    rows_of_panels,
    zero_line,
)
from reports.typeset import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from actuators.energy.energy import StageEnergy


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
    names = {s.stage: (stage_symbol(s.stage), places[s.stage]) for s in stages}
    long = [f"{symbol}  {words}" for symbol, words in names.values() if " " in words]
    rows, across = rows_of_panels(len(joints))
    figure = new_figure(1.3 + 3.2 * rows + 0.2 * math.ceil(len(long) / 2), title, subtitle)
    grid = figure.subplots(rows, across, sharey=True, squeeze=False)
    panels = grid.ravel()[: len(joints)]
    for axes in grid.ravel()[len(joints) :]:
        axes.set_visible(False)
    for j, (axes, joint) in enumerate(zip(panels, joints.values(), strict=True)):
        _bars(axes, forward[:, j], reverse[:, j])
        axes.set_title(joint, loc="center", fontweight="bold")
        _name_stages(axes, list(names.values()))
    room = 0.075 * (top + bottom)  # for the values at the ends of the bars
    panels[0].set_ylim(-bottom - room, top + room)
    for axes in grid[:, 0]:
        axes.set_ylabel("energy per cycle [J]")
    panels[0].yaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
    words = [Patch(alpha=0.0, label=text) for text in long]
    handles = [  # by column, of which the first has the odd one
        Patch(color=FORWARD, label="E(+): from supply to joint"),
        *words[::2],
        Patch(color=REVERSE, label="E(\N{MINUS SIGN}): from joint to supply"),
        *words[1::2],
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def _name_stages(axes: Axes, names: Sequence[tuple[str, str]]) -> None:
    """Symbols below the bars, and below those the words that are short enough."""
    axes.set_xticks(np.arange(len(names)), [symbol for symbol, _ in names])
    for x, (_, words) in enumerate(names):
        said = "" if " " in words else words
        look: dict[str, Any] = {"ha": "center", "va": "top", "color": QUIET, "fontsize": 7.5}
        note(axes, said, (x, 0), (0, -18), xycoords=axes.get_xaxis_transform(), **look)


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


def _bars(axes: Axes, forward: Array, reverse: Array) -> None:
    x = np.arange(forward.size)
    axes.bar(x, forward, width=0.72, color=FORWARD)
    axes.bar(x, -reverse, width=0.72, color=REVERSE)
    for i in range(forward.size):
        for value, sign in ((forward[i], 1), (reverse[i], -1)):
            place = {"ha": "center", "va": "bottom" if sign > 0 else "top"}
            look: dict[str, Any] = {"fontsize": 7.5, "color": INK, "bbox": on_white(0.4)}
            note(axes, _joules(value), (x[i], sign * value), (0, 2 * sign), **place, **look)
    zero_line(axes)
    horizontal_grid(axes)
    axes.tick_params(axis="x", length=0)
    axes.spines["bottom"].set_visible(False)
    axes.set_xlim(-0.6, forward.size - 0.4)


def _joules(value: float) -> str:
    return "0" if value < 5e-4 else number(value, 3 if value >= 1 else 2)


def stage_symbol(stage: str, letter: str = "E") -> str:
    """A stage's energy as a formula; what TeX would read otherwise stands for itself."""
    plain = re.sub(r"([_#%&${}])", r"\\\1", stage)
    return rf"${letter}_{{\mathrm{{{plain}}}}}$"
