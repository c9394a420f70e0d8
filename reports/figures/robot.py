"""The robot as a picture: each link's outline, from the farthest to the nearest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from actuators.arrays import Array
from reports.figures.style import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    QUIET,
    SKY,
    VERMILION,
    WIDTH,
    house_style,
    new_figure,
    note,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Solid:
    """A link, or what the robot carries."""

    points: Array  #: Whose convex hull is drawn, in the world, shape (P, 3) [m].
    color: tuple[float, float, float]  #: Red, green, blue from 0 to 1.


@dataclass(frozen=True)
class JointMark:
    """Where a joint is and which way it moves."""

    name: str  #: Of the joint.
    position: Array  #: Origin in the world, shape (3,) [m].
    #: Unit vector in the world, shape (3,); positive rotation is right-handed about it, positive
    #: sliding along it.
    axis: Array
    slides: bool = False  #: Whether it is prismatic.


@dataclass(frozen=True)
class Leg:
    """One leg in one posture."""

    name: str  #: Shown at the foot.
    joints: tuple[JointMark, ...]  #: From the base outward.
    foot: Array  #: Contact point in the world, shape (3,) [m].
    bare: bool = False  #: Whether no link of it has a shape, so that it is drawn as sticks.


def _camera(towards_viewer: Sequence[float], up: Sequence[float] = (0, 0, 1)) -> Array:
    """Rows: the image's right, its up, and the direction towards the viewer, in the world."""
    toward = np.asarray(towards_viewer, float) / np.linalg.norm(towards_viewer)
    right = np.cross(up, toward)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(toward, right), toward])


OBLIQUE = _camera((1.0, -1.35, 0.85))
TOP = _camera((0, 0, 1), up=(0, 1, 0))
FRONT = _camera((1, 0, 0))
SIDE = _camera((0, -1, 0))
JOINT_COLORS = (GREEN, BLUE, VERMILION, PURPLE, ORANGE, SKY, INK)


def outline(points: Array) -> Array:
    """Corners of the convex hull of points in a plane, counter-clockwise, shape (P, 2)."""
    from scipy.spatial import ConvexHull, QhullError

    points = np.unique(np.round(points, 6), axis=0)
    try:
        corners: Array = points[ConvexHull(points).vertices]
    except (QhullError, ValueError):
        return points[[0, -1]] if len(points) > 1 else points
    return corners


def extent(solids: Sequence[Solid], legs: Sequence[Leg]) -> Array:
    """Points that span all that is drawn, shape (P, 3) [m]."""
    joints = [joint.position for leg in legs for joint in leg.joints]
    return np.concatenate([*(s.points for s in solids), joints, [leg.foot for leg in legs]])


def draw_robot(
    axes: Axes, view: Array, solids: Sequence[Solid], legs: Sequence[Leg], fade: float = 0.0
) -> None:
    """Draw links as outlines of their hulls, and sticks between the joints of bare legs.

    Links are drawn in the order of their middles' depth, so that bodies that reach around each
    other may be drawn in the wrong order.

    Args:
        axes: Their unit becomes the metre.
        view: Of the camera, shape (3, 3).
        solids: The links.
        legs: All legs.
        fade: From 0 to 1, towards white, for a robot behind its annotation.
    """
    seen = [(solid.points @ view.T, np.array(solid.color)) for solid in solids]
    for points, color in sorted(seen, key=lambda one: float(one[0][:, 2].mean())):
        face, edge = (shade * color * (1 - fade) + fade for shade in (0.92, 0.55))
        axes.fill(*outline(points[:, :2]).T, facecolor=face, edgecolor=edge, lw=0.7, zorder=2)
    centre = np.mean([leg.joints[0].position for leg in legs], axis=0)
    for leg in (leg for leg in legs if leg.bare):
        path = np.array([centre, *(joint.position for joint in leg.joints), leg.foot]) @ view.T
        axes.plot(*path[:, :2].T, "o-", color=QUIET, linewidth=3, markersize=5, zorder=3)
    axes.set_aspect("equal")
    axes.grid(False)


