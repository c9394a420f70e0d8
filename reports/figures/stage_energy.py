"""Energy per cycle at every stage of an actuator."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.arrays import Array
from reports.figures.style import (
    FORWARD,
    INK,
    REVERSE,
    horizontal_grid,
    house_style,
    new_figure,
    note,
    on_white,
    zero_line,
)
from reports.typeset import number

if TYPE_CHECKING:
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
    symbols = [stage_symbol(s.stage) for s in stages]
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


def stage_symbol(stage: str, letter: str = "E") -> str:
    """A stage's energy as a formula; what TeX would read otherwise stands for itself."""
    plain = re.sub(r"([_#%&${}])", r"\\\1", stage)
    return rf"${letter}_{{\mathrm{{{plain}}}}}$"
