"""The gait as a picture: foot paths, support polygons with the centre of mass, footfall."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from actuators.arrays import Array
from actuators.errors import LegwattError
from reports.figures.demand import Stretch
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
from reports.typeset import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Support polygons that are drawn of a gait with many sets of feet.
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
    """Foot paths from above and from the side, support polygons when least stable, footfall.

    Args:
        legs: All legs, in the order of the feet's arrays.
        stretches: One period.
        shown: The leg whose path is shown from the side.
        body: Of the trunk as seen from above, an outline in the base frame, shape (P, 2) [m].

    Raises:
        LegwattError: Unknown leg, or no stretch in which it stands and none in which it swings.
    """
    if shown not in legs:
        raise LegwattError(f"leg '{shown}' is not among {', '.join(legs)}")
    standing = [s for s in stretches if shown in s.stance]
    if not standing or len(standing) == len(stretches):
        raise LegwattError(f"leg '{shown}' must both stand and swing in the gait drawn")
    instants = _least_stable(stretches)
    rows = -(-len(instants) // 3)
    feet = np.concatenate([s.feet[..., :2].reshape(-1, 2) for s in stretches])
    reach = np.abs(np.concatenate([feet, body])).max(axis=0) * 1.15 + 1e-3
    tall = 1.75 * float(np.clip(reach[1] / reach[0], 0.4, 1.5))  # of a polygon's panel [in]
    fall = 0.5 + 0.17 * len(legs)
    figure = new_figure(1.1 + 1.5 * tall + rows * (tall + 0.5) + fall, title, subtitle)
    ratios = [1.5 * tall, *[tall + 0.5] * rows, fall]
    grid = figure.add_gridspec(2 + rows, 6, height_ratios=ratios)
    paths = figure.add_subplot(grid[0, :3])
    _from_above(paths, body, reach)
    for i, leg in enumerate(legs):
        for stretch in stretches:
            color, width = (BLUE, 4.0) if leg in stretch.stance else (VERMILION, 1.2)
            paths.plot(*stretch.feet[:, i, :2].T, color=color, linewidth=width, zorder=3)
        middle = np.concatenate([s.feet[:, i, :2] for s in stretches]).mean(axis=0)
        note(paths, leg.upper(), middle, (0, 11 if middle[1] >= 0 else -11), va="center")
    paths.set_ylim(-1.35 * reach[1], 1.35 * reach[1])
    paths.set_title("foot paths from above", color=QUIET)
    _path_from_the_side(figure.add_subplot(grid[0, 3:]), [*legs].index(shown), shown, stretches)
    for k, (stretch, sample) in enumerate(instants):
        axes = figure.add_subplot(grid[1 + k // 3, 2 * (k % 3) : 2 * (k % 3) + 2])
        _from_above(axes, body, reach)
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
    text = f"least stable\nat {stretch.time[sample]:.2f} s\nmargin {margin} mm"
    axes.set_title(text, color=QUIET, fontsize=8, loc="center")


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


def _from_above(axes: Axes, body: Array, reach: Array) -> None:
    """The trunk from above, its front marked by a triangle."""
    axes.fill(*body.T, facecolor=SHADE, edgecolor=FAINT)
    axes.plot(body[:, 0].max(), body[:, 1].mean(), ">", color=QUIET, markersize=5, zorder=2)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_xlim(-reach[0], reach[0])
    axes.set_ylim(-reach[1], reach[1])


def _path_from_the_side(axes: Axes, index: int, leg: str, stretches: Sequence[Stretch]) -> None:
    """One foot's path in the vertical plane in which it moves on the ground."""
    every = np.concatenate([s.feet[:, index] for s in stretches])
    on_ground = np.concatenate([s.feet[:, index] for s in stretches if leg in s.stance])
    middle = on_ground[:, :2].mean(axis=0)
    centred = on_ground[:, :2] - middle
    along = np.linalg.svd(centred, full_matrices=False)[2][0]
    along *= np.sign(along[np.abs(along).argmax()])
    lowest = float(every[:, 2].min())
    for stretch in stretches:
        foot = stretch.feet[:, index]
        x, z = 1e3 * (foot[:, :2] - middle) @ along, 1e3 * (foot[:, 2] - lowest)
        color, width = (BLUE, 4.0) if leg in stretch.stance else (VERMILION, 1.5)
        axes.plot(x, z, color=color, linewidth=width, clip_on=False)
    stroke, height = float(np.ptp(centred @ along)), float(np.ptp(every[:, 2]))
    axes.set_title(
        f"foot {leg.upper()} from its side:\nstroke {1e3 * stroke:.0f} mm,\n"
        f"height {1e3 * height:.0f} mm",
        color=QUIET,
    )
    axes.set_xlabel("along its way [mm]")
    axes.set_ylabel("height [mm]")
    axes.margins(0.08, 0.15)
