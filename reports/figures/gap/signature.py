"""An effect's signature: the gap against the variable on which the effect depends."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from actuators.arrays import Array
from pipeline.errors import FigureError
from reports.figures.style import (
    BLUE,
    INK,
    ORANGE,
    QUIET,
    SHADE,
    house_style,
    new_figure,
    zero_line,
)
from reports.typeset import unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_POINTS = 3000
_BINS = 40
_FEWEST = 8  # rows in a bin that is drawn


@house_style()
def gap_signature_figure(
    variable: str,
    x: Array,
    gaps: tuple[Array, Array],
    noise_floor: float,
    unit: str,
    *,
    title: str,
    subtitle: str = "",
) -> Figure:
    """Draw a joint's gap without (left) and with the effect (right), on one scale.

    Args:
        variable: Name with unit, for the axis.
        x: Of the variable, shape (N,).
        gaps: Measured minus predicted without the effect, and with it, each shape (N,).
        noise_floor: Standard deviation of the noise.

    Raises:
        FigureError: No rows.
    """
    both = np.stack(gaps)
    keep = np.isfinite(x) & np.isfinite(both).all(axis=0)
    if not keep.any():
        raise FigureError(f"signature against {variable}: no rows; give at least 1")
    x, both = x[keep], both[:, keep]
    figure = new_figure(4.2, title, subtitle)
    axes = figure.subplots(1, 2, sharex=True, sharey=True)
    for ax, y, part, color in zip(axes, both, ("without", "with"), (ORANGE, BLUE), strict=True):
        _half(ax, x, y, noise_floor, color)
        ax.set_title(f"{part} the effect", color=QUIET, fontsize=9)
        ax.set_xlabel(variable)
    limit = 1.1 * float(np.quantile(np.abs(both), 0.998))
    axes[0].set_ylim(-limit, limit)
    axes[0].set_ylabel(f"measured minus predicted [{unit_text(unit)}]")
    return figure


def _half(ax: Axes, x: Array, y: Array, noise_floor: float, color: str) -> None:
    every = max(1, int(np.ceil(x.size / _MOST_POINTS)))
    ax.axhspan(-2 * noise_floor, 2 * noise_floor, color=SHADE, zorder=0)
    zero_line(ax)
    ax.plot(
        x[::every],
        y[::every],
        linestyle="none",
        marker=".",
        markersize=2.0,
        color=color,
        alpha=0.45,
        rasterized=True,
    )
    centre, mean = binned(x, y)
    ax.plot(centre, mean, color=INK, linewidth=1.6)


def binned(x: Array, y: Array, bins: int = _BINS) -> tuple[Array, Array]:
    """Mean of y by bins of x; NaN, a break in the line, where a bin is nearly empty."""
    low, high = np.quantile(x, [0.002, 0.998])
    if high <= low:
        return np.array([float(low)]), np.array([float(y.mean())])
    edges = np.linspace(low, high, bins + 1)
    index = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, bins - 1)
    count = np.bincount(index, minlength=bins)
    total = np.bincount(index, weights=y, minlength=bins)
    mean = np.where(count >= _FEWEST, total / np.maximum(count, 1), np.nan)
    return 0.5 * (edges[1:] + edges[:-1]), mean
