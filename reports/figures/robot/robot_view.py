"""The robot as a picture: from ahead, from the right, from above, and obliquely."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from reports.errors import FigureError
from reports.figures.marks import dimension
from reports.figures.robot.projection import FRONT, OBLIQUE, SIDE, TOP, View, draw_scene, extent
from reports.figures.robot.solids import JointMark, Primitive, Solid
from reports.figures.robot.sticks import with_sticks
from reports.figures.style import BLUE, GREEN, INK, QUIET, VERMILION, headline, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Leg:
    """One leg in one posture.

    Attributes:
        name: Shown at the foot.
        joints: From the base outward.
        foot: Contact point in the world, shape (3,) [m].
    """

    name: str
    joints: tuple[JointMark, ...]
    foot: Array


def legs_of(
    names: Mapping[str, tuple[Sequence[str], str]],
    marks: Sequence[JointMark],
    links: Mapping[str, Array],
) -> list[Leg]:
    """Gather legs from joint marks and link placements.

    Args:
        names: Leg to (its joints' names from the base outward, its foot link).
        marks: From `visuals.joint_marks`.
        links: Link name to placement, shape (4, 4) [m].

    Raises:
        FigureError: A joint or foot that is not there.
    """
    by_name = {mark.name: mark for mark in marks}
    legs = []
    for leg, (joints, foot) in names.items():
        lacking = [joint for joint in joints if joint not in by_name]
        if lacking or foot not in links:
            raise FigureError(f"leg '{leg}': '{(lacking or [foot])[0]}' is not placed")
        legs.append(Leg(leg, tuple(by_name[j] for j in joints), links[foot][:3, 3]))
    return legs


@styled
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
        title: First line.
        subtitle: Second line.
        mass_centre: Centre of mass in the world, shape (3,) [m].

    Raises:
        FigureError: Nothing to draw.
    """
    if not legs:
        raise FigureError(f"'{title}': no leg to draw")
    scene, remark = with_sticks(scene, legs)
    figure = new_figure(8.4)
    headline(figure, title, "; ".join(words for words in (subtitle, remark) if words))
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
        left, bottom, right, top = _ROOM[view.name]
        axes.set_xlim(low[0] - left, high[0] + right)
        axes.set_ylim(low[1] - bottom, high[1] + top)
    for axes, view in ((ahead, FRONT), (beside, SIDE)):
        low, high = extent(view, scene)
        axes.plot([low[0] - 0.05, high[0] + 0.05], [ground, ground], color=QUIET, linewidth=1.0)
    for leg in legs:
        # The trunk may hide a far foot from this side, but not the knee above it.
        far = leg.foot[1] > 0
        at = OBLIQUE.project(leg.joints[-1].position if far else leg.foot)[:2]
        _write(oblique, leg.name.upper(), at + [0, 0.06 if far else -0.035])
        reach = max(abs(float(leg.foot[1])), abs(float(leg.joints[-1].position[1]))) + 0.04
        x, y = leg.foot[0], reach * np.sign(leg.foot[1])
        _write(above, leg.name.upper(), np.array([x, y]))
    _front_dimensions(ahead, legs, ground)
    _side_dimensions(beside, scene, legs)
    _top_dimensions(above, legs)
    if mass_centre is not None:
        for axes, view in ((above, TOP), (ahead, FRONT), (beside, SIDE)):
            _mass_centre(axes, view.project(mass_centre))
    return figure


#: Room around the robot for annotation: left, below, right, above [m].
_ROOM = {
    OBLIQUE.name: (0.05, 0.07, 0.05, 0.06),
    TOP.name: (0.14, 0.06, 0.17, 0.06),
    FRONT.name: (0.16, 0.10, 0.16, 0.12),
    SIDE.name: (0.12, 0.06, 0.06, 0.18),
}


def _millimetres(a: Array, b: Array) -> str:
    return f"{1e3 * float(np.linalg.norm(b - a)):.0f} mm"


def _front_dimensions(axes: Axes, legs: Sequence[Leg], ground: float) -> None:
    """Track, height of the hip, and the links of the middle leg that lies in the view's plane."""
    feet = FRONT.project(np.array([leg.foot for leg in legs]))[:, :2]
    left, right = feet[feet[:, 0].argmin()], feet[feet[:, 0].argmax()]
    level = np.array([1.0, 0.0])
    a, b = left * level + [0, ground], right * level + [0, ground]
    dimension(axes, a, b, (0, -0.06), _millimetres(a, b))
    flat = [leg for leg in legs if _in_plane(leg, FRONT)]
    if not flat:
        return
    leg = max(flat, key=lambda one: -FRONT.project(one.foot)[0])  # on the image's left
    hip, knee = (FRONT.project(joint.position)[:2] for joint in leg.joints[-2:])
    foot = FRONT.project(leg.foot)[:2]
    outward = np.sign(foot[0]) if abs(foot[0]) > 1e-9 else 1.0
    dimension(axes, hip, knee, (0, 0.10), _millimetres(hip, knee))
    normal = np.array([-(foot - knee)[1], (foot - knee)[0]]) / np.linalg.norm(foot - knee)
    normal *= outward * np.sign(normal[0])
    dimension(axes, knee, foot, tuple(0.07 * normal), _millimetres(knee, foot))
    other = -hip[0]
    a, b = np.array([other, ground]), np.array([other, hip[1]])
    x = -outward * (abs(right[0]) + 0.13) - other
    dimension(axes, a, b, (float(x), 0), _millimetres(a, b))


def _in_plane(leg: Leg, view: View) -> bool:
    """Whether the outer links show in true length."""
    points = np.array([leg.joints[-2].position, leg.joints[-1].position, leg.foot])
    depth = view.project(points)[:, 2]
    return float(np.ptp(depth)) < 0.02


def _side_dimensions(axes: Axes, scene: Sequence[Solid], legs: Sequence[Leg]) -> None:
    """Length of the trunk and distances of the hips; the trunk is a box that carries them all."""
    hips = sorted({round(float(leg.joints[0].position[0]), 6) for leg in legs})
    top = max(float(leg.joints[0].position[2]) for leg in legs)
    boxes = [p for p in scene if isinstance(p, Primitive) and not p.sphere]
    trunks = [p for p in boxes if p.size[0] >= hips[-1] - hips[0] > 0]
    if trunks:
        trunk = max(trunks, key=lambda p: float(np.prod(p.size)))
        half = trunk.placement[:3, :3] @ np.array([trunk.size[0] / 2, 0, trunk.size[2] / 2])
        front = SIDE.project(trunk.placement[:3, 3] + half)[:2]
        length = np.array([trunk.size[0], 0.0])
        dimension(axes, front - length, front, (0, 0.15), f"{1e3 * trunk.size[0]:.0f} mm")
        top = float(front[1])
    for a, b in pairwise(hips):
        start, end = np.array([a, top]), np.array([b, top])
        dimension(axes, start, end, (0, 0.07), _millimetres(start, end))


def _top_dimensions(axes: Axes, legs: Sequence[Leg]) -> None:
    """Half the distance between the hips' axes, from the mid-plane."""
    left = [leg for leg in legs if leg.joints[0].position[1] > 0]
    if not left:
        return
    leg = max(left, key=lambda one: one.joints[0].position[0])
    hip = TOP.project(leg.joints[-2].position)[:2]
    middle = np.array([hip[0], 0.0])
    dimension(axes, middle, hip, (0.13, 0), _millimetres(middle, hip))


def _write(axes: Axes, text: str, at: Array) -> None:
    axes.text(at[0], at[1], text, ha="center", va="center", fontweight="bold", zorder=8)


def _mass_centre(axes: Axes, seen: Array) -> None:
    axes.plot(seen[0], seen[1], marker="o", markersize=8, color="white", mec=INK, zorder=8)
    axes.plot(seen[0], seen[1], marker="+", markersize=8, color=INK, mew=1.2, zorder=9)


def frame_arrows(axes: Axes, view: View) -> None:
    """World directions as a small tripod in the panel's corner."""
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
