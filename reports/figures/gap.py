"""Measured against predicted: over time, against a variable, by joint and circumstance."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError
from pipeline.identification.supply.account import Account
from pipeline.logs.grid import runs_of
from reports.figures.style import (
    BLUE,
    INK,
    ORANGE,
    QUIET,
    SHADE,
    YELLOW,
    house_style,
    new_figure,
    zero_line,
)
from reports.typeset import number, unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PALE = "#b4bac1"
#: More dots than a picture can show.
_MOST_DOTS = 3000
_BINS = 40
_FEWEST = 8  # rows in a bin that is drawn


@dataclass(frozen=True)
class GapTrace:
    """One joint over a stretch of time; all series at the same bandwidth."""

    joint: str  #: Name.
    time: Array  #: Shape (N,) [s].
    measured: Array  #: Shape (N,).
    compared: Mask  #: Rows that count for the gap, shape (N,).
    before: Array  #: Predicted by the model as it was, shape (N,).
    after: Array  #: Predicted with everything found, shape (N,).
    noise_floor: float  #: Standard deviation of the noise.
    unit: str  #: Of the channel.
    held_out: Mask | None = None  #: Rows of the test set, shape (N,), shaded; None for all of them.


@house_style()
def gap_time_figure(
    traces: Sequence[GapTrace], channel: str, *, title: str, subtitle: str = ""
) -> Figure:
    """Draw for each joint the channel, and below it what is left of it."""
    figure = new_figure(1.4 + 3.0 * len(traces), title, subtitle)
    axes = figure.subplots(2 * len(traces), 1, sharex=True, height_ratios=[1.3, 1] * len(traces))
    for k, trace in enumerate(traces):
        top, bottom = axes[2 * k : 2 * k + 2]
        t = trace.time
        compared = np.where(trace.compared, trace.measured, np.nan)
        # Wide, so that it stays in view below the predictions, compared or not.
        top.plot(t, trace.measured, color=_PALE, linewidth=3.2, label="measured, not compared")
        top.plot(t, compared, color=QUIET, linewidth=3.2, label="measured, compared")
        top.plot(t, trace.before, color=ORANGE, linewidth=1.1, label="without the effects")
        top.plot(t, trace.after, color=BLUE, linewidth=1.1, label="with them")
        top.set_title(trace.joint)
        _noise_band(bottom, trace.noise_floor)
        left_before, left_after = compared - trace.before, compared - trace.after
        bottom.plot(t, left_before, color=ORANGE, linewidth=1.0)
        bottom.plot(t, left_after, color=BLUE, linewidth=1.0)
        kept, where = np.ones(t.size, dtype=np.bool_), ""
        if trace.held_out is not None and np.isfinite(left_after[trace.held_out]).any():
            kept, where = trace.held_out, "test: "
            _shade((top, bottom), t, kept)
        rms = [number(float(np.sqrt(np.nanmean(x[kept] ** 2)))) for x in (left_before, left_after)]
        bottom.set_title(f"{where}gap {rms[0]} without, {rms[1]} with", fontsize=8, color=QUIET)
        bottom.set_xlim(t[0], t[-1])
        top.set_ylabel(f"{channel} [{unit_text(trace.unit)}]")
        bottom.set_ylabel("left of it")
    axes[-1].set_xlabel("time [s]")
    figure.align_ylabels(list(axes))
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def _noise_band(axes: Axes, noise_floor: float) -> None:
    """Zero, and two standard deviations of the noise around it."""
    axes.axhspan(-2 * noise_floor, 2 * noise_floor, color=SHADE, zorder=0)
    zero_line(axes)


def _shade(panels: Iterable[Axes], time: Array, rows: Mask) -> None:
    """Mark the rows of the test set."""
    for start, stop in np.column_stack(runs_of(rows)).tolist():
        for axes in panels:
            ends = time[max(start - 1, 0)], time[stop - 1]
            axes.axvspan(*ends, color=YELLOW, alpha=0.18, linewidth=0, zorder=0)


@house_style()
def power_time_figure(balance: Account, *, title: str) -> Figure:
    """Draw measured, model's and explained power of the first log; below, what is left."""
    own = balance.rows.log == 0
    count = np.count_nonzero(own)
    subtitle = f"log '{balance.logs[0]}', {count} samples; shaded: test samples"
    figure = new_figure(4.0, title, subtitle)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
    t, measured, explained = balance.rows.end[own], balance.rows.power[own], balance.explained[own]
    model = balance.rows.predicted[own]
    top.plot(t, measured, color=_PALE, linewidth=3.2, label="measured at the supply")
    top.plot(t, model, color=ORANGE, linewidth=1.1, label="model's sum over the drives")
    top.plot(t, explained, color=BLUE, linewidth=1.1, label="with all terms found")
    top.set_ylabel("power [W]")
    top.set_ylim(bottom=min(0.0, float(np.min([measured, explained]))))
    zero_line(bottom)
    bottom.plot(t, measured - explained, color=BLUE, linewidth=1.0)
    bottom.set_ylabel("unexplained [W]")
    bottom.set_xlabel("time [s]")
    _shade((top, bottom), t, balance.proves[own])
    figure.legend(*top.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


@house_style()
def gap_signature_figure(
    variable: str,
    x: Array,
    gaps: tuple[Array, Array],
    noise_floor: float,
    unit: str,
    *,
    title: str,
    subtitle: str = "",
) -> Figure:
    """Draw a joint's gap without (left) and with the effect (right), on one scale.

    Args:
        variable: Name with unit, for the axis.
        x: Of the variable, shape (N,).
        gaps: Measured minus predicted without the effect, and with it, each shape (N,).
        noise_floor: Standard deviation of the noise.

    Raises:
        LegwattError: No rows.
    """
    both = np.stack(gaps)
    keep = np.isfinite(x) & np.isfinite(both).all(axis=0)
    if not keep.any():
        raise LegwattError(f"signature against {variable}: no rows; give at least 1")
    x, both = x[keep], both[:, keep]
    every = max(1, int(np.ceil(x.size / _MOST_DOTS)))
    figure = new_figure(3.3, title, subtitle)
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, y, part, color in zip(panels, both, ("without", "with"), (ORANGE, BLUE), strict=True):
        _noise_band(axes, noise_floor)
        axes.plot(x[::every], y[::every], ".", color=color, ms=2.0, alpha=0.45, rasterized=True)
        axes.plot(*binned(x, y), color=INK, linewidth=1.6)
        axes.set_title(f"{part} the effect", color=QUIET, fontsize=9)
        axes.set_xlabel(variable)
    limit = 1.1 * float(np.quantile(np.abs(both), 0.998))
    panels[0].set_ylim(-limit, limit)
    panels[0].set_ylabel(f"measured minus predicted [{unit_text(unit)}]")
    return figure


def binned(x: Array, y: Array) -> tuple[Array, Array]:
    """Mean of y by bins of x; NaN, a break in the line, where a bin is nearly empty."""
    low, high = np.quantile(x, [0.002, 0.998])
    if high <= low:
        return np.array([float(low)]), np.array([float(y.mean())])
    edges = np.linspace(low, high, _BINS + 1)
    index = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, _BINS - 1)
    count = np.bincount(index, minlength=_BINS)
    total = np.bincount(index, weights=y, minlength=_BINS)
    mean = np.where(count >= _FEWEST, total / np.maximum(count, 1), np.nan)
    return 0.5 * (edges[1:] + edges[:-1]), mean


