"""The robot as a picture: each link's outline, from the farthest to the nearest, and its legs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from actuators.arrays import Array
from reports.figures.style import CYCLE, INK, QUIET, WIDTH, house_style, new_figure, note
from reports.scene import Leg, Solid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


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


def outline(points: Array) -> Array:
    """Corners of the convex hull of points in a plane, counter-clockwise, shape (P, 2)."""
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except (QhullError, ValueError):  # on a line, or too few
        return points


def extent(solids: Sequence[Solid], legs: Sequence[Leg]) -> Array:
    """Points that span all that is drawn, shape (P, 3) [m]."""
    ends = [np.vstack([leg.position, leg.foot]) for leg in legs]
    return np.concatenate([*(solid.points for solid in solids), *ends])


def draw_robot(axes: Axes, view: Array, solids: Sequence[Solid], legs: Sequence[Leg]) -> None:
    """Draw outlines of the links, and thin lines along the joints of each leg.

    Links are drawn in the order of their middles' depth, so that bodies that reach around each
    other may be drawn in the wrong order.

    Args:
        axes: Their unit becomes the metre.
        view: Of the camera, shape (3, 3).
        solids: The links.
        legs: All legs.
    """
    seen = [(solid.points @ view.T, solid.color) for solid in solids]
    for points, color in sorted(seen, key=lambda one: float(one[0][:, 2].mean())):
        face, edge = 0.4 + 0.6 * color, 0.3 + 0.4 * color  # pale, so that the legs can be seen
        axes.fill(*outline(points[:, :2]).T, facecolor=face, edgecolor=edge, lw=0.6, zorder=2)
    for leg in legs:
        path = np.vstack([leg.position, leg.foot]) @ view.T
        axes.plot(*path[:, :2].T, "o-", color=QUIET, linewidth=1, markersize=2.5, zorder=3)
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
    """Four views of the robot; arrows show which way its joints turn, axes how long it is.

    Args:
        solids: Everything visible in the world, z up.
        legs: All legs.
        mass_centre: Centre of mass in the world, shape (3,) [m].
    """
    figure = new_figure(WIDTH, title, subtitle)
    views = {"": OBLIQUE, "xy": TOP, "yz": FRONT, "xz": SIDE}
    names = ("joint axes", "from above", "from ahead", "from the right")
    grid = figure.subplots(2, 2).ravel()
    for axes, (letters, view), name in zip(grid, views.items(), names, strict=True):
        draw_robot(axes, view, solids, legs)
        axes.set_title(name, color=QUIET)
        axes.margins(0.12)
        axes.locator_params(nbins=4)
        if not letters:
            axes.set_axis_off()
            continue
        axes.set(xlabel=f"{letters[0]} [m]", ylabel=f"{letters[1]} [m]")
        if mass_centre is not None:
            at = view[:2] @ mass_centre
            axes.plot(*at, "o", markersize=7, color="white", mec=INK, zorder=8)
            axes.plot(*at, "+", markersize=7, color=INK, zorder=8)
    _directions(grid[0], solids, legs)
    for leg in legs:
        side = 8.0 if leg.foot[1] > 0 else -8.0
        look = {"va": "center", "fontweight": "bold"}
        note(grid[1], leg.name.upper(), leg.foot[:2], (0, side), **look)
        note(grid[0], leg.name.upper(), (OBLIQUE @ leg.foot)[:2], (0, -6), **look)
    figure.legend(loc="outside lower center", ncols=4)
    return figure


def _directions(axes: Axes, solids: Sequence[Solid], legs: Sequence[Leg]) -> None:
    """An arrow along each joint's axis: positive rotation is right-handed about it."""
    unit = float(np.ptp(extent(solids, legs), axis=0).max())
    seen: dict[int, Any] = {}
    for leg in legs:
        for k, (origin, axis) in enumerate(zip(leg.position, leg.axis, strict=True)):
            color = CYCLE[k % len(CYCLE)]
            ends = origin + np.array([[-0.06], [0.14]]) * unit * axis
            tail, tip = (ends @ OBLIQUE.T)[:, :2]
            look: dict[str, Any] = {"arrowstyle": "-|>,head_width=0.15,head_length=0.3"}
            look |= {"color": color, "linewidth": 2.2 if leg.slides[k] else 1, "shrinkA": 0}
            if np.hypot(*(tip - tail)) > 0.02 * unit:  # not towards the viewer
                axes.annotate("", tip, tail, arrowprops=look | {"shrinkB": 0}, zorder=7)
            label = "_" if k in seen else f"joint {k + 1}"
            at = (OBLIQUE @ origin)[:2]
            seen[k] = axes.plot(*at, "o", markersize=3, color=color, zorder=7, label=label)
