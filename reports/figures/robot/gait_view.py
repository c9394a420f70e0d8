"""The gait as a picture: foot paths, support polygons with the centre of mass, footfall."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from actuators.arrays import Array
from pipeline.errors import FigureError
from reports.figures.robot.robot_view import dimension
from reports.figures.style import (
    BLUE,
    FAINT,
    INK,
    QUIET,
    SHADE,
    VERMILION,
    house_style,
    new_figure,
    note,
)
from reports.figures.walk import Stretch
from reports.typeset import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Feet nearer than this share of the field of feet would have their names on one another.
_NEAR = 0.1
#: Instants of a support that are drawn, and how many of a gait with many sets of feet.
_THREE = ((0.0, "start"), (0.5, "middle"), (1.0, "end"))
_MOST = 6


@house_style()
def gait_figure(
    legs: Sequence[str],
    stretches: Sequence[Stretch],
    *,
    shown: str,
    body: Array,
    title: str,
    subtitle: str = "",
) -> Figure:
    """Foot paths from above and from the side, support polygons, footfall.

    Where at most two sets of feet take turns, the polygons are those at the start, the middle and
    the end of the shown leg's support; else every set's at its least stable instant.

    Args:
        legs: All legs, in the order of the feet's arrays.
        stretches: One period.
        shown: The leg whose path is shown from the side.
        body: Of the trunk as seen from above, an outline in the base frame, shape (P, 2) [m].

    Raises:
        FigureError: Unknown leg, or no stretch in which it stands and none in which it swings.
    """
    if shown not in legs:
        raise FigureError(f"leg '{shown}' is not among {', '.join(legs)}")
    standing = [s for s in stretches if shown in s.stance]
    if not standing or len(standing) == len(stretches):
        raise FigureError(f"leg '{shown}' must both stand and swing in the gait drawn")
    instants = _instants(stretches, standing[0])
    rows = -(-len(instants) // 3)
    figure = new_figure(5.7 + 2.65 * rows + 0.12 * max(0, len(legs) - 6), title, subtitle)
    ratios = [1.25, *[1.15] * rows, 0.95 + 0.05 * max(0, len(legs) - 6)]
    grid = figure.add_gridspec(2 + rows, 6, height_ratios=ratios)
    unit = _size(stretches)
    paths = figure.add_subplot(grid[0, :3])
    beside = figure.add_subplot(grid[0, 3:])
    _paths_from_above(paths, legs, stretches, body, unit)
    _path_from_the_side(beside, list(legs).index(shown), shown, stretches)
    for k, (stretch, sample, words) in enumerate(instants):
        column = 2 * (k % 3)
        axes = figure.add_subplot(grid[1 + k // 3, column : column + 2])
        _support(axes, legs, stretch, sample, words, body, unit)
    _footfall(figure.add_subplot(grid[-1, :]), legs, stretches)
    return figure


def _instants(stretches: Sequence[Stretch], first: Stretch) -> list[tuple[Stretch, int, str]]:
    """Stretch, sample and words of every support polygon to draw."""
    stances = {frozenset(stretch.stance) for stretch in stretches}
    if len(stances) <= 2:
        n = first.time.size - 1
        return [(first, round(share * n), f"{word} of support") for share, word in _THREE]
    # The least stable instant of every stance; a gait with many shows the most critical ones.
    least: dict[frozenset[str], tuple[Stretch, int, str]] = {}
    for stretch in stretches:
        key, sample = frozenset(stretch.stance), int(stretch.margin.argmin())
        if key not in least or stretch.margin[sample] < _margin(least[key]):
            least[key] = (stretch, sample, "least stable")
    chosen = sorted(least.values(), key=_margin)[:_MOST]
    return sorted(chosen, key=lambda one: float(one[0].time[one[1]]))


def _margin(instant: tuple[Stretch, int, str]) -> float:
    stretch, sample, _ = instant
    return float(stretch.margin[sample])


def _size(stretches: Sequence[Stretch]) -> float:
    """Longer side of the field of feet [m]."""
    feet = np.concatenate([s.feet[..., :2].reshape(-1, 2) for s in stretches])
    return max(float(np.ptp(feet, axis=0).max()), 1e-6)


def _body(axes: Axes, body: Array, unit: float) -> None:
    from matplotlib.patches import Polygon

    axes.add_patch(Polygon(body, facecolor=SHADE, edgecolor=FAINT))
    front = float(body[:, 0].max())
    middle = 0.5 * float(body[:, 1].min() + body[:, 1].max())
    ends = (front + 0.04 * unit, middle), (front - 0.13 * unit, middle)
    axes.annotate("", *ends, arrowprops={"arrowstyle": "-|>", "color": QUIET, "linewidth": 1.2})
    axes.set_aspect("equal")
    axes.set_axis_off()


def _paths_from_above(
    axes: Axes,
    legs: Sequence[str],
    stretches: Sequence[Stretch],
    body: Array,
    unit: float,
) -> None:
    _body(axes, body, unit)
    for i, leg in enumerate(legs):
        for stretch in stretches:
            x, y = stretch.feet[:, i, 0], stretch.feet[:, i, 1]
            if leg in stretch.stance:
                axes.plot(x, y, color=BLUE, linewidth=4)
            else:
                axes.plot(x, y, color=VERMILION, linewidth=1.2, zorder=3)
        path = np.concatenate([s.feet[:, i, :2] for s in stretches])
        side = float(np.sign(path[:, 1].mean())) or 1.0
        beyond = side * float((side * path[:, 1]).max()) + 0.065 * unit * side
        middle = float(path[:, 0].mean())
        axes.text(middle, beyond, leg.upper(), ha="center", va="center", fontweight="bold")
    axes.set_title("foot paths relative to the body, from above", color=QUIET)
    bold = "bold"
    axes.text(0, 0.04 * unit, "support", color=BLUE, ha="right", va="bottom", fontweight=bold)
    axes.text(0, -0.04 * unit, "transfer", color=VERMILION, ha="right", va="top", fontweight=bold)
    axes.margins(0.04, 0.12)


def _path_from_the_side(axes: Axes, index: int, leg: str, stretches: Sequence[Stretch]) -> None:
    """One foot's path in the vertical plane in which it moves on the ground."""
    every = np.concatenate([s.feet[:, index] for s in stretches])
    on_ground = np.concatenate([s.feet[:, index] for s in stretches if leg in s.stance])
    along, lowest = _direction(on_ground), float(every[:, 2].min())
    middle = on_ground[:, :2].mean(axis=0)
    path = np.column_stack([(every[:, :2] - middle) @ along, every[:, 2] - lowest])
    size = max(float(np.ptp(path, axis=0).max()), 1e-6)
    phases: dict[bool, tuple[Array, Array]] = {}
    start = 0
    for stretch in stretches:
        piece = path[start : start + stretch.time.size]
        start += stretch.time.size
        stands = leg in stretch.stance
        color = BLUE if stands else VERMILION
        axes.plot(*piece.T, color=color, linewidth=4 if stands else 1.6, zorder=3)
        k = len(piece) // 2
        before = phases.get(stands)
        if before is None or np.ptp(piece[:, 0]) > np.ptp(before[0][:, 0]):
            phases[stands] = piece, piece[k - max(1, k // 12)]
    for stands, (piece, tail) in phases.items():
        _phase_words(axes, piece[len(piece) // 2], tail, stands, size)
    ends = (on_ground[:, :2] - middle) @ along
    stroke = np.array([[ends.min(), 0.0], [ends.max(), 0.0]])
    length = 1e3 * float(np.ptp(ends))
    dimension(axes, stroke[0], stroke[1], (0, -0.19 * size), f"{length:.0f} mm")
    high, right = float(path[:, 1].max()), float(path[:, 0].max())
    base, top = np.array([right, 0.0]), np.array([right, high])
    dimension(axes, base, top, (0.11 * size, 0), f"{1e3 * high:.0f} mm")
    axes.set_title(f"path of foot {leg.upper()} relative to the body, from its side", color=QUIET)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_xlim(float(path[:, 0].min()) - 0.11 * size, right + 0.26 * size)
    axes.set_ylim(-0.32 * size, high + 0.19 * size)


def _direction(path: Array) -> Array:
    """Horizontal unit vector along which a path is longest, forward where that is to say."""
    centred = path[:, :2] - path[:, :2].mean(axis=0)
    along: Array = np.linalg.svd(centred, full_matrices=False)[2][0]
    if np.ptp(centred, axis=0).max() < 1e-9:
        along = np.array([1.0, 0.0])
    return along * (np.sign(along[np.abs(along).argmax()]) or 1.0)


def _phase_words(axes: Axes, at: Array, tail: Array, stands: bool, size: float) -> None:
    """An arrow along the path in one phase, and what the phase is."""
    color = BLUE if stands else VERMILION
    head = {"arrowstyle": "-|>,head_width=0.3,head_length=0.6", "color": color}
    axes.annotate("", tuple(at), tuple(tail), arrowprops=head, zorder=4)
    word, below, sign = ("support", "top", -1) if stands else ("transfer", "bottom", 1)
    look: dict[str, Any] = {"ha": "center", "va": below, "fontweight": "bold"}
    axes.text(at[0], at[1] + sign * 0.046 * size, word, color=color, **look)


def _support(
    axes: Axes,
    legs: Sequence[str],
    stretch: Stretch,
    sample: int,
    words: str,
    body: Array,
    unit: float,
) -> None:
    from matplotlib.patches import Polygon

    _body(axes, body, unit)
    stance = [i for i, leg in enumerate(legs) if leg in stretch.stance]
    feet = stretch.feet[sample, :, :2]
    around = feet[stance] - feet[stance].mean(axis=0)
    ring = feet[stance][np.argsort(np.arctan2(around[:, 1], around[:, 0]))]
    axes.add_patch(Polygon(ring, facecolor=BLUE, alpha=0.22, edgecolor="none"))
    axes.add_patch(Polygon(ring, fill=False, edgecolor=BLUE, linewidth=1.2))
    for i, leg in enumerate(legs):
        stands = i in stance
        fill, edge = (BLUE, BLUE) if stands else ("white", VERMILION)
        axes.plot(*feet[i], marker="o", markersize=6, color=fill, markeredgecolor=edge)
        align, aside = _beside(feet, i, unit)
        # Outside the polygon; from a foot that is passed at this instant to the other side.
        shift = (aside, 10 * (float(np.sign(feet[i, 1])) or 1.0))
        look: dict[str, Any] = {"ha": align, "va": "center", "fontsize": 7.5}
        note(axes, leg.upper(), feet[i], shift, color=INK if stands else QUIET, **look)
    x, y = stretch.mass_centre[sample, :2]
    axes.plot(x, y, marker="o", markersize=7, color="white", markeredgecolor=INK)
    axes.plot(x, y, marker="+", markersize=7, color=INK, markeredgewidth=1.1)
    axes.set_title(
        f"{words}, t = {stretch.time[sample]:.2f} s\n"
        f"stability margin {number(1e3 * float(stretch.margin[sample]))} mm",
        color=QUIET,
    )
    drawn = np.concatenate([np.abs(stretch.feet[..., :2]).reshape(-1, 2), np.abs(body)])
    reach = drawn.max(axis=0)
    axes.set_xlim(-reach[0] - 0.06 * unit, reach[0] + 0.06 * unit)
    axes.set_ylim(-reach[1] - 0.08 * unit, reach[1] + 0.08 * unit)


def _beside(feet: Array, i: int, unit: float) -> tuple[Literal["left", "center", "right"], float]:
    """Alignment of a foot's name and its shift [points], away from a near foot of the same side."""
    same = (np.sign(feet[:, 1]) == np.sign(feet[i, 1])) & (np.arange(len(feet)) != i)
    away = feet[same, 0] - feet[i, 0]
    near = away[np.abs(away) < _NEAR * unit]
    if near.size == 0:
        return "center", 0.0
    return ("right", 1.0) if near[np.argmin(np.abs(near))] >= 0 else ("left", -1.0)


def _footfall(axes: Axes, legs: Sequence[str], stretches: Sequence[Stretch]) -> None:
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
