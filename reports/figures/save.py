"""Write a figure as PNG and SVG; the same figure gives the same bytes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

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
    with house_style(), replacing(*targets) as temporary:
        # Lay out once: the layout costs more than the drawing, and both formats share it.
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
        for path, fmt in zip(temporary, formats, strict=True):
            with path.open("wb") as stream:
                figure.savefig(stream, format=fmt, dpi=150, metadata=_METADATA[fmt])
    return targets