@dataclass(frozen=True)
class WhereGroup:
    """One way of sorting the rows."""

    title: str  #: What they are sorted by.
    bands: tuple[str, ...]  #: Names of the bands.
    ratio: Array  #: Gap over noise floor, shape (J, len(bands)); NaN where there are no rows.


#: More joints than this leave no room for numbers.
_NUMBERS = 20


@house_style()
def where_map_figure(
    joints: Sequence[str], groups: Sequence[WhereGroup], *, title: str, subtitle: str = ""
) -> Figure:
    """Size of the gap in units of the noise floor: a column for each joint, a row for each band."""
    from matplotlib.colors import LogNorm

    ratio = np.concatenate([g.ratio for g in groups], axis=1).T
    names = [
        f"{g.title}: {band}" if len(g.bands) > 1 else g.title for g in groups for band in g.bands
    ]
    longest = max(len(joint) for joint in joints)
    figure = new_figure(1.5 + 0.075 * longest + 0.2 * len(names), title, subtitle)
    axes = figure.subplots()
    top = max(float(ratio[np.isfinite(ratio)].max(initial=1.0)), 3.0)
    norm = LogNorm(1.0, top)
    # From white (noise) to dark (far above it), readable in grey.
    shown = np.ma.masked_invalid(np.maximum(ratio, 1.0))
    image = axes.imshow(shown, cmap="YlOrBr", norm=norm, aspect="auto", interpolation="nearest")
    for row, column in np.argwhere(np.isfinite(ratio)) if len(joints) <= _NUMBERS else ():
        value = float(ratio[row, column])
        text = f"{value:.1f}" if value < 9.95 else f"{value:.0f}"
        size = 7.5 if len(joints) <= 12 else 7
        color = "white" if norm(max(value, 1.0)) > 0.6 else INK
        axes.text(column, row, text, ha="center", va="center", color=color, fontsize=size)
    for edge in np.cumsum([len(g.bands) for g in groups])[:-1]:
        axes.axhline(edge - 0.5, color="white", linewidth=3)
    axes.set_xticks(range(len(joints)), joints, rotation=90, fontsize=8)
    axes.set_yticks(range(len(names)), names, fontsize=8)
    axes.tick_params(length=0)
    axes.grid(False)
    axes.spines[:].set_visible(False)
    bar = figure.colorbar(image, location="bottom", shrink=0.6, aspect=40)
    ticks = [tick for tick in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000) if tick <= top]
    bar.set_ticks(ticks, labels=[str(tick) for tick in ticks])
    bar.ax.minorticks_off()
    bar.set_label("gap over noise floor", color=QUIET, fontsize=8.5)
    bar.outline.set_visible(False)
    return figure