@house_style()
def robot_figure(
    solids: Sequence[Solid],
    legs: Sequence[Leg],
    *,
    title: str,
    subtitle: str = "",
    mass_centre: Array | None = None,
) -> Figure:
    """Four views of the robot on one scale; lengths can be read off the axes.

    Args:
        solids: Everything visible in the world, z up.
        legs: For labels and sticks.
        mass_centre: Centre of mass in the world, shape (3,) [m].
    """
    corners = extent(solids, legs)
    least = 0.4 * float(np.ptp(corners, axis=0).max()) + 1e-6  # of a slender robot
    views = (OBLIQUE, TOP, FRONT, SIDE)
    spans = [1.3 * np.maximum(np.ptp(corners @ view.T, axis=0), least) for view in views]
    across = [max(spans[0][0], spans[2][0]), max(spans[1][0], spans[3][0])]
    down = [max(spans[0][1], spans[1][1]), max(spans[2][1], spans[3][1])]
    figure = new_figure(2.0 + (WIDTH - 1.5) * sum(down) / sum(across), title, subtitle)
    grid = figure.subplots(2, 2, width_ratios=across, height_ratios=down).ravel()
    names = ("oblique", "from above", "from ahead", "from the right")
    for axes, view, name, span, letters in zip(
        grid, views, names, spans, ("", "xy", "yz", "xz"), strict=True
    ):
        draw_robot(axes, view, solids, legs)
        axes.set_title(name, color=QUIET)
        seen = (corners @ view.T)[:, :2]
        ends = (seen.min(axis=0) + seen.max(axis=0)) / 2 + np.array([[-0.5], [0.5]]) * span[:2]
        axes.set(xlim=ends[:, 0], ylim=ends[:, 1])
        axes.locator_params(nbins=4)
        if not letters:
            axes.set_axis_off()
            continue
        axes.set(xlabel=f"{letters[0]} [m]", ylabel=f"{letters[1]} [m]")
        if mass_centre is not None:
            at = view[:2] @ mass_centre
            axes.plot(*at, "o", markersize=7, color="white", mec=INK, zorder=8)
            axes.plot(*at, "+", markersize=7, color=INK, zorder=8)
    for leg in legs:
        side = 8.0 if leg.foot[1] > 0 else -8.0
        look = {"va": "center", "fontweight": "bold"}
        note(grid[1], leg.name.upper(), leg.foot[:2], (0, side), **look)
        note(grid[0], leg.name.upper(), (OBLIQUE @ leg.foot)[:2], (0, -6), **look)
    return figure


@house_style()
def joint_directions_figure(
    solids: Sequence[Solid], legs: Sequence[Leg], shown: str, *, title: str, zero_pose: str = ""
) -> Figure:
    """The zero pose, and which way each joint moves when its coordinate grows.

    Args:
        solids: Everything visible in the zero pose.
        legs: All legs in the zero pose.
        shown: Name of the leg whose joints the key names.
        zero_pose: The robot file's words, written below the title.
    """
    unit = float(np.ptp(extent(solids, legs), axis=0).max())
    words = "arrows: axes; positive rotation is right-handed about them"
    if any(joint.slides for one in legs for joint in one.joints):
        words += ", positive sliding along a wide one"
    if zero_pose:
        words += f". Zero pose: {zero_pose}"
    figure = new_figure(3.9, title, words)
    axes = figure.subplots()
    draw_robot(axes, OBLIQUE, solids, legs, fade=0.5)
    axes.set_axis_off()
    for leg in legs:
        for k, (joint, color) in enumerate(zip(leg.joints, JOINT_COLORS, strict=False), 1):
            ends = joint.position + np.array([[-0.06], [0.14]]) * unit * joint.axis
            tail, tip = (ends @ OBLIQUE.T)[:, :2]
            width = 2.5 if joint.slides else 1.2
            look = {"arrowstyle": "-|>,head_width=0.18,head_length=0.4", "linewidth": width}
            look |= {"color": color, "shrinkA": 0, "shrinkB": 0}
            if np.hypot(*(tip - tail)) > 0.02 * unit:  # not towards the viewer
                axes.annotate("", tip, tail, arrowprops=look, zorder=7)
            label = f"{k} {joint.name}" if leg.name == shown else None
            at = (OBLIQUE @ joint.position)[:2]
            axes.plot(*at, "o", markersize=3.5, color=color, zorder=7, label=label)
        note(axes, leg.name.upper(), (OBLIQUE @ leg.foot)[:2], (0, -10), fontweight="bold")
    figure.legend(loc="outside lower center", ncols=2)
    return figure
