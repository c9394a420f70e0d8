"""Lay figures out once and write them as SVG; the same figure gives the same bytes."""

from __future__ import annotations

import gc
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.atomic import replacing
from reports.figures.style import house_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Decimals of a line's data: below what any picture shows, above what rounding differs in.
_DECIMALS = 11
#: Of a panel's place, as a share of the figure: far below a pixel.
_PLACE_DECIMALS = 7


def arrange(figure: Figure) -> None:
    """Lay a figure out once and for all, so that no later drawing does it again."""
    engine = figure.get_layout_engine()
    if engine is None:
        return
    engine.execute(figure)
    figure.set_layout_engine("none")
    # The layout's solver orders its unknowns by address: last bits differ from run to run.
    for axes in figure.axes:
        x, y, width, height = np.round(axes.get_position(original=True).bounds, _PLACE_DECIMALS)
        axes.set_position((x, y, width, height), which="original")
        axes.set_in_layout(True)


def save_figure(figure: Figure, folder: Path, name: str) -> None:
    """Write `<name>.svg`, whole or not at all.

    Raises:
        OutputError: The folder cannot be written.
    """
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    for line in (line for axes in figure.axes for line in axes.lines):
        x, y = (np.asarray(values) for values in line.get_data(orig=False))
        if x.dtype.kind == y.dtype.kind == "f":  # last bits may differ from process to process
            line.set_data(np.round(x, _DECIMALS), np.round(y, _DECIMALS))
    with house_style(), replacing(folder / f"{name}.svg") as svg, svg.open("wb") as stream:
        arrange(figure)
        metadata = {"Date": None, "Creator": None}
        # Not `savefig`: it draws every figure once more than it is written.
        FigureCanvasSVG(figure).print_svg(stream, metadata=metadata)


def save_png(figure: Figure, path: Path) -> None:
    """Write a PNG at the style's 150 dots per inch, for a page that shows no SVG.

    Raises:
        OutputError: The folder cannot be written.
    """
    with house_style(), replacing(path) as png, png.open("wb") as stream:
        arrange(figure)
        canvas: Any = figure.canvas
        canvas.print_png(stream, metadata={"Software": None})


def save_figures(drawings: Mapping[str, Callable[[], Figure]], folder: Path) -> int:
    """Draw and save every figure; a terminal shows how many are drawn.

    In one process: a second one would load fonts and lay out their letters once more.

    Args:
        drawings: File name without ending to what makes the figure.

    Returns:
        How many figures.

    Raises:
        ReportError: A figure that cannot be drawn or saved.
    """
    from tqdm import tqdm

    gc.freeze()  # what is loaded by now stays: the collector need not search it again and again
    try:
        with house_style():  # once for all: entering it costs as much as a small drawing
            for name, draw in tqdm(drawings.items(), "figures", leave=False, disable=None):
                save_figure(draw(), folder, name)
    finally:
        gc.unfreeze()
    return len(drawings)
