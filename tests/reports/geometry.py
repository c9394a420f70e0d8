"""What lies on what in a figure, measured and not compared with a picture."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from reports.figures.save import arrange
from reports.figures.style import house_style

#: Text and line may come as near as this; a letter's box has that much air [px at 150 dpi].
AIR = 2.0
#: Width of a picture on a page that is 1280 px wide.
PAGE = 1180.0


@lru_cache(maxsize=1)  # what is asked of one figure measures it once
def texts(figure: Figure) -> list[tuple[Text, Bbox]]:
    """Every text that is drawn, with its box [px]."""
    with house_style():
        arrange(figure)
        figure.draw_without_rendering()
        renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
        hidden = {id(label) for axes in figure.axes for label in _undrawn(axes)}
        return [
            (text, _box(text, Text.get_window_extent(text, renderer)))
            for text in figure.findobj(Text)
            if text.get_visible() and text.get_text().strip() and id(text) not in hidden
        ]


def _undrawn(axes: Axes) -> Iterator[Text]:
    """Labels of ticks outside the limits, or of axes that are off, exist and are not drawn."""
    for axis in (axes.xaxis, axes.yaxis):
        low, high = sorted(axis.get_view_interval())
        air = 1e-6 * (high - low)
        for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
            if not (axes.axison and low - air <= tick.get_loc() <= high + air):
                yield from (tick.label1, tick.label2)


def _box(text: Text, box: Bbox) -> Bbox:
    """Without the empty lines at the end, which keep room for another text."""
    lines = text.get_text().split("\n")
    empty = len(lines) - len(text.get_text().rstrip("\n").split("\n"))
    low = box.y0 + box.height * empty / len(lines)
    return Bbox.from_extents(box.x0, low, box.x1, box.y1)


def outside(figure: Figure) -> list[str]:
    """Texts that are cut by the figure's edge."""
    edge = figure.bbox
    return [
        text.get_text()
        for text, box in texts(figure)
        if box.x0 < edge.x0 - 1 or box.x1 > edge.x1 + 1 or box.y0 < edge.y0 - 1 or box.y1 > edge.y1
    ]


def overlapping(figure: Figure) -> list[tuple[str, str]]:
    """Pairs of texts that lie on one another."""
    return [
        (a.get_text(), b.get_text())
        for (a, box), (b, other) in combinations(texts(figure), 2)
        if box.padded(-AIR).overlaps(other.padded(-AIR))
        and not (a.get_rotation() % 90 and b.get_rotation() % 90)  # slanted boxes are mostly air
    ]


def crossed(figure: Figure) -> list[str]:
    """Texts without a background of their own that a line, an edge or an arrow runs through."""
    every = texts(figure)
    drawn = [stroke for axes in figure.axes for stroke in _strokes(axes)]
    found = set()
    for text, box in every:
        if text.get_bbox_patch() is not None or text.get_rotation() % 90:
            continue
        inner = box.padded(-AIR)
        for owner, points, clip in drawn:
            seen = inner if clip is None else Bbox.intersection(inner, clip)
            if owner is not text and seen is not None and _runs_through(points, seen):
                found.add(text.get_text())
    return sorted(found)


def _strokes(axes: Axes) -> Iterator[tuple[Text | None, np.ndarray, Bbox | None]]:
    """Everything drawn with a pen: the text it belongs to, its points, what it is cut by [px]."""
    window = axes.get_window_extent().padded(1.0)
    grid = [g for axis in (axes.xaxis, axes.yaxis) for g in axis.get_gridlines()]
    for line in (*axes.lines, *(g for g in grid if axes.axison and g.get_visible())):
        if line.get_linestyle() not in ("None", "none", ""):
            points = line.get_transform().transform(line.get_xydata())
            yield None, points, window if line.get_clip_on() else None
    for patch in axes.patches:
        if patch.get_linewidth() > 0 and patch.get_edgecolor()[3] > 0:
            yield None, _outline(patch), window
    for text in axes.texts:
        arrow = getattr(text, "arrow_patch", None)
        if arrow is not None:
            yield text, _outline(arrow), None


def _outline(patch: Patch) -> np.ndarray:
    path = patch.get_path().transformed(patch.get_transform())
    pieces = path.to_polygons(closed_only=False)
    return np.concatenate([np.vstack([piece, [[np.nan, np.nan]]]) for piece in pieces])


def _runs_through(points: np.ndarray, box: Bbox) -> bool:
    """Whether a broken line enters a box (Liang and Barsky, for all its pieces)."""
    a, b = points[:-1], points[1:]
    good = np.isfinite(a).all(axis=1) & np.isfinite(b).all(axis=1)
    a, d = a[good], (b - a)[good]
    enter, leave = np.zeros(len(a)), np.ones(len(a))
    inside = np.ones(len(a), dtype=bool)
    for k, (low, high) in enumerate(((box.x0, box.x1), (box.y0, box.y1))):
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.stack([(low - a[:, k]) / d[:, k], (high - a[:, k]) / d[:, k]])
        still = d[:, k] == 0
        inside &= ~still | ((a[:, k] >= low) & (a[:, k] <= high))
        enter = np.where(still, enter, np.maximum(enter, t.min(axis=0)))
        leave = np.where(still, leave, np.minimum(leave, t.max(axis=0)))
    return bool((inside & (enter <= leave)).any())


def smallest_letters(figure: Figure) -> float:
    """Least size of type where the figure is as wide as a page of 1280 px [px]."""
    scale = PAGE / (72.0 * figure.get_size_inches()[0])
    return min(text.get_fontsize() * scale for text, _ in texts(figure))
