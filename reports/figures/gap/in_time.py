"""The gap in time: measured against predicted, before and after, with what is left below."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.arrays import Array, Mask
from pipeline.logs.signals.grid import runs_of
from reports.figures.style import (
    BLUE,
    ORANGE,
    QUIET,
    SHADE,
    YELLOW,
    house_style,
    new_figure,
    number,
    zero_line,
)
from reports.typeset import unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PALE = "#b4bac1"
#: More points than a picture can show.
_MOST_POINTS = 2500


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
    traces: Sequence[GapTrace], *, title: str, subtitle: str = "", channel: str = "effort"
) -> Figure:
    """Draw joints side by side: above the channel, below what is left of it."""
    figure = new_figure(5.2, title, subtitle)
    axes = figure.subplots(2, len(traces), sharex="col", squeeze=False, height_ratios=(1.0, 1.0))
    for k, trace in enumerate(traces):
        _trace(axes[0, k], axes[1, k], _thinned(trace), channel, first=k == 0)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure


def _thinned(trace: GapTrace) -> GapTrace:
    every = max(1, int(np.ceil(trace.time.size / _MOST_POINTS)))
    arrays: dict[str, Any] = {
        name: value[::every] for name, value in vars(trace).items() if isinstance(value, np.ndarray)
    }
    return replace(trace, **arrays)


def _trace(top: Axes, bottom: Axes, trace: GapTrace, channel: str, *, first: bool) -> None:
    t = trace.time
    compared = np.where(trace.compared, trace.measured, np.nan)
    # Wide, so that it stays in view below the predictions, compared or not.
    top.plot(t, trace.measured, color=_PALE, linewidth=3.2, label="measured, not compared")
    top.plot(t, compared, color=QUIET, linewidth=3.2, label="measured, compared")
    top.plot(t, trace.before, color=ORANGE, linewidth=1.1, label="without the effects")
    top.plot(t, trace.after, color=BLUE, linewidth=1.1, label="with them")
    top.set_title(trace.joint)
    bottom.axhspan(-2 * trace.noise_floor, 2 * trace.noise_floor, color=SHADE, zorder=0)
    zero_line(bottom)
    left_before, left_after = compared - trace.before, compared - trace.after
    bottom.plot(t, left_before, color=ORANGE, linewidth=1.0)
    bottom.plot(t, left_after, color=BLUE, linewidth=1.0)
    kept, where = np.ones(t.size, dtype=np.bool_), ""
    if trace.held_out is not None and np.isfinite(left_after[trace.held_out]).any():
        kept, where = trace.held_out, "held out: "
        for start, stop in np.column_stack(runs_of(kept)).tolist():
            for ax in (top, bottom):
                ax.axvspan(t[start], t[stop - 1], color=YELLOW, alpha=0.18, linewidth=0, zorder=0)
    rms = [float(np.sqrt(np.nanmean(x[kept] ** 2))) for x in (left_before, left_after)]
    bottom.set_title(
        f"{where}gap {number(rms[0])} without, {number(rms[1])} with",
        fontsize=8,
        color=QUIET,
    )
    bottom.set_xlim(t[0], t[-1])
    bottom.set_xlabel("time [s]")
    if first:
        top.set_ylabel(f"{channel} [{unit_text(trace.unit)}]")
        bottom.set_ylabel(f"measured minus predicted [{unit_text(trace.unit)}]")
