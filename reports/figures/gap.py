"""Figures of `gap`: joints over time, and the supply's power."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from actuators.arrays import Array, Mask
from pipeline.logs.filters import runs_of
from pipeline.logs.log import TEST, Log
from pipeline.simulation.predict import Prediction
from reports.figures.style import (
    BLUE,
    ORANGE,
    QUIET,
    SHADE,
    YELLOW,
    house_style,
    new_figure,
    zero_line,
)
from reports.page import number, unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from pandas import DataFrame

_PALE = "#b4bac1"
#: A stretch of time that a picture can show [s].
_LONGEST = 8.0


@house_style()
def in_time_figure(
    measurements: Sequence[Log],
    predictions: tuple[Sequence[Prediction], Sequence[Prediction]],
    joints: Sequence[int],
    unit: str,
    *,
    title: str,
) -> Figure:
    """Joints over a stretch of test data: measured and predicted, below them the residual.

    Args:
        measurements: Logs.
        predictions: Of the model as it was and as written, one per log.
        joints: Columns to draw.
        unit: Of the compared channel.
    """
    log, rows = _stretch(measurements)
    m = measurements[log]
    before, after = (m.smooth(p[log].effort[..., 0])[rows] for p in predictions)
    t, measured, test = m.time[rows], m.effort[rows, :, 0], m.part[rows] == TEST
    compared = np.where(m.mask[rows], measured, np.nan)
    subtitle = (
        f"log '{m.name}', low-passed at {m.bandwidth:.3g} Hz; shaded: test data; grey band: "
        "noise, 2 sigma"
    )
    figure = new_figure(1.4 + 3.0 * len(joints), title, subtitle)
    axes = figure.subplots(2 * len(joints), 1, sharex=True, height_ratios=[1.3, 1] * len(joints))
    for (top, bottom), j in zip(np.reshape(axes, (-1, 2)), joints, strict=True):
        # Wide, so that it stays in view below the predictions, compared or not.
        top.plot(t, measured[:, j], color=_PALE, linewidth=3.2, label="measured, not compared")
        top.plot(t, compared[:, j], color=QUIET, linewidth=3.2, label="measured, compared")
        top.plot(t, before[:, j], color=ORANGE, linewidth=1.1, label="model before")
        top.plot(t, after[:, j], color=BLUE, linewidth=1.1, label="with the model file")
        top.set_title(m.joints[j])
        level = float(m.noise[j, 0])
        bottom.axhspan(-2 * level, 2 * level, color=SHADE, zorder=0)
        zero_line(bottom)
        rest = [compared[:, j] - x[:, j] for x in (before, after)]
        for left, color in zip(rest, (ORANGE, BLUE), strict=True):
            bottom.plot(t, left, color=color, linewidth=1.0)
        _shade((top, bottom), t, test)
        sizes = [np.sqrt(np.nanmean(x**2)) if np.isfinite(x).any() else np.nan for x in rest]
        words = f"residual, rms: {number(sizes[0])} before, {number(sizes[1])} with the model file"
        bottom.set_title(words, fontsize=8, color=QUIET)
        bottom.set_xlim(t[0], t[-1])
        top.set_ylabel(f"{m.channels[0]} [{unit_text(unit)}]")
        bottom.set_ylabel(f"residual [{unit_text(unit)}]")
    axes[-1].set_xlabel("time [s]")
    figure.align_ylabels(list(axes))
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def _stretch(measurements: Sequence[Log]) -> tuple[int, slice]:
    """Log and rows around the test block in which most rows of most joints count."""
    best, found = -1.0, (0, slice(0, len(measurements[0])))
    for k, m in enumerate(measurements):
        for start, stop in np.column_stack(runs_of(m.part == TEST)).tolist():
            count = float(m.mask[start:stop].sum())
            if count > best:
                size = max(2, int(_LONGEST * m.rate))
                first = max(0, min((start + stop - size) // 2, len(m) - size))
                best, found = count, (k, slice(first, min(first + size, len(m))))
    return found


def _shade(panels: Iterable[Axes], time: Array, rows: Mask) -> None:
    """Mark the rows of the test set."""
    for start, stop in np.column_stack(runs_of(rows)).tolist():
        for axes in panels:
            ends = time[max(start - 1, 0)], time[stop - 1]
            axes.axvspan(*ends, color=YELLOW, alpha=0.18, linewidth=0, zorder=0)


@house_style()
def power_time_figure(samples: DataFrame, *, title: str) -> Figure:
    """Draw measured, model's and explained power of the first log; below, what is left."""
    own = samples[samples["log"] == samples["log"].iloc[0]]
    t = own["end_s"].to_numpy()
    subtitle = f"log '{own['log'].iloc[0]}', {t.size} samples; shaded: test samples"
    figure = new_figure(4.0, title, subtitle)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
    top.plot(t, own["measured_W"], color=_PALE, linewidth=3.2, label="measured at the supply")
    top.plot(t, own["model_W"], color=ORANGE, linewidth=1.1, label="model's sum over the drives")
    top.plot(t, own["explained_W"], color=BLUE, linewidth=1.1, label="with all terms found")
    top.set_ylabel("power [W]")
    top.set_ylim(bottom=min(0.0, float(own[["measured_W", "explained_W"]].min().min())))
    zero_line(bottom)
    bottom.plot(t, own["measured_W"] - own["explained_W"], color=BLUE, linewidth=1.0)
    bottom.set_ylabel("unexplained [W]")
    bottom.set_xlabel("time [s]")
    _shade((top, bottom), t, own["test"].to_numpy())
    figure.legend(*top.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure
