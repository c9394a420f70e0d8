"""Measured against predicted: over time, against a variable, by joint and circumstance."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.arrays import Array, Mask
from pipeline.errors import FigureError
from pipeline.identification.supply.account import Account
from pipeline.logs.signals.grid import runs_of
from reports.figures.style import (
    BLUE,
    INK,
    ORANGE,
    QUIET,
    SHADE,
    WIDTH,
    YELLOW,
    house_style,
    new_figure,
    zero_line,
)
from reports.typeset import number, unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage

_PALE = "#b4bac1"
#: More points than a picture can show as lines, and as dots.
_MOST_POINTS, _MOST_DOTS = 2500, 3000
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
    held_out: Mask | None = None  #: Held-out rows, shape (N,), shaded; None for all of them.


@house_style()
def gap_time_figure(
    traces: Sequence[GapTrace], channel: str, *, title: str, subtitle: str = ""
) -> Figure:
    """Draw joints side by side: above the channel, below what is left of it."""
    figure = new_figure(5.2, title, subtitle)
    axes = figure.subplots(2, len(traces), sharex="col", squeeze=False)
    for (top, bottom), trace in zip(axes.T, traces, strict=True):
        _trace(top, bottom, _thinned(trace))
    unit = unit_text(traces[0].unit)
    axes[0, 0].set_ylabel(f"{channel} [{unit}]")
    axes[1, 0].set_ylabel(f"measured minus predicted [{unit}]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def _thinned(trace: GapTrace) -> GapTrace:
    every = max(1, int(np.ceil(trace.time.size / _MOST_POINTS)))
    arrays: dict[str, Any] = {
        name: value[::every] for name, value in vars(trace).items() if isinstance(value, np.ndarray)
    }
    return replace(trace, **arrays)


def _trace(top: Axes, bottom: Axes, trace: GapTrace) -> None:
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
        kept, where = trace.held_out, "held out: "
        for start, stop in np.column_stack(runs_of(kept)).tolist():
            _shade((top, bottom), t[start], t[stop - 1])
    rms = [number(float(np.sqrt(np.nanmean(x[kept] ** 2)))) for x in (left_before, left_after)]
    bottom.set_title(f"{where}gap {rms[0]} without, {rms[1]} with", fontsize=8, color=QUIET)
    bottom.set_xlim(t[0], t[-1])
    bottom.set_xlabel("time [s]")


def _noise_band(axes: Axes, noise_floor: float) -> None:
    """Zero, and two standard deviations of the noise around it."""
    axes.axhspan(-2 * noise_floor, 2 * noise_floor, color=SHADE, zorder=0)
    zero_line(axes)


def _shade(panels: Iterable[Axes], start: float, stop: float) -> None:
    """Mark a stretch of held-out time."""
    for axes in panels:
        axes.axvspan(start, stop, color=YELLOW, alpha=0.18, linewidth=0, zorder=0)


@house_style()
def power_time_figure(balance: Account, *, title: str) -> Figure:
    """Draw measured, model's and explained power of the first log; below, what is left."""
    own = balance.rows.log == 0
    count = np.count_nonzero(own)
    subtitle = f"log '{balance.logs[0]}', {count} samples; shaded: held-out samples"
    figure = new_figure(4.8, title, subtitle)
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
    for start, stop in np.column_stack(runs_of(balance.proves[own])).tolist():
        _shade((top, bottom), t[max(start - 1, 0)], t[stop - 1])
    figure.legend(*top.get_legend_handles_labels(), loc="outside lower center", ncols=3)
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
        FigureError: No rows.
    """
    both = np.stack(gaps)
    keep = np.isfinite(x) & np.isfinite(both).all(axis=0)
    if not keep.any():
        raise FigureError(f"signature against {variable}: no rows; give at least 1")
    x, both = x[keep], both[:, keep]
    every = max(1, int(np.ceil(x.size / _MOST_DOTS)))
    figure = new_figure(4.2, title, subtitle)
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, y, part, color in zip(panels, both, ("without", "with"), (ORANGE, BLUE), strict=True):
        _noise_band(axes, noise_floor)
        dots: dict[str, Any] = {
            "marker": ".",
            "markersize": 2.0,
            "alpha": 0.45,
            "linestyle": "none",
        }
        axes.plot(x[::every], y[::every], color=color, rasterized=True, **dots)
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


#: Heights and widths of what surrounds the cells of the map [in].
_HEAD, _TITLE, _BANDS, _BAR, _ROW = 0.5, 0.3, 0.62, 0.75, 0.235
#: A cell that holds a number of three signs, and one that is wide enough [in].
_NARROWEST, _WIDEST = 0.27, 0.62
_TICK = 0.16  # between two ticks of the scale of colours [in]
#: Between two groups, in cells.
_BETWEEN = 0.5


@dataclass(frozen=True)
class WhereGroup:
    """One way of sorting the rows."""

    title: str  #: What they are sorted by.
    bands: tuple[str, ...]  #: Names of the bands.
    ratio: Array  #: Gap over noise floor, shape (J, len(bands)); NaN where there are no rows.


@house_style()
def where_map_figure(
    joints: Sequence[str], groups: Sequence[WhereGroup], *, title: str, subtitle: str = ""
) -> Figure:
    """Size of the gap in units of the noise floor."""
    from matplotlib.colors import LogNorm

    names = 0.15 + 0.076 * max(len(joint) for joint in joints)
    room = WIDTH - names - _BAR
    lines = _lines(groups, room)
    widest = max(_columns(line) for line in lines)
    cell = min(room / widest, _WIDEST)
    tall = _ROW * len(joints)
    height = _HEAD + len(lines) * (_TITLE + tall + _BANDS)
    figure = new_figure(height, title, subtitle, arranged=False)  # for cells of one size

    def at(x: float, row: int, width: float) -> Axes:
        y = height - _HEAD - row * (_TITLE + tall + _BANDS) - _TITLE - tall
        return figure.add_axes((x / WIDTH, y / height, width / WIDTH, tall / height))

    finite = np.concatenate([g.ratio[np.isfinite(g.ratio)] for g in groups])
    top = max(float(finite.max(initial=1.0)), 3.0)
    norm = LogNorm(1.0, top)
    for row, line in enumerate(lines):
        x = names
        for k, group in enumerate(line):
            wide = cell * len(group.bands)
            image = _cells(at(x, row, wide), joints if k == 0 else (), group, norm)
            x += wide + _BETWEEN * cell
    bar = figure.colorbar(image, cax=at(names + widest * cell + 0.1, 0, 0.13))
    ticks: list[int] = []
    for tick in (1, 2, 3, 5, 10, 20, 50, 100, 200, 500, 1000):
        away = tall * (norm(tick) - norm(ticks[-1])) if ticks else 1.0
        if tick <= top and away > _TICK:
            ticks.append(tick)
    bar.set_ticks(ticks, labels=[str(t) for t in ticks])
    bar.ax.minorticks_off()
    bar.ax.tick_params(labelsize=8)
    bar.set_label("gap over noise floor", color=QUIET, fontsize=8.5)
    bar.outline.set_visible(False)
    return figure


def _columns(line: Sequence[WhereGroup]) -> float:
    """Width of a line of groups in cells."""
    return sum(len(g.bands) for g in line) + _BETWEEN * (len(line) - 1)


def _lines(groups: Sequence[WhereGroup], room: float) -> list[list[WhereGroup]]:
    """The groups in as few even lines as leave every cell wide enough for its number."""
    for count in range(1, len(groups) + 1):
        lines: list[list[WhereGroup]] = [[]]
        for group in groups:
            full = _columns([*lines[-1], group]) > _columns(groups) / count
            if lines[-1] and full and len(lines) < count:
                lines.append([])
            lines[-1].append(group)
        if room / max(_columns(line) for line in lines) >= _NARROWEST:
            break
    return lines


def _cells(axes: Axes, names: Sequence[str], group: WhereGroup, norm: LogNorm) -> AxesImage:
    """One group: coloured cells with their numbers; the joints' names where there are any."""
    shown = np.ma.masked_invalid(np.maximum(group.ratio, 1.0))
    # From white (noise) to dark (far above it), readable in grey.
    image = axes.imshow(shown, cmap="YlOrBr", norm=norm, aspect="auto", interpolation="nearest")
    for j, k in np.argwhere(np.isfinite(group.ratio)):
        value = float(group.ratio[j, k])
        text = f"{value:.1f}" if value < 9.95 else f"{value:.0f}"
        color = "white" if norm(max(value, 1.0)) > 0.6 else INK
        axes.text(k, j, text, ha="center", va="center", fontsize=8, color=color)
    axes.set_title(group.title, fontsize=8.5, loc="left")
    axes.set_xticks(range(len(group.bands)), group.bands, rotation=35, ha="right", fontsize=8)
    for label in axes.get_xticklabels():
        label.set_rotation_mode("anchor")
    axes.set_yticks(range(len(group.ratio)), list(names) or [""] * len(group.ratio), fontsize=8.5)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    return image
