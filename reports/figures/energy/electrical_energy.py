"""Electrical energy of all alternatives side by side, split by joint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import shorten
from typing import TYPE_CHECKING

from actuators.arrays import Array
from reports.figures.style import (
    CYCLE,
    QUIET,
    WIDTH,
    house_style,
    name_rows,
    new_figure,
    number,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@house_style()
def electrical_energy_figure(
    joints: Sequence[str],
    alternatives: Mapping[str, Array],
    *,
    reference: str | None,
    title: str,
    subtitle: str = "",
    width: float = WIDTH,
) -> Figure:
    """Electrical energy of all alternatives, one stacked bar each, split by joint.

    Args:
        joints: Labels of the parts, J of them.
        alternatives: Name to energy per joint, shape (J,) [J].
        reference: The alternative to which the ratio at the end of a bar is; None for no ratio.
        width: [in]; names stand above their bars where it is less than usual.
    """
    totals = {name: float(a.sum()) for name, a in alternatives.items()}
    base = totals[reference] if reference is not None else 0.0
    widest = max(*totals.values(), 1e-9)
    narrow = width < WIDTH
    row_height, rest = (0.5, 1.35) if narrow else (0.62, 1.55)  # [in]
    figure = new_figure(row_height * len(alternatives) + rest, title, subtitle, width=width)
    axes = figure.subplots()
    thick, names = 0.45 if narrow else 0.62, []
    for row, (name, parts) in enumerate(alternatives.items()):
        left = 0.0
        for j, value in enumerate(parts):
            color = CYCLE[j % len(CYCLE)]
            axes.barh(row, value, left=left, height=thick, color=color, edgecolor="white")
            if value > (0.1 if narrow else 0.05) * widest:
                axes.text(
                    left + value / 2, row, number(value), ha="center", va="center", color="white"
                )
            left += value
        ratio = ""
        if name != reference and base > 0:
            ratio = (
                f"{', ' if narrow else '   '}{number(totals[name] / base)} \N{MULTIPLICATION SIGN}"
            )
        names.append(f"{shorten(name, 44)}: {number(left)} J{ratio}" if narrow else name)
        if not narrow:
            axes.text(left + 0.008 * widest, row, f"{number(left)} J{ratio}", va="center")
    _name_joints(axes, joints, 0.18 if narrow else 0.12)
    name_rows(axes, names, thick, above=narrow)
    axes.set_ylim(len(alternatives) - 0.5, -0.95)
    axes.set_xlim(0, (1.02 if narrow else 1.25) * widest)
    axes.set_xlabel("electrical energy per cycle [J]")
    if reference is not None and len(alternatives) > 1:
        apart = "\n" if narrow else "; "
        one = f"1 \N{MULTIPLICATION SIGN} is that of {shorten(reference, 44)}"
        axes.set_xlabel(f"{axes.get_xlabel()}{apart}{one}")
    return figure


def _name_joints(axes: Axes, joints: Sequence[str], apart: float) -> None:
    """Joint names in their colours above the first bar, spaced like the words they are."""
    for j, joint in enumerate(joints):
        axes.text(
            0.005 + min(apart, 0.98 / len(joints)) * j,
            1.0,
            joint,
            transform=axes.transAxes,
            color=CYCLE[j % len(CYCLE)],
            fontweight="bold",
            va="top",
        )
    axes.axvline(0, color=QUIET, linewidth=0.8)
