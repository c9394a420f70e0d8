"""Marks on pictures of robots: dimension lines and arrows that show a sense of rotation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from reports.figures.robot.projection import View
from reports.figures.robot.solids import JointMark
from reports.figures.style import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


def dimension(axes: Axes, start: Array, end: Array, offset: tuple[float, float], text: str) -> None:
    """A dimension line parallel to start-end, with extension lines and its text on it.

    Args:
        axes: In metres.
        start: Shape (2,) [m].
        end: Shape (2,) [m].
        offset: From the measured points to the dimension line [m].
        text: Value with unit.
    """
    shift = np.asarray(offset)
    a, b = start + shift, end + shift
    beyond = shift / max(float(np.hypot(*shift)), 1e-9) * 0.012
    for point, tip in ((start, a), (end, b)):
        axes.plot(
            *np.column_stack([point + 0.25 * beyond, tip + beyond]),
            color=INK,
            linewidth=0.5,
            zorder=5,
        )
    axes.annotate(
        "",
        b,
        a,
        arrowprops={
            "arrowstyle": "<|-|>,head_width=0.12,head_length=0.3",
            "linewidth": 0.7,
            "color": INK,
            "shrinkA": 0,
            "shrinkB": 0,
        },
        zorder=5,
    )
    angle = float(np.degrees(np.arctan2(b[1] - a[1], b[0] - a[0])))
    angle = (angle + 60) % 180 - 60  # readable from below or from the right
    middle = (a + b) / 2
    axes.text(
        middle[0],
        middle[1],
        text,
        ha="center",
        va="center",
        rotation=angle,
        rotation_mode="anchor",
        fontsize=7.5,
        zorder=6,
        bbox={"boxstyle": "square,pad=0.12", "facecolor": "white", "edgecolor": "none"},
    )


def rotation_arrow(
    axes: Axes, view: View, joint: JointMark, color: str, radius: float = 0.05
) -> tuple[float, float]:
    """A circular arrow around a joint's axis in its positive sense, as the view shows it.

    Args:
        axes: In metres.
        view: The camera.
        joint: Where and about what.
        color: Of the arrow.
        radius: [m].

    Returns:
        A point outside the arrow at which to write, in the image [m].
    """
    # Start the arc where it is lowest in the image, so that all arcs of a view open alike.
    up = view.axes[1]
    first = up - (up @ joint.axis) * joint.axis
    if np.linalg.norm(first) < 1e-6:
        first = view.axes[0] - (view.axes[0] @ joint.axis) * joint.axis
    first /= np.linalg.norm(first)
    second = np.cross(joint.axis, first)
    angle = np.radians(np.linspace(-215, 55, 60))[:, None]
    circle = joint.position + radius * (np.cos(angle) * first + np.sin(angle) * second)
    seen = view.project(circle)[:, :2]
    axes.plot(*seen[:-4].T, color=color, linewidth=1.5, zorder=7, solid_capstyle="butt")
    axes.annotate(
        "",
        seen[-1],
        seen[-6],
        arrowprops={
            "arrowstyle": "-|>,head_width=0.22,head_length=0.5",
            "linewidth": 1.5,
            "color": color,
            "shrinkA": 0,
            "shrinkB": 0,
        },
        zorder=7,
    )
    centre = view.project(joint.position)[:2]
    axes.plot(*centre, marker="o", markersize=3.2, color=color, zorder=7)
    return float(centre[0]), float(centre[1])


def sliding_arrow(
    axes: Axes, view: View, joint: JointMark, color: str, length: float = 0.05
) -> tuple[float, float]:
    """A straight arrow along a sliding joint's axis in its positive sense.

    Args:
        axes: In metres.
        view: The camera.
        joint: Where and along what.
        color: Of the arrow.
        length: Half of it [m].

    Returns:
        The joint's place in the image [m].
    """
    ends = view.project(joint.position + np.array([[-1.0], [1.0]]) * length * joint.axis)[:, :2]
    axes.annotate(
        "",
        ends[1],
        ends[0],
        arrowprops={
            "arrowstyle": "-|>,head_width=0.22,head_length=0.5",
            "linewidth": 2.2,
            "color": color,
            "shrinkA": 0,
            "shrinkB": 0,
        },
        zorder=7,
    )
    centre = view.project(joint.position)[:2]
    return float(centre[0]), float(centre[1])


def axis_line(axes: Axes, view: View, joint: JointMark, color: str, length: float = 0.11) -> None:
    """The joint's axis as a dash-dotted line with an arrow at its positive end."""
    ends = joint.position + np.array([[-0.6], [1.0]]) * length * joint.axis
    seen = view.project(ends)[:, :2]
    if np.hypot(*(seen[1] - seen[0])) < 0.2 * length:
        return
    axes.annotate(
        "",
        seen[1],
        seen[0],
        arrowprops={
            "arrowstyle": "-|>,head_width=0.15,head_length=0.35",
            "linewidth": 0.9,
            "linestyle": (0, (6, 2, 1, 2)),
            "color": color,
            "shrinkA": 0,
            "shrinkB": 0,
        },
        zorder=6,
    )
