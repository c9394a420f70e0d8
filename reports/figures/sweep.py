"""A sweep's power over the first number that is varied."""

from __future__ import annotations

from typing import TYPE_CHECKING

from reports.figures.style import CYCLE, horizontal_grid, house_style, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


@house_style()
def sweep_figure(rows: DataFrame, axis: str) -> Figure:
    """Mean power by actuator; shaded from the least to the greatest over what else is varied.

    Args:
        rows: Of the cases that walk, as `pipeline/columns.csv` has the table ``sweep``.
        axis: The column that is drawn along.
    """
    words = axis.replace("_", " ")
    figure = new_figure(3.6, f"Mean power over {words}", "cases that walk")
    axes = figure.subplots()
    for (name, own), color in zip(rows.groupby("alternative", sort=False), CYCLE, strict=False):
        power = own.groupby(axis, sort=not isinstance(own[axis].iloc[0], str))["average_power_W"]
        middle, low, high = power.median(), power.min(), power.max()
        axes.plot(middle.index, middle, "o-", color=color, markersize=3, label=str(name))
        axes.fill_between(middle.index, low, high, color=color, alpha=0.15, linewidth=0)
    axes.set_xlabel(words)
    axes.set_ylabel("mean power [W]")
    horizontal_grid(axes)
    figure.legend(loc="outside lower center", ncols=4)
    return figure
