"""The common look of all figures: colours that every eye distinguishes, direct labels, little ink.

Figures are made with Matplotlib's object interface; no pyplot, no global state. Matplotlib is
imported when the first figure is drawn, not with this module.
"""

from __future__ import annotations

import gc
import math
import textwrap
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.atomic import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito (2008), Color Universal Design.
ORANGE, SKY, GREEN = "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
INK, QUIET, FAINT, SHADE_DARK, SHADE = "#1a1a1a", "#5f6368", "#c8ccd0", "#dde1e6", "#eef1f4"

#: Of all figures alike [in]: letters can be read on a telephone and are not huge on a wide page.
WIDTH = 4.6

#: Colours in order, for things without a colour of their own.
CYCLE = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, QUIET)
#: Energy towards the joint, and energy that comes back.
FORWARD, REVERSE = BLUE, ORANGE

RC: dict[Any, Any] = {
    "font.family": ["DejaVu Sans"],
    "font.size": 9.0,
    "mathtext.fontset": "dejavusans",
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # where it would be put, without measuring what lies there at every draw
    "axes.labelsize": 9.0,
    "axes.labelcolor": INK,
    "axes.edgecolor": QUIET,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": False,
    "axes.axisbelow": True,
    "grid.color": "#e3e6e9",
    "grid.linewidth": 0.7,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "xtick.color": QUIET,
    "ytick.color": QUIET,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "text.color": INK,
    "lines.linewidth": 1.8,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "figure.dpi": 150.0,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.fonttype": "path",
    "svg.hashsalt": "legwatt",
}


@cache
def own_fonts() -> None:
    """Put the fonts that Matplotlib brings before all others of the same name.

    Matplotlib keeps a list of fonts in the user's cache, which every version and environment
    shares. One that was made where its own files could not be read lacks them for good: figures
    are then drawn with whatever the system calls by that name, and each font of formulas that is
    not there is complained of on the terminal.
    """
    import matplotlib
    from matplotlib import font_manager

    folder = Path(matplotlib.get_data_path(), "fonts", "ttf")
    brought = {str(path) for path in sorted(folder.glob("*.ttf"))}
    manager = font_manager.fontManager
    for path in sorted(brought - {font.fname for font in manager.ttflist}):
        manager.addfont(path)
    manager.ttflist.sort(key=lambda font: font.fname not in brought)


@contextmanager
def house_style() -> Iterator[None]:
    """Matplotlib's defaults with our changes, for a block or, as a decorator, for a function."""
    import matplotlib

    own_fonts()
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(RC)
        yield


def new_figure(height: float, title: str = "", subtitle: str = "") -> Figure:
    """An empty figure with an Agg canvas, a title flush left and quiet lines below it.

    Args:
        height: Without the title's and subtitle's lines beyond one each [in].
        title: Broken into lines where it is longer than the figure is wide.
        subtitle: Likewise.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    first, second = textwrap.wrap(title, 46), textwrap.wrap(subtitle, 68)
    height += 0.2 * max(len(first) - 1, 0) + 0.16 * max(len(second) - 1, 0)
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    FigureCanvasAgg(figure)
    # The layout keeps room for the title; the quiet lines lie on its empty ones.
    empty = math.ceil(0.16 * len(second) / 0.2 + 0.1) if second else 0
    look: dict[str, Any] = {"x": 0.015, "ha": "left", "linespacing": 1.25}
    figure.suptitle("\n".join(first) + "\n" * empty, fontsize=11, fontweight="bold", **look)
    below = 1 - (0.06 + 0.2 * len(first)) / height
    figure.text(y=below, s="\n".join(second), va="top", color=QUIET, fontsize=8.5, **look)
    return figure


def horizontal_grid(axes: Axes) -> None:
    """Faint horizontal lines, for reading values off a vertical scale."""
    axes.grid(True, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)


def note(
    axes: Axes, text: str, at: tuple[float, float], shift: tuple[float, float], **look: Any
) -> None:
    """A text so many points from a place in data coordinates."""
    axes.annotate(text, at, xytext=shift, textcoords="offset points", **look)


def on_white(pad: float) -> dict[str, Any]:
    """The box of a text that stays legible over what lies behind, so many points wider."""
    return {"facecolor": "white", "edgecolor": "none", "pad": pad}


def zero_line(axes: Axes) -> None:
    """A line at zero where signs matter."""
    axes.axhline(0.0, color=QUIET, linewidth=0.8, zorder=1)


def arrow(
    axes: Axes,
    tip: Any,
    tail: Any,
    color: str,
    *,
    head: tuple[float, float] = (0.22, 0.5),
    width: float = 1.5,
    zorder: float = 7,
) -> None:
    """An arrow from tail to tip in data coordinates, each of shape (2,).

    Args:
        head: Half its width, and its length, in tens of points.
        width: Of the line [points].
    """
    shape = f"-|>,head_width={head[0]:g},head_length={head[1]:g}"
    look = {"arrowstyle": shape, "linewidth": width, "color": color}
    axes.annotate("", tip, tail, arrowprops=look | {"shrinkA": 0, "shrinkB": 0}, zorder=zorder)


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
        LegwattError: The folder cannot be written.
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
        LegwattError: The folder cannot be written.
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
        LegwattError: A figure that cannot be drawn or saved.
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
