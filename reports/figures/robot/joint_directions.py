"""Joint names, axes and positive directions, drawn on the robot in its zero pose."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.arrays import Array
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
from reports.figures.style import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    QUIET,
    SKY,
    VERMILION,
    arrow,
    house_style,
    new_figure,
    note,
    on_white,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: As many as a leg may have joints.
JOINT_COLORS = (GREEN, BLUE, VERMILION, PURPLE, ORANGE, SKY, INK)
_FLAT_VIEWS = (FRONT, TOP, SIDE)


@house_style()
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
        zero_pose: The robot file's words, written below the picture.
    """
    leg = next(leg for leg in legs if leg.name == shown)
    unit = reach(scene)
    slides = any(joint.slides for one in legs for joint in one.joints)
    straight = "; straight arrows: positive sliding" if slides else ""
    words = "circular arrows: positive rotation, right-handed about the drawn axis"
    figure = new_figure(4.6, title, f"{words}{straight}")
    close, *panels = figure.subplots(1, 3, width_ratios=[1.0, 1.25, 1.15])
    oblique = OBLIQUE if leg.foot[1] <= 0 else OBLIQUE_LEFT
    _panel(close, oblique, scene, f"oblique, leg {shown.upper()}", unit, pixels=700)
    _close_up(close, oblique, leg, unit)
    best = [int(np.argmax([_faces(joint, view) for view in _FLAT_VIEWS])) for joint in leg.joints]
    most = sorted(range(len(_FLAT_VIEWS)), key=lambda k: -best.count(k))[:2]
    for axes, k in zip(panels, sorted(most), strict=True):
        view = _FLAT_VIEWS[k]
        _panel(axes, view, scene, view.name, unit, pixels=450)
        numbers = [number for number, seen_best in enumerate(best) if seen_best == k]
        _flat_arrows(axes, view, _facing(view, legs, leg), numbers, unit)
    if zero_pose:
        figure.supxlabel(
            textwrap.fill(f"Zero pose: {zero_pose}", 140), x=0.012, ha="left", fontsize=8.5
        )
    return figure


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
    others = [one for one in legs if one is not leg]
    return [leg, *(o for o in others if np.allclose(o.joints[0].position, mirror, atol=1e-3))]


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
        tail, tip = _along(view, joint, -0.6 * 0.18 * unit, 0.18 * unit)
        if np.hypot(*(tip - tail)) >= 0.2 * 0.18 * unit:
            dashes = (0, (6, 2, 1, 2))
            look: dict[str, Any] = {"head": (0.15, 0.35), "width": 0.9, "linestyle": dashes}
            arrow(axes, tip, tail, color, zorder=6, **look)
        _joint_arrow(axes, view, joint, color, 0.083 * unit)
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
            bbox=on_white(0.8),
            arrowprops={"arrowstyle": "-", "color": color, "linewidth": 0.6, "relpos": (side, 0.5)},
        )
    axes.set_xlim(left, right)
    axes.set_ylim(low[1] - 0.13 * unit, top + step * (len(order) + 0.7))


def _along(view: View, joint: JointMark, start: float, end: float) -> Array:
    """Two points on a joint's axis, so far from the joint [m], in the image, shape (2, 2)."""
    return view.project(joint.position + np.array([[start], [end]]) * joint.axis)[:, :2]


def _joint_arrow(axes: Axes, view: View, joint: JointMark, color: str, size: float) -> None:
    """A circular arrow around a joint's axis in its positive sense; of a sliding one a straight."""
    if joint.slides:
        tail, tip = _along(view, joint, -size, size)
        arrow(axes, tip, tail, color, width=2.2)
        return
    # Start the arc where it is lowest in the image, so that all arcs of a view open alike.
    up = view.axes[1]
    first = up - (up @ joint.axis) * joint.axis
    if np.linalg.norm(first) < 1e-6:
        first = view.axes[0] - (view.axes[0] @ joint.axis) * joint.axis
    first /= np.linalg.norm(first)
    second = np.cross(joint.axis, first)
    angle = np.radians(np.linspace(-215, 55, 60))[:, None]
    circle = joint.position + size * (np.cos(angle) * first + np.sin(angle) * second)
    seen = view.project(circle)[:, :2]
    axes.plot(*seen[:-4].T, color=color, linewidth=1.5, zorder=7, solid_capstyle="butt")
    arrow(axes, seen[-1], seen[-6], color)
    centre = view.project(joint.position)[:2]
    axes.plot(*centre, marker="o", markersize=3.2, color=color, zorder=7)


def _flat_arrows(
    axes: Axes, view: View, legs: Sequence[Leg], numbers: Sequence[int], unit: float
) -> None:
    """Arrows of the joints that this view shows best; from elsewhere they would be slits."""
    for leg in legs:
        for number in numbers:
            if number >= len(leg.joints) or _faces(leg.joints[number], view) < 0.5:
                continue
            color = JOINT_COLORS[number % len(JOINT_COLORS)]
            _joint_arrow(axes, view, leg.joints[number], color, 0.083 * unit)
            at = tuple(view.project(leg.joints[number].position)[:2])
            look: dict[str, Any] = {"ha": "center", "fontweight": "bold", "zorder": 9}
            note(axes, f"{number + 1}", at, (0, 5), color=color, **look)
