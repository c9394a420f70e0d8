"""Joint names, axes and positive directions, drawn on the robot in its zero pose."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from reports.errors import FigureError
from reports.figures.marks import axis_line, rotation_arrow
from reports.figures.robot.projection import FRONT, OBLIQUE, SIDE, TOP, View, draw_scene, extent
from reports.figures.robot.robot_view import Leg, frame_arrows
from reports.figures.robot.solids import Solid
from reports.figures.robot.sticks import with_sticks
from reports.figures.style import BLUE, GREEN, QUIET, VERMILION, headline, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

JOINT_COLORS = (GREEN, BLUE, VERMILION)


@styled
def joint_directions_figure(
    scene: Sequence[Solid],
    legs: Sequence[Leg],
    shown: str,
    *,
    title: str,
    zero_pose: str = "",
) -> Figure:
    """Circular arrows show how each joint turns when its coordinate grows.

    Args:
        scene: Everything visible in the zero pose.
        legs: All legs in the zero pose.
        shown: Name of the leg that is shown obliquely, with its joints' names.
        title: First line.
        zero_pose: The robot file's words, written below the picture.

    Raises:
        FigureError: There is no such leg.
    """
    by_name = {leg.name: leg for leg in legs}
    if shown not in by_name:
        raise FigureError(f"leg '{shown}' is not among {', '.join(by_name)}")
    leg = by_name[shown]
    scene, _ = with_sticks(scene, legs)
    figure = new_figure(4.6)
    headline(figure, title, "circular arrows: positive rotation, right-handed about the drawn axis")
    oblique, ahead, above = figure.subplots(1, 3, width_ratios=[1.0, 1.25, 1.15])
    _panel(oblique, OBLIQUE, scene, f"oblique, leg {shown.upper()}")
    _panel(ahead, FRONT, scene, "from ahead")
    # The view that shows joint 1 as a full circle: from above where its axis stands upright.
    upright = abs(float(leg.joints[0].axis[2])) > 0.5
    view = TOP if upright else SIDE
    _panel(above, view, scene, view.name)
    _oblique_leg(oblique, leg)
    _flat_arrows(ahead, FRONT, _nearest_to_frontal(legs, leg))
    near = [one for one in legs if upright or one.joints[0].position[1] < 0]
    _flat_arrows(above, view, near, only_first=not upright)
    if zero_pose:
        figure.supxlabel(
            textwrap.fill(f"Zero pose: {zero_pose}", 140), x=0.012, ha="left", fontsize=8.5
        )
    return figure


def _panel(axes: Axes, view: View, scene: Sequence[Solid], title: str) -> None:
    close_up = view is OBLIQUE
    draw_scene(axes, view, scene, fade=0.45, pixels=700 if close_up else 450)
    axes.set_axis_off()
    axes.set_anchor("N")
    axes.set_title(title, color=QUIET)
    low, high = extent(view, scene)
    axes.set_xlim(low[0] - 0.08, high[0] + 0.08)
    axes.set_ylim(low[1] - 0.10, high[1] + 0.08)
    frame_arrows(axes, view)


def _oblique_leg(axes: Axes, leg: Leg) -> None:
    """All joints of one leg, close up, with axes and names."""
    points = OBLIQUE.project(np.array([*(joint.position for joint in leg.joints), leg.foot]))
    for number, joint in enumerate(leg.joints):
        color = JOINT_COLORS[number % len(JOINT_COLORS)]
        axis_line(axes, OBLIQUE, joint, color)
        rotation_arrow(axes, OBLIQUE, joint, color)
        x, y = points[number, :2]
        axes.annotate(
            joint.name,
            (x, y),
            xytext=((44, 22), (-14, 62), (-30, 44))[number % 3],
            textcoords="offset points",
            ha="center",
            color=color,
            fontweight="bold",
            fontsize=8.5,
            zorder=9,
            arrowprops={"arrowstyle": "-", "color": color, "linewidth": 0.6},
        )
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    axes.set_xlim(low[0] - 0.14, high[0] + 0.17)
    axes.set_ylim(low[1] - 0.08, high[1] + 0.20)


def _nearest_to_frontal(legs: Sequence[Leg], leg: Leg) -> list[Leg]:
    """The shown leg and its mirror image across the mid-plane, where there is one."""
    mirror = leg.joints[0].position * np.array([1.0, -1.0, 1.0])
    other = [one for one in legs if np.allclose(one.joints[0].position, mirror, atol=1e-6)]
    return [leg, *other]


def _flat_arrows(axes: Axes, view: View, legs: Sequence[Leg], only_first: bool = False) -> None:
    """Arrows of the joints whose axis points at the viewer or away; the others would be slits."""
    for leg in legs:
        for number, joint in enumerate(leg.joints[:1] if only_first else leg.joints):
            if abs(float(joint.axis @ view.axes[2])) < 0.5:
                continue
            color = JOINT_COLORS[number % len(JOINT_COLORS)]
            x, y = rotation_arrow(axes, view, joint, color)
            axes.annotate(
                f"{number + 1}",
                (x, y),
                xytext=(0, 5),
                textcoords="offset points",
                ha="center",
                color=color,
                fontweight="bold",
                zorder=9,
            )
