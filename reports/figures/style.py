"""The common look of all figures: `legwatt.mplstyle`, and colours that every eye distinguishes.

Matplotlib's object interface, no pyplot, no global state; imported with the first figure drawn.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from actuators.checked import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: File name without ending to what makes the figure; nothing is drawn before it is called.
Drawings: TypeAlias = dict[str, Callable[[], "Figure"]]
# Okabe and Ito (2008), Color Universal Design.
ORANGE, SKY, GREEN = "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
INK, QUIET, FAINT, SHADE = "#1a1a1a", "#5f6368", "#c8ccd0", "#e9ecf0"
#: Colours in order, for things without a colour of their own.
CYCLE = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, QUIET)
#: Of all figures alike [in]: letters can be read on a telephone and are not huge on a wide page.
WIDTH = 4.6


@contextmanager
def house_style() -> Iterator[None]:
    """Matplotlib's defaults with our changes, for a block or, as a decorator, for a function."""
    from matplotlib import style

    with style.context(Path(__file__).with_name("legwatt.mplstyle"), after_reset=True):
        yield


def new_figure(height: float, title: str = "", subtitle: str = "") -> Figure:
    """An empty figure of so many inches and its heading: a bold title, quiet lines below it."""
    from matplotlib.figure import Figure

    first, second = textwrap.wrap(title, 46), textwrap.wrap(subtitle, 68)
    height += 0.2 * max(len(first) - 1, 0) + 0.16 * max(len(second) - 1, 0)
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    # The layout keeps room for the title; the quiet lines lie on its empty ones.
    empty = int(np.ceil(0.8 * len(second) + 0.1)) if second else 0
    look: dict[str, Any] = {"x": 0.015, "ha": "left", "linespacing": 1.25}
    figure.suptitle("\n".join(first) + "\n" * empty, fontsize=11, fontweight="bold", **look)
    below = 1 - (0.06 + 0.2 * len(first)) / height
    figure.text(y=below, s="\n".join(second), va="top", color=QUIET, fontsize=8.5, **look)
    return figure


def note(axes: Axes, text: str, at: Any, shift: tuple[float, float], **look: Any) -> None:
    """A text so many points from a place in data coordinates, legible over what lies behind."""
    white = {"facecolor": "white", "edgecolor": "none", "pad": 0.6}
    standard: dict[str, Any] = {"ha": "center", "fontsize": 8, "bbox": white, "zorder": 8}
    axes.annotate(text, at, xytext=shift, textcoords="offset points", **standard | look)


def key(figure: Figure, columns: int) -> Any:
    """One key for all panels below them, each name once; returned."""
    named: dict[str, Any] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(label, handle)
    return figure.legend(
        [*named.values()], [*named], loc="outside lower center", ncols=min(columns, len(named))
    )


def zero_line(axes: Axes) -> None:
    """A line at zero where signs matter."""
    axes.axhline(0.0, color=QUIET, linewidth=0.8, zorder=1)


def arrange(figure: Figure) -> None:
    """Lay a figure out for good; the layout's solver leaves other last bits in every process."""
    engine = figure.get_layout_engine()
    if engine is None:
        return
    engine.execute(figure)
    figure.set_layout_engine("none")
    for axes in figure.axes:
        place = np.round(axes.get_position(original=True).bounds, 7)
        axes.set_position(tuple(place), which="original")
        for line in axes.lines:
            line.set_data(*(np.round(np.asarray(x), 11) for x in line.get_data(orig=False)))


def save_figure(figure: Figure, folder: Path, name: str) -> None:
    """Write `<name>.svg`, whole or not at all; the same figure gives the same bytes.

    Raises:
        LegwattError: The folder cannot be written.
    """
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    with house_style(), replacing(folder / f"{name}.svg") as svg:
        arrange(figure)
        # Not `savefig`: it draws every figure once more than it is written.
        FigureCanvasSVG(figure).print_svg(svg, metadata={"Date": None, "Creator": None})


def save_figures(drawings: Drawings, folder: Path) -> None:
    """Draw and save figures by their names; a terminal shows how far it is."""
    from tqdm import tqdm

    for name, draw in tqdm(drawings.items(), "figures", leave=False, disable=None):
        save_figure(draw(), folder, name)
