"""The robot as a picture: from ahead, from the right, from above, obliquely, with dimensions."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.arrays import Array
from reports.figures.robot.projection import FRONT, OBLIQUE, SIDE, TOP, View, draw_scene, extent
from reports.figures.robot.solids import Leg, Solid, reach
from reports.figures.style import (
    BLUE,
    GREEN,
    INK,
    QUIET,
    VERMILION,
    arrow,
    house_style,
    new_figure,
    note,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: A link shorter than this share of its leg gets no dimension.
_SHORT = 0.12
#: A link is measured in a view that shows at least this share of its length.
_FLAT = 0.95


def links_of(leg: Leg) -> list[tuple[Array, Array]]:
    """The links of a leg that are long enough to be seen: both ends in the world [m]."""
    least = _SHORT * leg.length
    return [(a, b) for a, b in leg.links if float(np.linalg.norm(b - a)) > least > 0]


def hip_of(leg: Leg) -> Array:
    """Where the first long link of a leg begins, shape (3,) [m]."""
    links = links_of(leg)
    return links[0][0] if links else leg.joints[0].position


def dimension(axes: Axes, start: Array, end: Array, offset: tuple[float, float], text: str) -> None:
    """A dimension line parallel to start-end, with extension lines and its text on it.

    Args:
        axes: In metres.
        start: Shape (2,) [m].
        end: Shape (2,) [m].
        offset: From the measured points to the dimension line [m].
    """
    shift = np.asarray(offset)
    a, b = start + shift, end + shift
    beyond = shift / max(float(np.hypot(*shift)), 1e-9) * 0.012
    for point, tip in ((start, a), (end, b)):
        ends = np.column_stack([point + 0.25 * beyond, tip + beyond])
        axes.plot(*ends, color=INK, linewidth=0.5, zorder=5)
    look: dict[str, Any] = {"style": "<|-|>", "head": (0.12, 0.3), "width": 0.7}
    arrow(axes, b, a, INK, zorder=5, **look)
    angle = float(np.degrees(np.arctan2(b[1] - a[1], b[0] - a[0])))
    angle = (angle + 60) % 180 - 60  # readable from below or from the right
    middle = (a + b) / 2
    clear = {"boxstyle": "square,pad=0.12", "facecolor": "white", "edgecolor": "none"}
    look = {"ha": "center", "va": "center", "fontsize": 7.5, "zorder": 6, "bbox": clear}
    axes.text(middle[0], middle[1], text, rotation=angle, rotation_mode="anchor", **look)


def _millimetres(a: Array, b: Array) -> str:
    return f"{1e3 * float(np.linalg.norm(b - a)):.0f} mm"


def link_dimensions(axes: Axes, view: View, legs: Sequence[Leg], unit: float) -> None:
    """Lengths of the links that show it, of the leg that shows most, at the image's left."""
    most = max(len(flat_links(leg, view)) for leg in legs)
    able = [leg for leg in legs if len(flat_links(leg, view)) == most]
    leg = min(
        able, key=lambda one: (round(float(view.project(one.foot)[0] / unit), 2), one.foot[1])
    )
    links = flat_links(leg, view)
    middle = np.mean([view.project(end)[:2] for link in links for end in link], axis=0)
    for start, end in links:
        a, b = view.project(start)[:2], view.project(end)[:2]
        normal = np.array([-(b - a)[1], (b - a)[0]]) / np.linalg.norm(b - a)
        normal *= np.sign(normal @ ((a + b) / 2 - middle)) or 1.0  # outside of the knee
        dimension(axes, a, b, tuple(0.14 * unit * normal), _millimetres(start, end))


def flat_links(leg: Leg, view: View) -> list[tuple[Array, Array]]:
    """Those links of a leg that a view shows in nearly their length."""
    return [
        (a, b)
        for a, b in links_of(leg)
        if np.hypot(*view.project(b - a)[:2]) > _FLAT * np.linalg.norm(b - a)
    ]


def front_dimensions(axes: Axes, legs: Sequence[Leg], ground: float, unit: float) -> None:
    """Track and height of the hip."""
    feet = FRONT.project(np.array([leg.foot for leg in legs]))[:, :2]
    left, right = feet[feet[:, 0].argmin()], feet[feet[:, 0].argmax()]
    level = np.array([1.0, 0.0])
    a, b = left * level + [0, ground], right * level + [0, ground]
    dimension(axes, a, b, (0, -0.1 * unit), _millimetres(a, b))
    hip = max((FRONT.project(hip_of(leg))[:2] for leg in legs), key=lambda at: float(at[0]))
    a, b = np.array([hip[0], ground]), hip
    x = max(float(right[0]), float(hip[0])) + 0.22 * unit - float(hip[0])
    dimension(axes, a, b, (x, 0), _millimetres(a, b))


def side_dimensions(axes: Axes, scene: Sequence[Solid], legs: Sequence[Leg], unit: float) -> None:
    """Distances of the hips, and the length of the trunk where it is a box that carries them."""
    hips = _apart([float(hip_of(leg)[0]) for leg in legs], 0.05 * unit)
    top = max(float(hip_of(leg)[2]) for leg in legs)
    trunks = []
    for box in (solid.corners for solid in scene if solid.kind == "box"):
        edges = np.linalg.norm(box[[4, 2, 1]] - box[0], axis=1)  # along its x, y and z
        if edges[0] >= hips[-1] - hips[0] > 0:
            trunks.append((float(edges.prod()), float(edges[0]), box[[5, 7]].mean(axis=0)))
    if trunks:
        _, size, end = max(trunks, key=lambda trunk: trunk[0])
        front, length = SIDE.project(end)[:2], np.array([size, 0.0])
        dimension(axes, front - length, front, (0, 0.25 * unit), f"{1e3 * size:.0f} mm")
        top = float(front[1])
    else:
        top = max(top, float(extent(SIDE, scene)[1][1]) - 0.04 * unit)
    for a, b in pairwise(hips):
        start, end = np.array([a, top]), np.array([b, top])
        dimension(axes, start, end, (0, 0.117 * unit), _millimetres(start, end))


def _apart(values: Sequence[float], least: float) -> list[float]:
    """Values in order, without those nearer than `least` to the one before."""
    kept: list[float] = []
    for value in sorted(values):
        if not kept or value - kept[-1] > least:
            kept.append(value)
    return kept


def top_dimensions(axes: Axes, scene: Sequence[Solid], legs: Sequence[Leg], unit: float) -> None:
    """Half the distance between the hips, from the mid-plane."""
    left = [leg for leg in legs if hip_of(leg)[1] > 0.02 * unit]
    if not left:
        return
    hip = TOP.project(hip_of(max(left, key=lambda one: hip_of(one)[0])))[:2]
    middle = np.array([hip[0], 0.0])
    x = float(extent(TOP, scene)[1][0]) + 0.14 * unit - float(hip[0])
    dimension(axes, middle, hip, (x, 0), _millimetres(middle, hip))


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
        look: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 8.5, "color": color}
        line = {"arrowstyle": "<-", "color": color, "linewidth": 1.1, "shrinkB": 0}
        look |= {"xycoords": "axes fraction", "fontweight": "bold", "arrowprops": line}
        note(axes, name, corner, tuple(length * seen), **look)
