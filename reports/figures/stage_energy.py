"""Energy per cycle at every stage of an actuator: Fig. 14, 16, 18 and 20 of the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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

    from actuators.energy import StageEnergy

Array = NDArray[np.float64]
#: Where the stages of the paper's alternatives lie, in a word that fits under a bar.
STAGE_PLACES = {
    "out": "joint",
    "2": "hypoid",
    "ph": "pinion",
    "mp": "planet.",
    "wg": "wave g.",
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
    upper: float | None = None,
    places: Mapping[str, str] = STAGE_PLACES,
) -> Figure:
    """One panel per joint, one pair of bars per stage: E(+) upwards, E(-) downwards.

    Args:
        stages: From the joint to the supply, energy in one cycle.
        joints: Those to draw, name to label of the panel.
        title: Names the alternative.
        subtitle: Second line.
        upper: Largest E(+) to scale for [J], to give several figures the same scale.
        places: Stage to a word that says where it is, for the second line under a bar.

    Raises:
        FigureError: Nothing to draw, or a joint that is not among the stages' joints.
    """
    if not stages or not joints:
        raise FigureError(f"'{title}': no stage or no joint to draw")
    for stage in stages:
        for joint in joints:
            if joint not in stage.joints:
                raise FigureError(f"'{title}': stage '{stage.stage}' has no joint '{joint}'")
    columns = [[s.joints.index(joint) for joint in joints] for s in stages]
    forward = np.array([s.forward[c] for s, c in zip(stages, columns, strict=True)])  # (S, J)
    reverse = np.array([s.reverse[c] for s, c in zip(stages, columns, strict=True)])
    top = max(float(forward.max()) if upper is None else upper, 1e-9)
    bottom = float(reverse.max())
    figure = new_figure(9.0, 4.3)
    headline(figure, title, subtitle)
    panels = figure.subplots(1, len(joints), sharey=True, squeeze=False)[0]
    for j, (axes, joint) in enumerate(zip(panels, joints.values(), strict=True)):
        _bars(axes, forward[:, j], reverse[:, j])
        axes.set_title(joint, loc="center", fontweight="bold")
        symbols = [rf"$E_{{\mathrm{{{s.stage}}}}}$" for s in stages]
        axes.set_xticks(np.arange(len(stages)), symbols)
        for x, stage in enumerate(stages):
            axes.annotate(
                places.get(stage.stage, ""),
                (x, 0),
                xycoords=axes.get_xaxis_transform(),
                xytext=(0, -25),
                textcoords="offset points",
                ha="center",
                color=QUIET,
                fontsize=7.5,
            )
    room = 0.075 * (top + bottom)  # for the values at the ends of the bars
    panels[0].set_ylim(-bottom - room, top + room)
    panels[0].set_ylabel("energy per cycle [J]")
    panels[0].yaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
    _key(panels[-1])
    return figure


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
            )
    zero_line(axes)
    horizontal_grid(axes)
    axes.tick_params(axis="x", length=0)
    axes.spines["bottom"].set_visible(False)
    axes.set_xlim(-0.6, forward.size - 0.4)


def _joules(value: float) -> str:
    return "0" if value < 5e-4 else number(value, 3 if value >= 1 else 2)


def _key(axes: Axes) -> None:
    """What the two colours mean, in words of their own colour."""
    for y, color, text in (
        (0.98, FORWARD, "E(+)  from supply to joint"),
        (0.92, REVERSE, "E(\N{MINUS SIGN})  from joint to supply"),
    ):
        axes.text(
            0.99,
            y,
            text,
            transform=axes.transAxes,
            ha="right",
            va="top",
            color=color,
            fontsize=8.5,
            fontweight="bold",
        )
