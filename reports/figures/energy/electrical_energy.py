"""Electrical energy of all alternatives side by side, split by joint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from reports.errors import FigureError
from reports.figures.style import CYCLE, QUIET, headline, new_figure, number, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


@styled
def electrical_energy_figure(
    joints: Sequence[str],
    alternatives: Mapping[str, Array],
    *,
    reference: str | None,
    title: str,
    subtitle: str = "",
) -> Figure:
    """Electrical energy of all alternatives, one stacked bar each, split by joint.

    Args:
        joints: Labels of the parts, J of them.
        alternatives: Name to energy per joint, shape (J,) [J].
        reference: The alternative to which the ratio at the end of a bar is; None for no ratio.
        title: First line.
        subtitle: Second line.

    Raises:
        FigureError: Shapes that do not fit, nothing to draw, or no such reference.
    """
    if not alternatives or any(a.shape != (len(joints),) for a in alternatives.values()):
        raise FigureError(f"'{title}': every alternative needs {len(joints)} values")
    if reference is not None and reference not in alternatives:
        raise FigureError(f"'{title}': no alternative '{reference}' to compare with")
    totals = {name: float(a.sum()) for name, a in alternatives.items()}
    base = totals[reference] if reference is not None else 0.0
    widest = max(*totals.values(), 1e-9)
    figure = new_figure(0.62 * len(alternatives) + 1.55)
    headline(figure, title, subtitle)
    axes = figure.subplots()
    for row, (name, parts) in enumerate(alternatives.items()):
        left = 0.0
        for j, value in enumerate(parts):
            color = CYCLE[j % len(CYCLE)]
            axes.barh(row, value, left=left, height=0.62, color=color, edgecolor="white")
            if value > 0.05 * widest:
                axes.text(
                    left + value / 2, row, number(value), ha="center", va="center", color="white"
                )
            left += value
        ratio = ""
        if name != reference and base > 0:
            ratio = f"   {number(totals[name] / base)} \N{MULTIPLICATION SIGN} {reference}"
        axes.text(left + 0.008 * widest, row, f"{number(left)} J{ratio}", va="center")
    _name_joints(axes, joints)
    axes.set_yticks(range(len(alternatives)), list(alternatives))
    axes.set_ylim(len(alternatives) - 0.5, -0.95)
    axes.set_xlim(0, 1.25 * widest)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("electrical energy per cycle [J]")
    return figure


def _name_joints(axes: Axes, joints: Sequence[str]) -> None:
    """Joint names in their colours above the first bar, spaced like the words they are."""
    for j, joint in enumerate(joints):
        axes.text(
            0.005 + min(0.12, 0.98 / len(joints)) * j,
            1.0,
            joint,
            transform=axes.transAxes,
            color=CYCLE[j % len(CYCLE)],
            fontweight="bold",
            va="top",
        )
    axes.axvline(0, color=QUIET, linewidth=0.8)
