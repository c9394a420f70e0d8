"""Write a figure as PNG and SVG; the same figure gives the same bytes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from reports.atomic import replacing
from reports.errors import FigureError
from reports.figures.style import house_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Nothing that changes from run to run or from machine to machine.
_METADATA = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
}


#: Decimals of a line's data: below what any picture shows, above what rounding differs in.
_DECIMALS = 11


def _steady(figure: Figure) -> None:
    """Round lines' data, whose last bits may differ from process to process."""
    from matplotlib.lines import Line2D

    for line in figure.findobj(Line2D):
        x, y = (np.asarray(values) for values in line.get_data(orig=False))
        if x.dtype.kind == y.dtype.kind == "f":
            line.set_data(np.round(x, _DECIMALS), np.round(y, _DECIMALS))


def save_figure(
    figure: Figure, out_dir: Path, name: str, *, formats: Sequence[str] = ("png", "svg")
) -> list[Path]:
    """Write `<name>.png` (150 dots per inch) and `<name>.svg`, whole or not at all.

    Raises:
        FigureError: An unknown format.
        OutputError: The folder cannot be written.
    """
    unknown = [fmt for fmt in formats if fmt not in _METADATA]
    if unknown:
        raise FigureError(f"figure '{name}': format '{unknown[0]}' is unknown; use png or svg")
    targets = [out_dir / f"{name}.{fmt}" for fmt in formats]
    _steady(figure)
    with house_style(), replacing(*targets) as temporary:
        # Lay out once: the layout costs more than the drawing, and both formats share it.
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
        for path, fmt in zip(temporary, formats, strict=True):
            with path.open("wb") as stream:
                figure.savefig(stream, format=fmt, dpi=150, metadata=_METADATA[fmt])
    return targets
