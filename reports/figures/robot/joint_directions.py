"""Joint names, axes and positive directions, drawn on the robot in its zero pose."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from reports.errors import FigureError
from reports.figures.marks import axis_line, rotation_arrow, sliding_arrow
from reports.figures.robot.projection import (
    FRONT,
    OBLIQUE,
    OBLIQUE_LEFT,
    SIDE,
    TOP,
    View,
    draw_scene,
    extent,
)
from reports.figures.robot.robot_view import frame_arrows
from reports.figures.robot.solids import JointMark, Leg, Solid, reach
from reports.figures.robot.sticks import with_sticks
from reports.figures.style import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    QUIET,
    SKY,
    VERMILION,
    headline,
    new_figure,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: As many as a leg may have joints.
JOINT_COLORS = (GREEN, BLUE, VERMILION, PURPLE, ORANGE, SKY, INK)
_FLAT_VIEWS = (FRONT, TOP, SIDE)


@styled
def joint_directions_figure(
    scene: Sequence[Solid],
    legs: Sequence[Leg],
    shown: str,
    *,
    title: str,
    zero_pose: str = "",
) -> Figure:
    """Arrows show how each joint moves when its coordinate grows.

    Beside a close-up of one leg stand the two views that show most of its joints from the end of
    their axes.

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
    unit = reach(scene)
    figure = new_figure(4.6)
    slides = any(joint.slides for one in legs for joint in one.joints)
    straight = "; straight arrows: positive sliding" if slides else ""
    words = "circular arrows: positive rotation, right-handed about the drawn axis"
    headline(figure, title, f"{words}{straight}")
    close, *panels = figure.subplots(1, 3, width_ratios=[1.0, 1.25, 1.15])
    oblique = OBLIQUE if leg.foot[1] <= 0 else OBLIQUE_LEFT
    _panel(close, oblique, scene, f"oblique, leg {shown.upper()}", unit, pixels=700)
    _close_up(close, oblique, leg, unit)
    best = {view.name: _seen_from(leg, view) for view in _FLAT_VIEWS}
    most = sorted(_FLAT_VIEWS, key=lambda view: -len(best[view.name]))[:2]
    for axes, view in zip(panels, [v for v in _FLAT_VIEWS if v in most], strict=True):
        _panel(axes, view, scene, view.name, unit, pixels=450)
        _flat_arrows(axes, view, _facing(view, legs, leg), best[view.name], unit)
    if zero_pose:
        figure.supxlabel(
            textwrap.fill(f"Zero pose: {zero_pose}", 140), x=0.012, ha="left", fontsize=8.5
        )
    return figure


def _seen_from(leg: Leg, view: View) -> list[int]:
    """Joints of a leg, of all the flat views, best shown by this one."""
    seen = []
    for number, joint in enumerate(leg.joints):
        along = [_faces(joint, one) for one in _FLAT_VIEWS]
        if _FLAT_VIEWS[int(np.argmax(along))] is view:
            seen.append(number)
    return seen


def _faces(joint: JointMark, view: View) -> float:
    """How well a view shows a joint's arrow, from 0 to 1: axes end on, sliding sideways."""
    along = abs(float(joint.axis @ view.axes[2]))
    return 1 - along if joint.slides else along


def _facing(view: View, legs: Sequence[Leg], leg: Leg) -> list[Leg]:
    """The legs whose arrows a view shows: all from above, near ones from a side."""
    if view is TOP:
        return list(legs)
    if view is SIDE:
        near = [one for one in legs if one.joints[0].position[1] < 0]
        return near or list(legs)
    mirror = leg.joints[0].position * np.array([1.0, -1.0, 1.0])
    return [
        leg,
        *(
            one
            for one in legs
            if one is not leg and np.allclose(one.joints[0].position, mirror, atol=1e-3)
        ),
    ]


def _panel(
    axes: Axes, view: View, scene: Sequence[Solid], title: str, unit: float, pixels: int
) -> None:
    draw_scene(axes, view, scene, fade=0.45, pixels=pixels)
    axes.set_axis_off()
    axes.set_anchor("N")
    axes.set_title(title, color=QUIET)
    low, high = extent(view, scene)
    axes.set_xlim(low[0] - 0.13 * unit, high[0] + 0.13 * unit)
    axes.set_ylim(low[1] - 0.17 * unit, high[1] + 0.13 * unit)
    frame_arrows(axes, view)


def _close_up(axes: Axes, view: View, leg: Leg, unit: float) -> None:
    """All joints of one leg, with axes; their names in a column above, in order from the left."""
    points = view.project(np.array([*(joint.position for joint in leg.joints), leg.foot]))[:, :2]
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = (low + high) / 2, max(0.5 * float((high - low).max()), 0.2 * unit)
    left, right = middle[0] - half - 0.1 * unit, middle[0] + half + 0.1 * unit
    step = 0.075 * 2 * half
    top = high[1] + 0.14 * unit
    order = sorted(range(len(leg.joints)), key=lambda k: -points[k, 1])
    for number, joint in enumerate(leg.joints):
        color = JOINT_COLORS[number % len(JOINT_COLORS)]
        axis_line(axes, view, joint, color, 0.18 * unit)
        _arrow(axes, view, joint, color, unit)
        at = (left + 0.02 * unit, top + step * (len(order) - order.index(number)))
        side = 1.0 if points[number, 0] > middle[0] - 0.5 * half else 0.1
        axes.annotate(
            f"{number + 1} {joint.name}",
            points[number],
            xytext=at,
            ha="left",
            va="center",
            color=color,
            fontweight="bold",
            fontsize=8.5,
            zorder=9,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8},
            arrowprops={"arrowstyle": "-", "color": color, "linewidth": 0.6, "relpos": (side, 0.5)},
        )
    axes.set_xlim(left, right)
    axes.set_ylim(low[1] - 0.13 * unit, top + step * (len(order) + 0.7))


def _arrow(
    axes: Axes, view: View, joint: JointMark, color: str, unit: float
) -> tuple[float, float]:
    draw = sliding_arrow if joint.slides else rotation_arrow
    return draw(axes, view, joint, color, 0.083 * unit)


def _flat_arrows(
    axes: Axes, view: View, legs: Sequence[Leg], numbers: Sequence[int], unit: float
) -> None:
    """Arrows of the joints that this view shows best; from elsewhere they would be slits."""
    for leg in legs:
        for number in numbers:
            if number >= len(leg.joints) or _faces(leg.joints[number], view) < 0.5:
                continue
            color = JOINT_COLORS[number % len(JOINT_COLORS)]
            x, y = _arrow(axes, view, leg.joints[number], color, unit)
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
