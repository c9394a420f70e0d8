"""Where-map: size of the gap by joint and circumstance, in units of the noise floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from reports.errors import FigureError
from reports.figures.style import INK, QUIET, headline, new_figure, number, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
#: From white (noise) to dark (far above it), readable in grey.
_MAP = "YlOrBr"


@dataclass(frozen=True)
class WhereGroup:
    """One way of sorting the rows.

    Attributes:
        title: What they are sorted by.
        bands: Names of the bands.
        ratio: Gap over noise floor, shape (J, len(bands)); NaN where there are no rows.
    """

    title: str
    bands: tuple[str, ...]
    ratio: Array


@styled
def where_map_figure(
    joints: Sequence[str], groups: Sequence[WhereGroup], *, title: str, subtitle: str = ""
) -> Figure:
    """Draw the map.

    Args:
        joints: Rows, from the top.
        groups: Columns.
        title: Headline.
        subtitle: Second line.

    Raises:
        FigureError: No groups, or a group of another shape.
    """
    from matplotlib.colors import LogNorm

    for group in groups:
        if group.ratio.shape != (len(joints), len(group.bands)):
            raise FigureError(
                f"where-map: group '{group.title}' has shape {group.ratio.shape}; "
                f"{(len(joints), len(group.bands))} is expected"
            )
    if not groups:
        raise FigureError("where-map: no group; give at least 1")
    widths = [len(g.bands) for g in groups]
    figure = new_figure(
        max(6.5, 0.44 * sum(widths) + 0.2 * len(groups) + 2.4), 0.3 * len(joints) + 2.3
    )
    axes = figure.subplots(1, len(groups), sharey=True, width_ratios=widths, squeeze=False)[0]
    finite = np.concatenate([g.ratio[np.isfinite(g.ratio)] for g in groups])
    top = max(float(finite.max(initial=1.0)), 3.0)
    norm = LogNorm(1.0, top)
    image = None
    for ax, group in zip(axes, groups, strict=True):
        shown = np.ma.masked_invalid(np.maximum(group.ratio, 1.0))
        image = ax.imshow(shown, cmap=_MAP, norm=norm, aspect="auto", interpolation="nearest")
        for j, k in np.argwhere(np.isfinite(group.ratio)):
            value = float(group.ratio[j, k])
            dark = norm(max(value, 1.0)) > 0.6
            text = number(value, 2) if value < 100 else f"{value:.0f}"
            ax.text(
                k, j, text, ha="center", va="center", fontsize=6.5, color="white" if dark else INK
            )
        ax.set_title(group.title, fontsize=8.5)
        ax.set_xticks(range(len(group.bands)), group.bands, rotation=45, ha="right", fontsize=7.5)
        ax.set_yticks(range(len(joints)), list(joints), fontsize=7.5)
        ax.tick_params(length=0)
        for spine in ax.spines.values():
            spine.set_visible(False)
    assert image is not None
    bar = figure.colorbar(image, ax=list(axes), fraction=0.02, pad=0.01)
    ticks = [t for t in (1, 2, 3, 5, 10, 20, 50, 100, 200, 500, 1000) if t <= top]
    bar.set_ticks(ticks, labels=[str(t) for t in ticks])
    bar.ax.minorticks_off()
    bar.set_label("gap over noise floor", color=QUIET, fontsize=8)
    bar.outline.set_visible(False)
    headline(figure, title, subtitle)
    return figure
