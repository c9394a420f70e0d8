"""The gait as a picture: foot paths, support polygons with the centre of mass, footfall."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from reports.errors import FigureError
from reports.figures.marks import dimension
from reports.figures.style import (
    BLUE,
    FAINT,
    INK,
    QUIET,
    SHADE,
    VERMILION,
    headline,
    new_figure,
    number,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
#: Feet nearer than this would have their names on one another [m].
_NEAR = 0.08


@dataclass(frozen=True)
class GaitStretch:
    """Part of the gait during which the same feet stand.

    Attributes:
        time: Shape (N,) [s].
        feet: In the base frame, shape (N, L, 3) [m].
        stance: Legs that stand.
        mass_centre: In the base frame, shape (N, 3) [m].
        margin: Distance of the centre of mass from the nearest edge of the support polygon, seen
            from above, shape (N,) [m].
    """

    time: Array
    feet: Array
    stance: tuple[str, ...]
    mass_centre: Array
    margin: Array


@styled
def gait_figure(
    legs: Sequence[str],
    stretches: Sequence[GaitStretch],
    *,
    shown: str,
    body: tuple[float, float],
    title: str,
    subtitle: str = "",
) -> Figure:
    """Foot paths from above and from the side, three support polygons, footfall.

    Args:
        legs: All legs, in the order of the feet's arrays.
        stretches: One period.
        shown: The leg whose path is shown from the side.
        body: Length and width of the trunk [m].
        title: First line.
        subtitle: Second line.

    Raises:
        FigureError: Unknown leg, or no stretch in which it stands and none in which it swings.
    """
    if shown not in legs:
        raise FigureError(f"leg '{shown}' is not among {', '.join(legs)}")
    standing = [s for s in stretches if shown in s.stance]
    if not standing or len(standing) == len(stretches):
        raise FigureError(f"leg '{shown}' must both stand and swing in the gait drawn")
    figure = new_figure(8.8)
    headline(figure, title, subtitle)
    grid = figure.add_gridspec(3, 6, height_ratios=[1.25, 1.15, 0.95])
    paths = figure.add_subplot(grid[0, :3])
    beside = figure.add_subplot(grid[0, 3:])
    _paths_from_above(paths, legs, stretches, body)
    _path_from_the_side(beside, list(legs).index(shown), shown, stretches)
    for column, (share, word) in enumerate(((0.0, "start"), (0.5, "middle"), (1.0, "end"))):
        axes = figure.add_subplot(grid[1, 2 * column : 2 * column + 2])
        _support(axes, legs, standing[0], share, word, body)
    _footfall(figure.add_subplot(grid[2, :]), legs, stretches)
    return figure


def _body(axes: Axes, body: tuple[float, float]) -> None:
    from matplotlib.patches import Rectangle

    length, width = body
    axes.add_patch(
        Rectangle((-length / 2, -width / 2), length, width, facecolor=SHADE, edgecolor=FAINT)
    )
    axes.annotate(
        "",
        (length / 2 + 0.03, 0),
        (length / 2 - 0.10, 0),
        arrowprops={"arrowstyle": "-|>", "color": QUIET, "linewidth": 1.2},
    )
    axes.set_aspect("equal")
    axes.set_axis_off()


def _paths_from_above(
    axes: Axes, legs: Sequence[str], stretches: Sequence[GaitStretch], body: tuple[float, float]
) -> None:
    _body(axes, body)
    for i, leg in enumerate(legs):
        for stretch in stretches:
            x, y = stretch.feet[:, i, 0], stretch.feet[:, i, 1]
            if leg in stretch.stance:
                axes.plot(x, y, color=BLUE, linewidth=4)
            else:
                axes.plot(x, y, color=VERMILION, linewidth=1.2, zorder=3)
        middle = np.concatenate([s.feet[:, i] for s in stretches]).mean(axis=0)
        axes.text(
            middle[0],
            middle[1] + 0.05 * np.sign(middle[1]),
            leg.upper(),
            ha="center",
            va="center",
            fontweight="bold",
        )
    axes.set_title("foot paths relative to the body, from above", color=QUIET)
    axes.text(0, 0.03, "support", color=BLUE, ha="right", va="bottom", fontweight="bold")
    axes.text(0, -0.03, "transfer", color=VERMILION, ha="right", va="top", fontweight="bold")
    axes.margins(0.04, 0.12)


def _path_from_the_side(axes: Axes, index: int, leg: str, stretches: Sequence[GaitStretch]) -> None:
    ground = min(float(s.feet[:, index, 2].min()) for s in stretches)
    for stretch in stretches:
        x, z = stretch.feet[:, index, 0], stretch.feet[:, index, 2] - ground
        stands = leg in stretch.stance
        color = BLUE if stands else VERMILION
        axes.plot(x, z, color=color, linewidth=4 if stands else 1.6, zorder=3)
        k = len(x) // 2
        axes.annotate(
            "",
            (x[k], z[k]),
            (x[k - max(1, k // 12)], z[k - max(1, k // 12)]),
            arrowprops={"arrowstyle": "-|>,head_width=0.3,head_length=0.6", "color": color},
            zorder=4,
        )
        axes.text(
            x[k],
            z[k] - 0.012 if stands else z[k] + 0.012,
            "support: the foot rests on the ground" if stands else "transfer",
            color=color,
            ha="center",
            va="top" if stands else "bottom",
            fontweight="bold",
        )
    every = np.concatenate([s.feet[:, index] for s in stretches]) - [0, 0, ground]
    on_ground = np.concatenate([s.feet[:, index, 0] for s in stretches if leg in s.stance])
    stroke = np.array([[on_ground.min(), 0.0], [on_ground.max(), 0.0]])
    length = 1e3 * float(np.ptp(on_ground))
    dimension(axes, stroke[0], stroke[1], (0, -0.05), f"{length:.0f} mm")
    high = float(every[:, 2].max())
    right = float(every[:, 0].max())
    base, top = np.array([right, 0.0]), np.array([right, high])
    dimension(axes, base, top, (0.03, 0), f"{1e3 * high:.0f} mm")
    axes.set_title(f"path of foot {leg.upper()} relative to the body, from its side", color=QUIET)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_xlim(float(every[:, 0].min()) - 0.03, right + 0.07)
    axes.set_ylim(-0.085, high + 0.05)


def _support(
    axes: Axes,
    legs: Sequence[str],
    stretch: GaitStretch,
    share: float,
    word: str,
    body: tuple[float, float],
) -> None:
    from matplotlib.patches import Polygon

    sample = round(share * (stretch.time.size - 1))
    _body(axes, body)
    stance = [i for i, leg in enumerate(legs) if leg in stretch.stance]
    feet = stretch.feet[sample, :, :2]
    around = feet[stance] - feet[stance].mean(axis=0)
    ring = feet[stance][np.argsort(np.arctan2(around[:, 1], around[:, 0]))]
    axes.add_patch(Polygon(ring, facecolor=BLUE, alpha=0.22, edgecolor="none"))
    axes.add_patch(Polygon(ring, fill=False, edgecolor=BLUE, linewidth=1.2))
    for i, leg in enumerate(legs):
        stands = i in stance
        axes.plot(
            *feet[i],
            marker="o",
            markersize=6,
            color=BLUE if stands else "white",
            markeredgecolor=BLUE if stands else VERMILION,
        )
        align, aside = _beside(feet, i)
        axes.annotate(
            leg.upper(),
            feet[i],
            # Outside the polygon; from a foot that is passed at this instant to the other side.
            xytext=(aside, 10 * (float(np.sign(feet[i, 1])) or 1.0)),
            textcoords="offset points",
            ha=align,
            va="center",
            fontsize=7.5,
            color=INK if stands else QUIET,
        )
    x, y = stretch.mass_centre[sample, :2]
    axes.plot(x, y, marker="o", markersize=7, color="white", markeredgecolor=INK)
    axes.plot(x, y, marker="+", markersize=7, color=INK, markeredgewidth=1.1)
    axes.set_title(
        f"{word} of support, t = {stretch.time[sample]:.2f} s\n"
        f"stability margin {number(1e3 * float(stretch.margin[sample]))} mm",
        color=QUIET,
    )
    reach = np.abs(stretch.feet[..., :2]).max(axis=(0, 1))
    axes.set_xlim(-reach[0] - 0.04, reach[0] + 0.04)
    axes.set_ylim(-reach[1] - 0.06, reach[1] + 0.06)


def _beside(feet: Array, i: int) -> tuple[Literal["left", "center", "right"], float]:
    """Alignment of a foot's name and its shift [points], away from a near foot of the same side."""
    same = (np.sign(feet[:, 1]) == np.sign(feet[i, 1])) & (np.arange(len(feet)) != i)
    away = feet[same, 0] - feet[i, 0]
    near = away[np.abs(away) < _NEAR]
    if near.size == 0:
        return "center", 0.0
    return ("right", 1.0) if near[np.argmin(np.abs(near))] >= 0 else ("left", -1.0)


def _footfall(axes: Axes, legs: Sequence[str], stretches: Sequence[GaitStretch]) -> None:
    for row, leg in enumerate(legs):
        for stretch in stretches:
            first, last = float(stretch.time[0]), float(stretch.time[-1])
            if leg in stretch.stance:
                axes.barh(row, last - first, left=first, height=0.62, color=BLUE)
            else:
                axes.plot([first, last], [row, row], color=VERMILION, linewidth=1.2)
    axes.set_yticks(range(len(legs)), [leg.upper() for leg in legs])
    axes.set_ylim(len(legs) - 0.4, -0.6)
    axes.set_xlim(float(stretches[0].time[0]), float(stretches[-1].time[-1]))
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("time [s]")
    axes.set_title("footfall: bar = foot on the ground", color=QUIET)
