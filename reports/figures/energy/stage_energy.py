"""Energy per cycle at every stage of an actuator: Fig. 14, 16, 18 and 20 of the paper."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from reports.errors import FigureError
from reports.figures.style import (
    FORWARD,
    INK,
    QUIET,
    REVERSE,
    headline,
    horizontal_grid,
    new_figure,
    number,
    styled,
    zero_line,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from actuators.energy.energy import StageEnergy

Array = NDArray[np.float64]
#: Where the stages of the paper's alternatives lie, in a word that fits under a bar.
STAGE_PLACES = {
    "out": "joint",
    "2": "hypoid",
    "ph": "pinion",
    "mp": "planetary",
    "wg": "wave generator",
    "mt": "rotor",
    "m": "motor",
    "el": "supply",
}


@styled
def stage_energy_figure(
    stages: Sequence[StageEnergy],
    joints: Mapping[str, str],
    *,
    title: str,
    subtitle: str = "",
    limits: tuple[float, float] | None = None,
    places: Mapping[str, str] = STAGE_PLACES,
) -> Figure:
    """One panel per joint, one pair of bars per stage: E(+) upwards, E(-) downwards.

    Args:
        stages: From the joint to the supply, energy in one cycle.
        joints: Those to draw, name to label of the panel.
        title: Names the alternative.
        subtitle: Second line.
        limits: Largest E(+) and E(-) to scale for [J], to give several figures the same scale.
        places: Stage to a word that says where it is, for the second line under a bar.

    Raises:
        FigureError: Nothing to draw, or a joint that is not among the stages' joints.
    """
    if not stages or not joints:
        raise FigureError(f"'{title}': no stage or no joint to draw")
    forward, reverse = _energies(stages, joints)
    top, bottom = limits or energy_limits([stages], joints)
    figure = new_figure(4.5)
    headline(figure, title, subtitle)
    panels = figure.subplots(1, len(joints), sharey=True, squeeze=False)[0]
    for j, (axes, joint) in enumerate(zip(panels, joints.values(), strict=True)):
        _bars(axes, forward[:, j], reverse[:, j])
        axes.set_title(joint, loc="center", fontweight="bold")
        symbols = [rf"$E_{{\mathrm{{{s.stage}}}}}$" for s in stages]
        axes.set_xticks(np.arange(len(stages)), symbols)
        for x, stage in enumerate(stages):
            axes.annotate(
                "\n".join(places.get(stage.stage, "").split()),
                (x, 0),
                xycoords=axes.get_xaxis_transform(),
                xytext=(0, -18),
                textcoords="offset points",
                ha="center",
                va="top",
                color=QUIET,
                fontsize=7.5,
            )
    room = 0.075 * (top + bottom)  # for the values at the ends of the bars
    panels[0].set_ylim(-bottom - room, top + room)
    panels[0].set_ylabel("energy per cycle [J]")
    panels[0].yaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
    _key(figure)
    return figure


def energy_limits(
    every: Iterable[Sequence[StageEnergy]], joints: Iterable[str]
) -> tuple[float, float]:
    """Largest E(+) and largest E(-) of several alternatives at the joints shown [J].

    Raises:
        FigureError: A joint that is not among the stages' joints.
    """
    pairs = [_energies(stages, list(joints)) for stages in every]
    forward = max((float(f.max()) for f, _ in pairs), default=0.0)
    return max(forward, 1e-9), max((float(r.max()) for _, r in pairs), default=0.0)


def _energies(stages: Sequence[StageEnergy], joints: Iterable[str]) -> tuple[Array, Array]:
    """E(+) and E(-), each of shape (stages, joints) [J]."""
    shown = list(joints)
    for stage in stages:
        for joint in shown:
            if joint not in stage.joints:
                raise FigureError(f"stage '{stage.stage}' has no joint '{joint}'")
    columns = [[s.joints.index(joint) for joint in shown] for s in stages]
    return (
        np.array([s.forward[c] for s, c in zip(stages, columns, strict=True)]),
        np.array([s.reverse[c] for s, c in zip(stages, columns, strict=True)]),
    )


def _bars(axes: Axes, forward: Array, reverse: Array) -> None:
    x = np.arange(forward.size)
    axes.bar(x, forward, width=0.72, color=FORWARD)
    axes.bar(x, -reverse, width=0.72, color=REVERSE)
    for i in range(forward.size):
        for value, sign in ((forward[i], 1), (reverse[i], -1)):
            axes.annotate(
                _joules(value),
                (x[i], sign * value),
                xytext=(0, 2 * sign),
                textcoords="offset points",
                ha="center",
                va="bottom" if sign > 0 else "top",
                fontsize=7.5,
                color=INK,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.4},  # over the grid
            )
    zero_line(axes)
    horizontal_grid(axes)
    axes.tick_params(axis="x", length=0)
    axes.spines["bottom"].set_visible(False)
    axes.set_xlim(-0.6, forward.size - 0.4)


def _joules(value: float) -> str:
    return "0" if value < 5e-4 else number(value, 3 if value >= 1 else 2)


def _key(figure: Figure) -> None:
    """What the two colours mean, below the panels, where no line crosses it."""
    from matplotlib.patches import Patch

    handles = [
        Patch(color=FORWARD, label="E(+): from supply to joint"),
        Patch(color=REVERSE, label="E(\N{MINUS SIGN}): from joint to supply"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
