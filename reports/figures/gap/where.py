"""Where-map: size of the gap by joint and circumstance, in units of the noise floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from actuators.arrays import Array
from reports.figures.style import INK, QUIET, WIDTH, house_style, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage

#: Heights and widths of what surrounds the cells [in].
_HEAD, _TITLE, _BANDS, _BAR, _ROW = 0.5, 0.3, 0.62, 0.75, 0.235
#: A cell that holds a number of three signs, and one that is wide enough [in].
_NARROWEST, _WIDEST = 0.27, 0.62
_TICK = 0.16  # between two ticks of the scale of colours [in]
#: Between two groups, in cells.
_BETWEEN = 0.5
#: From white (noise) to dark (far above it), readable in grey.
_MAP = "YlOrBr"


@dataclass(frozen=True)
class WhereGroup:
    """One way of sorting the rows."""

    title: str  #: What they are sorted by.
    bands: tuple[str, ...]  #: Names of the bands.
    ratio: Array  #: Gap over noise floor, shape (J, len(bands)); NaN where there are no rows.


@house_style()
def where_map_figure(
    joints: Sequence[str], groups: Sequence[WhereGroup], *, title: str, subtitle: str = ""
) -> Figure:
    """Draw the map."""
    from matplotlib.colors import LogNorm

    names = 0.15 + 0.076 * max(len(joint) for joint in joints)
    room = WIDTH - names - _BAR
    lines = _lines(groups, room)
    widest = max(_columns(line) for line in lines)
    cell = min(room / widest, _WIDEST)
    tall = _ROW * len(joints)
    height = _HEAD + len(lines) * (_TITLE + tall + _BANDS)
    figure = new_figure(height, title, subtitle, arranged=False)  # for cells of one size
    finite = np.concatenate([g.ratio[np.isfinite(g.ratio)] for g in groups])
    top = max(float(finite.max(initial=1.0)), 3.0)
    norm = LogNorm(1.0, top)
    for row, line in enumerate(lines):
        x, y = names, height - _HEAD - row * (_TITLE + tall + _BANDS) - _TITLE - tall
        for number, group in enumerate(line):
            wide = cell * len(group.bands)
            axes = figure.add_axes((x / WIDTH, y / height, wide / WIDTH, tall / height))
            image = _cells(axes, joints if number == 0 else (), group, norm)
            x += wide + _BETWEEN * cell
    at = names + widest * cell + 0.1
    bottom = height - _HEAD - _TITLE - tall
    side = figure.add_axes((at / WIDTH, bottom / height, 0.13 / WIDTH, tall / height))
    bar = figure.colorbar(image, cax=side)
    ticks: list[int] = []
    for tick in (1, 2, 3, 5, 10, 20, 50, 100, 200, 500, 1000):
        away = tall * (norm(tick) - norm(ticks[-1])) if ticks else 1.0
        if tick <= top and away > _TICK:
            ticks.append(tick)
    bar.set_ticks(ticks, labels=[str(t) for t in ticks])
    bar.ax.minorticks_off()
    bar.ax.tick_params(labelsize=8)
    bar.set_label("gap over noise floor", color=QUIET, fontsize=8.5)
    bar.outline.set_visible(False)
    return figure


def _columns(line: Sequence[WhereGroup]) -> float:
    """Width of a line of groups in cells."""
    return sum(len(g.bands) for g in line) + _BETWEEN * (len(line) - 1)


def _lines(groups: Sequence[WhereGroup], room: float) -> list[list[WhereGroup]]:
    """The groups in as few even lines as leave every cell wide enough for its number."""
    for count in range(1, len(groups) + 1):
        lines: list[list[WhereGroup]] = [[]]
        for group in groups:
            full = _columns([*lines[-1], group]) > _columns(groups) / count
            if lines[-1] and full and len(lines) < count:
                lines.append([])
            lines[-1].append(group)
        if room / max(_columns(line) for line in lines) >= _NARROWEST:
            break
    return lines


def _cells(axes: Axes, names: Sequence[str], group: WhereGroup, norm: LogNorm) -> AxesImage:
    """One group: coloured cells with their numbers; the joints' names where there are any."""
    shown = np.ma.masked_invalid(np.maximum(group.ratio, 1.0))
    image = axes.imshow(shown, cmap=_MAP, norm=norm, aspect="auto", interpolation="nearest")
    for j, k in np.argwhere(np.isfinite(group.ratio)):
        value = float(group.ratio[j, k])
        dark = norm(max(value, 1.0)) > 0.6
        text = f"{value:.1f}" if value < 9.95 else f"{value:.0f}"
        color = "white" if dark else INK
        axes.text(k, j, text, ha="center", va="center", fontsize=8, color=color)
    axes.set_title(group.title, fontsize=8.5, loc="left")
    axes.set_xticks(range(len(group.bands)), group.bands, rotation=35, ha="right", fontsize=8)
    for label in axes.get_xticklabels():
        label.set_rotation_mode("anchor")
    axes.set_yticks(range(len(group.ratio)), list(names) or [""] * len(group.ratio), fontsize=8.5)
    axes.tick_params(length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)
    return image
