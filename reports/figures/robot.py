"""The robot as a picture: each link's convex hull, faces drawn from the farthest to the nearest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

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
    arrow,
    house_style,
    new_figure,
    note,
    on_white,
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
OBLIQUE_LEFT = _camera((1.0, 1.35, 0.85))
TOP = _camera((0, 0, 1), up=(0, 1, 0))
FRONT = _camera((1, 0, 0))
SIDE = _camera((0, -1, 0))
#: Towards the lamp, in the camera's frame.
_LAMP = np.array([-0.35, 0.75, 0.56])
#: Longest edge of a triangle, in sizes of the robot.
_SMALL = 1 / 32
#: A hull of more corners than this is thinned, to one in a cell of this share of the robot's size.
_MANY, _CELL = 100, 1 / 80
#: Width and height of a panel of the robot's own size.
_ROOM = 1.3
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


@dataclass(frozen=True)
class Surface:
    """Small triangles of all solids: N of them."""

    corners: Array  #: Shape (N, 3, 3) [m].
    normal: Array  #: Outward unit vectors, shape (N, 3).
    color: Array  #: Red, green, blue from 0 to 1, shape (N, 3).


def surface(solids: Sequence[Solid]) -> Surface:
    """Convex hulls of solids, cut into triangles so small that their middles tell their order."""
    from scipy.spatial import ConvexHull, QhullError
    from trimesh.remesh import subdivide_to_size

    parts = [(np.empty((0, 3, 3)), np.empty((0, 3)), np.empty((0, 3)))]
    if not solids:
        return Surface(*parts[0])
    unit = float(np.ptp(np.concatenate([solid.points for solid in solids]), axis=0).max())
    for solid in solids:
        try:
            hull = ConvexHull(solid.points)
            if len(hull.vertices) > _MANY:  # those of each cell in one
                corners = solid.points[hull.vertices]
                cells = np.round(corners / (_CELL * unit))
                hull = ConvexHull(corners[np.unique(cells, axis=0, return_index=True)[1]])
        except (QhullError, ValueError):
            continue  # points in one plane bound no body
        points, triangles, of = subdivide_to_size(
            hull.points, hull.simplices, _SMALL * unit, max_iter=20, return_index=True
        )
        parts.append(
            (points[triangles], hull.equations[of, :3], np.tile(solid.color, (len(of), 1)))
        )
    return Surface(*(np.concatenate(values) for values in zip(*parts, strict=True)))


def extent(solids: Sequence[Solid], legs: Sequence[Leg]) -> Array:
    """Points that span all that is drawn, shape (P, 3) [m]."""
    joints = [joint.position for leg in legs for joint in leg.joints]
    return np.concatenate([*(s.points for s in solids), joints, [leg.foot for leg in legs]])


def draw_robot(
    axes: Axes, view: Array, shown: Surface, legs: Sequence[Leg], fade: float = 0.0
) -> None:
    """Draw links, and sticks between the joints of bare legs, into axes whose unit is the metre.

    Args:
        view: Of the camera, shape (3, 3).
        shown: Of the links.
        legs: All legs.
        fade: From 0 to 1, towards white, for a robot behind its annotation.
    """
    from matplotlib.collections import PolyCollection

    normal = shown.normal @ view.T
    corners = shown.corners @ view.T
    order = np.argsort(corners[:, :, 2].mean(axis=1), kind="stable")
    order = order[normal[order, 2] > 1e-6]  # seen from outside
    light = 0.66 + 0.34 * np.maximum(0.0, normal[order] @ _LAMP)
    colors = np.clip((0.18 + 0.68 * shown.color[order]) * light[:, None], 0, 1)
    colors += fade * (1 - colors)
    # Edges in the faces' own colours close the seams between them. Of so many an image is smaller.
    look: dict[str, Any] = {"facecolors": colors, "edgecolors": colors, "linewidths": 0.4}
    flat: Any = corners[order, :, :2]
    links = PolyCollection(flat, rasterized=True, snap=False, zorder=2, in_layout=False, **look)
    axes.add_collection(links, autolim=False)
    centre = np.mean([leg.joints[0].position for leg in legs], axis=0)
    for leg in (leg for leg in legs if leg.bare):
        path = np.array([centre, *(joint.position for joint in leg.joints), leg.foot]) @ view.T
        axes.plot(*path[:, :2].T, "o-", color=QUIET, linewidth=3, markersize=5, zorder=3)
    axes.set_aspect("equal")


@house_style()
def robot_figure(
    solids: Sequence[Solid],
    legs: Sequence[Leg],
    *,
    title: str,
    subtitle: str = "",
    mass_centre: Array | None = None,
) -> Figure:
    """Four views of the robot; lengths can be read off the axes.

    Args:
        solids: Everything visible in the world, z up.
        legs: For labels and sticks.
        mass_centre: Centre of mass in the world, shape (3,) [m].
    """
    shown, corners = surface(solids), extent(solids, legs)
    views = {"oblique": OBLIQUE, "from above": TOP, "from ahead": FRONT, "from the right": SIDE}
    least = 0.4 * float(np.ptp(corners, axis=0).max()) + 1e-6  # of a slender robot
    spans = {n: np.maximum(np.ptp(corners @ view.T, axis=0), least) for n, view in views.items()}
    # One scale for all four.
    across = [max(spans["oblique"][0], spans["from ahead"][0]), spans["from above"][0]]
    down = [max(spans["oblique"][1], spans["from above"][1]), spans["from ahead"][1]]
    scale = (WIDTH - 1.5) / (_ROOM * sum(across))
    figure = new_figure(2.0 + scale * _ROOM * sum(down), title, subtitle)
    grid = figure.subplots(2, 2, width_ratios=across, height_ratios=down)
    for axes, (name, view) in zip(grid.ravel(), views.items(), strict=True):
        draw_robot(axes, view, shown, legs)
        axes.set_title(name, color=QUIET)
        seen = (corners @ view.T)[:, :2]
        middle, half = (seen.min(axis=0) + seen.max(axis=0)) / 2, _ROOM * spans[name][:2] / 2
        axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
        axes.set_ylim(middle[1] - half[1], middle[1] + half[1])
        axes.tick_params(labelsize=8)
        axes.locator_params(nbins=4)
        if mass_centre is not None and name != "oblique":
            at = view[:2] @ mass_centre
            for marker, color in (("o", "white"), ("+", INK)):
                axes.plot(*at, marker, markersize=7, color=color, mec=INK, zorder=8)
    (oblique, above), (ahead, beside) = grid
    for axes, right, up in ((above, "x", "y"), (ahead, "y", "z"), (beside, "x", "z")):
        axes.set_xlabel(f"{right} [m]")
        axes.set_ylabel(f"{up} [m]")
    oblique.set_axis_off()
    look: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 8, "fontweight": "bold"}
    look |= {"zorder": 9, "bbox": on_white(0.5) | {"alpha": 0.75}}
    for leg in legs:
        side = 8.0 if leg.foot[1] > 0 else -8.0
        note(above, leg.name.upper(), (leg.foot[0], leg.foot[1]), (0, side), **look)
        note(oblique, leg.name.upper(), tuple((OBLIQUE @ leg.foot)[:2]), (0, -6), **look)
    return figure


@house_style()
def joint_directions_figure(
    solids: Sequence[Solid], legs: Sequence[Leg], shown: str, *, title: str, zero_pose: str = ""
) -> Figure:
    """Axes of all joints, and of one leg how each joint moves when its coordinate grows.

    Args:
        solids: Everything visible in the zero pose.
        legs: All legs in the zero pose.
        shown: Name of the leg whose joints are named.
        zero_pose: The robot file's words, written below the title.
    """
    from matplotlib.lines import Line2D

    leg = next(leg for leg in legs if leg.name == shown)
    seen, unit = surface(solids), float(np.ptp(extent(solids, legs), axis=0).max())
    words = "arrows: axes; positive rotation is right-handed about them"
    if any(joint.slides for one in legs for joint in one.joints):
        words += ", positive sliding along a double arrow"
    if zero_pose:
        words += f". Zero pose: {zero_pose}"
    figure = new_figure(3.2 + 0.2 * -(-len(leg.joints) // 2), title, words)
    whole, close = figure.subplots(1, 2, width_ratios=[1.1, 1.0])
    view = OBLIQUE if leg.foot[1] <= 0 else OBLIQUE_LEFT
    for axes in (whole, close):
        draw_robot(axes, view, seen, legs, fade=0.5)
        axes.set_axis_off()
    handles = []
    for number, joint in enumerate(leg.joints):
        color = JOINT_COLORS[number % len(JOINT_COLORS)]
        for one in legs:
            if number < len(one.joints):
                _axis(whole, view, one.joints[number], color, 0.14 * unit)
        _axis(close, view, joint, color, 0.2 * unit)
        if not joint.slides:
            # Most of a circle in the positive sense; its gap is where the image is lowest.
            first = view[1] - (view[1] @ joint.axis) * joint.axis
            if np.linalg.norm(first) < 1e-6:
                first = view[0] - (view[0] @ joint.axis) * joint.axis
            first /= np.linalg.norm(first)
            angle = np.radians(np.linspace(-215, 55, 40))[:, None]
            ring = np.cos(angle) * first + np.sin(angle) * np.cross(joint.axis, first)
            seen = ((joint.position + 0.09 * unit * ring) @ view.T)[:, :2]
            close.plot(*seen[:-3].T, color=color, linewidth=1.5, zorder=7, solid_capstyle="butt")
            arrow(close, seen[-1], seen[-4], color)
        name = f"{number + 1} {joint.name}"
        handles.append(Line2D([], [], color=color, linewidth=2.5, label=name))
    points = np.array([*(joint.position for joint in leg.joints), leg.foot]) @ view.T
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    half = 0.5 * float((high - low).max()) + 0.17 * unit
    middle = (low + high) / 2
    close.set_xlim(middle[0] - half, middle[0] + half)
    close.set_ylim(middle[1] - half, middle[1] + half)
    corners = (extent(solids, legs) @ view.T)[:, :2]
    whole.update_datalim(corners)
    whole.autoscale_view()
    whole.set_title("all legs", color=QUIET)
    close.set_title(f"leg {shown.upper()}", color=QUIET)
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def _axis(axes: Axes, view: Array, joint: JointMark, color: str, length: float) -> None:
    """An arrow along a joint's axis; of a sliding joint with a second head."""
    ends = joint.position + np.array([[-0.4], [1.0]]) * length * joint.axis
    tail, tip = (ends @ view.T)[:, :2]
    if np.hypot(*(tip - tail)) > 0.1 * length:
        arrow(axes, tip, tail, color, head=(0.18, 0.4), width=1.2)
        if joint.slides:
            arrow(axes, tail + 0.8 * (tip - tail), tail, color, head=(0.18, 0.4), width=2.2)
    axes.plot(*(view @ joint.position)[:2], "o", markersize=3, color=color, zorder=7)
