"""The gait as a picture: foot paths, support polygons with the centre of mass, footfall."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from actuators.arrays import Array
from reports.figures.demand import Stretch
from reports.figures.style import BLUE, INK, QUIET, VERMILION, house_style, new_figure, note
from reports.typeset import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Support polygons that are drawn of a gait with many sets of feet.
_MOST = 6


@house_style()
def gait_figure(
    legs: Sequence[str], stretches: Sequence[Stretch], *, title: str, subtitle: str = ""
) -> Figure:
    """Foot paths from above, support polygons where the margin is least, footfall.

    Args:
        legs: All legs, in the order of the feet's arrays.
        stretches: One period.
    """
    instants = _least_stable(stretches)
    feet = np.concatenate([s.feet[..., :2].reshape(-1, 2) for s in stretches])
    reach = np.abs(feet).max(axis=0) * 1.25 + 1e-3
    tall = 1.75 * float(np.clip(reach[1] / reach[0], 0.4, 1.5))  # of a polygon's panel [in]
    rows, fall = -(-len(instants) // 3), 0.5 + 0.17 * len(legs)
    ratios = [1.4 * tall, *[tall + 0.3] * rows, fall]
    subtitle += "; polygons: feet on the ground and centre of mass where the margin is least"
    figure = new_figure(1.2 + sum(ratios), title, subtitle)
    grid = figure.add_gridspec(2 + rows, 3, height_ratios=ratios)
    paths = figure.add_subplot(grid[0, :])
    _from_above(paths, reach)
    paths.text(0, 0, "ahead \N{RIGHTWARDS ARROW}", ha="center", va="center", color=QUIET)
    for i, leg in enumerate(legs):
        for stretch in stretches:
            color, width = (BLUE, 4.0) if leg in stretch.stance else (VERMILION, 1.2)
            paths.plot(*stretch.feet[:, i, :2].T, color=color, linewidth=width, zorder=3)
        middle = np.concatenate([s.feet[:, i, :2] for s in stretches]).mean(axis=0)
        note(paths, leg.upper(), middle, (0, 11 if middle[1] >= 0 else -11), va="center")
    paths.set_title("foot paths from above, in the body's frame", color=QUIET)
    for k, (stretch, sample) in enumerate(instants):
        axes = figure.add_subplot(grid[1 + k // 3, k % 3])
        _from_above(axes, reach)
        _polygon(axes, legs, stretch, sample)
    _footfall(figure.add_subplot(grid[-1, :]), legs, stretches)
    return figure


def _least_stable(stretches: Sequence[Stretch]) -> list[tuple[Stretch, int]]:
    """The least stable sample of every set of standing feet, the worst of many, in time's order."""
    least: dict[frozenset[str], tuple[float, Stretch, int]] = {}
    for stretch in stretches:
        key, sample = frozenset(stretch.stance), int(stretch.margin.argmin())
        margin = float(stretch.margin[sample])
        if key not in least or margin < least[key][0]:
            least[key] = (margin, stretch, sample)
    chosen = sorted(least.values(), key=lambda one: one[0])[:_MOST]
    return sorted(((s, k) for _, s, k in chosen), key=lambda one: float(one[0].time[one[1]]))


def _polygon(axes: Axes, legs: Sequence[str], stretch: Stretch, sample: int) -> None:
    """The support polygon at an instant, and the centre of mass over it."""
    stance = [i for i, leg in enumerate(legs) if leg in stretch.stance]
    feet = stretch.feet[sample, :, :2]
    around = feet[stance] - feet[stance].mean(axis=0)
    ring = feet[stance][np.argsort(np.arctan2(around[:, 1], around[:, 0]))]
    axes.fill(*ring.T, facecolor=(BLUE, 0.22), edgecolor=BLUE, linewidth=1.2)
    for i, foot in enumerate(feet):
        fill, edge = (BLUE, BLUE) if i in stance else ("white", VERMILION)
        axes.plot(*foot, "o", markersize=5, color=fill, markeredgecolor=edge)
    for marker, color in (("o", "white"), ("+", INK)):
        axes.plot(*stretch.mass_centre[sample, :2], marker, markersize=7, color=color, mec=INK)
    margin = number(1e3 * float(stretch.margin[sample]))
    words = f"{stretch.time[sample]:.2f} s: {margin} mm"
    axes.set_title(words, color=QUIET, fontsize=8, loc="center")


def _footfall(axes: Axes, legs: Sequence[str], stretches: Sequence[Stretch]) -> None:
    """When each foot stands."""
    for row, leg in enumerate(legs):
        for stretch in stretches:
            first, last = float(stretch.time[0]), float(stretch.time[-1])
            if leg in stretch.stance:
                axes.barh(row, last - first, left=first, height=0.62, color=BLUE)
            else:
                axes.plot([first, last], [row, row], color=VERMILION, linewidth=1.2)
    axes.grid(False)
    axes.set_yticks(range(len(legs)), [leg.upper() for leg in legs])
    axes.set_ylim(len(legs) - 0.4, -0.6)
    axes.set_xlim(float(stretches[0].time[0]), float(stretches[-1].time[-1]))
    axes.set_xlabel("time [s]")
    axes.set_title("blue: foot on the ground; orange: in the air", color=QUIET)


def _from_above(axes: Axes, reach: Array) -> None:
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_xlim(-reach[0], reach[0])
    axes.set_ylim(-reach[1], reach[1])
