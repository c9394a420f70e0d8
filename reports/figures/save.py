"""Write a figure as PNG and SVG; the same figure gives the same bytes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from reports.atomic import replacing
from reports.errors import FigureError
from reports.figures.style import house_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Nothing that changes from run to run or from machine to machine.
_METADATA: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
}
DOTS_PER_INCH = 150
_PNG = {"compress_level": 4}  # half the time of the default, for a few per cent more bytes


#: Decimals of a line's data: below what any picture shows, above what rounding differs in.
_DECIMALS = 11
#: Of a panel's place, as a share of the figure: far below a pixel.
_PLACE_DECIMALS = 7


def _steady(figure: Figure) -> None:
    """Round lines' data, whose last bits may differ from process to process."""
    for axes in figure.axes:
        for line in axes.lines:
            x, y = (np.asarray(values) for values in line.get_data(orig=False))
            if x.dtype.kind == y.dtype.kind == "f":
                line.set_data(np.round(x, _DECIMALS), np.round(y, _DECIMALS))


def arrange(figure: Figure) -> None:
    """Lay a figure out once and for all, so that no later drawing does it again."""
    engine = figure.get_layout_engine()
    if engine is None:
        return
    engine.execute(figure)
    figure.set_layout_engine("none")
    # The layout's solver orders its unknowns by address: last bits differ from run to run.
    for axes in figure.axes:
        place = np.round(axes.get_position(original=True).bounds, _PLACE_DECIMALS)
        axes.set_position((place[0], place[1], place[2], place[3]), which="original")
        axes.set_in_layout(True)


def save_figure(
    figure: Figure, out_dir: Path, name: str, *, formats: Sequence[str] = ("png", "svg")
) -> list[Path]:
    """Write `<name>.png` (150 dots per inch) and `<name>.svg`, whole or not at all.

    Raises:
        FigureError: An unknown format.
        OutputError: The folder cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    unknown = [fmt for fmt in formats if fmt not in _METADATA]
    if unknown:
        raise FigureError(f"figure '{name}': format '{unknown[0]}' is unknown; use png or svg")
    targets = [out_dir / f"{name}.{fmt}" for fmt in formats]
    _steady(figure)
    with house_style(), replacing(*targets) as temporary:
        arrange(figure)
        for path, fmt in zip(temporary, formats, strict=True):
            figure.set_dpi(DOTS_PER_INCH)
            with path.open("wb") as stream:
                # Not `savefig`: it draws every figure once more than it is written.
                if fmt == "png":
                    FigureCanvasAgg(figure).print_png(
                        stream, metadata=_METADATA[fmt], pil_kwargs=_PNG
                    )
                else:
                    FigureCanvasSVG(figure).print_svg(stream, metadata=_METADATA[fmt])
    return targets
