"""The robot as a picture: from ahead, from the right, from above, and obliquely."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from actuators.arrays import Array
from reports.figures.robot.dimensions import (
    flat_links,
    front_dimensions,
    link_dimensions,
    side_dimensions,
    top_dimensions,
)
from reports.figures.robot.projection import FRONT, OBLIQUE, SIDE, TOP, View, draw_scene, extent
from reports.figures.robot.solids import Leg, Solid, reach
from reports.figures.style import BLUE, GREEN, INK, QUIET, VERMILION, house_style, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@house_style()
def robot_figure(
    scene: Sequence[Solid],
    legs: Sequence[Leg],
    *,
    title: str,
    subtitle: str = "",
    mass_centre: Array | None = None,
) -> Figure:
    """Four views of the robot with the dimensions measured in the picture itself.

    Args:
        scene: Everything visible in the world, z up.
        legs: For labels and dimensions; the feet that stand are the lowest.
        mass_centre: Centre of mass in the world, shape (3,) [m].
    """
    unit = reach(scene)
    figure = new_figure(8.4, title, subtitle)
    ((oblique, above), (ahead, beside)) = figure.subplots(
        2, 2, height_ratios=[1.25, 1.0], width_ratios=[1.0, 1.15]
    )
    ground = min(float(leg.foot[2]) for leg in legs)
    for axes, view in ((oblique, OBLIQUE), (above, TOP), (ahead, FRONT), (beside, SIDE)):
        draw_scene(axes, view, scene)
        axes.set_axis_off()
        axes.set_title(view.name, color=QUIET)
        axes.set_anchor("N")
        frame_arrows(axes, view)
        low, high = extent(view, scene)
        left, bottom, right, top = (unit * room for room in _ROOM[view.name])
        axes.set_xlim(low[0] - left, high[0] + right)
        axes.set_ylim(low[1] - bottom, high[1] + top)
    for axes, view in ((ahead, FRONT), (beside, SIDE)):
        low, high = extent(view, scene)
        ends = [low[0] - 0.08 * unit, high[0] + 0.08 * unit]
        axes.plot(ends, [ground, ground], color=QUIET, linewidth=1.0)
    _name_legs(oblique, above, scene, legs, unit)
    both = ((ahead, FRONT), (beside, SIDE))
    shown = [max(len(flat_links(leg, view)) for leg in legs) for _, view in both]
    link_dimensions(*both[int(np.argmax(shown))], legs, unit)
    front_dimensions(ahead, legs, ground, unit)
    side_dimensions(beside, scene, legs, unit)
    top_dimensions(above, scene, legs, unit)
    if mass_centre is not None:
        for axes, view in ((above, TOP), (ahead, FRONT), (beside, SIDE)):
            _mass_centre(axes, view.project(mass_centre))
    return figure


#: Room around the robot for annotation: left, below, right, above, in sizes of the robot.
_ROOM = {
    OBLIQUE.name: (0.08, 0.12, 0.08, 0.10),
    TOP.name: (0.23, 0.10, 0.28, 0.10),
    FRONT.name: (0.27, 0.17, 0.27, 0.20),
    SIDE.name: (0.20, 0.10, 0.15, 0.30),
}


def _name_legs(
    oblique: Axes, above: Axes, scene: Sequence[Solid], legs: Sequence[Leg], unit: float
) -> None:
    """Names at the feet; of far legs above all that may hide them."""
    outlines = OBLIQUE.project(np.concatenate([solid.corners for solid in scene]))[:, :2]
    for leg in legs:
        at = OBLIQUE.project(leg.foot)[:2] - [0, 0.06 * unit]
        if leg.foot[1] > 0:  # the trunk may hide a far foot, but not what lies above it
            x = float(OBLIQUE.project(leg.joints[-1].position)[0])
            column = outlines[np.abs(outlines[:, 0] - x) < 0.08 * unit, 1]
            at = np.array([x, float(column.max(initial=at[1])) + 0.05 * unit])
        _write(oblique, leg.name.upper(), at)
        widest = max(abs(float(leg.foot[1])), abs(float(leg.joints[-1].position[1])))
        x, y = float(leg.foot[0]), (widest + 0.07 * unit) * (np.sign(leg.foot[1]) or 1.0)
        _write(above, leg.name.upper(), np.array([x, y]))


def _write(axes: Axes, text: str, at: Array) -> None:
    box = {"boxstyle": "round,pad=0.1", "facecolor": (1, 1, 1, 0.7), "edgecolor": "none"}
    axes.text(at[0], at[1], text, ha="center", va="center", fontweight="bold", zorder=8, bbox=box)


def _mass_centre(axes: Axes, seen: Array) -> None:
    axes.plot(seen[0], seen[1], marker="o", markersize=8, color="white", mec=INK, zorder=8)
    axes.plot(seen[0], seen[1], marker="+", markersize=8, color=INK, mew=1.2, zorder=9)


def frame_arrows(axes: Axes, view: View) -> None:
    """World directions as small arrows in the panel's corner."""
    corner, length = (0.03, 0.06), 24.0
    for direction, name, color in (
        ((1, 0, 0), "x", VERMILION),
        ((0, 1, 0), "y", GREEN),
        ((0, 0, 1), "z", BLUE),
    ):
        seen = view.project(np.array(direction, float))[:2]
        if np.hypot(*seen) < 0.1:
            continue
        axes.annotate(
            name,
            corner,
            xycoords="axes fraction",
            xytext=tuple(length * seen),
            textcoords="offset points",
            ha="center",
            va="center",
            color=color,
            fontsize=8.5,
            fontweight="bold",
            arrowprops={"arrowstyle": "<-", "color": color, "linewidth": 1.1, "shrinkB": 0},
        )
