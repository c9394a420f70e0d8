"""Where a motor works in the plane of speed and torque, and the limits of its data sheet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.energy.limits import rms_over_time
from reports.figures.style import BLUE, GREEN, INK, QUIET, VERMILION, house_style, key, new_figure
from reports.typeset import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from actuators.shaft import DCMotor, ShaftSeries

_RPM = 60 / (2 * np.pi)


def _of_joint(value: Any, column: int) -> float:
    """A motor's number where joints may have one each."""
    values = np.ravel(value)
    return float(values[column if values.size > 1 else 0])


@house_style()
def motor_limits_figure(
    series: ShaftSeries,
    motors: Sequence[DCMotor],
    joints: Mapping[str, str],
    support: Sequence[tuple[float, float]],
    *,
    title: str,
    subtitle: str = "",
) -> Figure:
    """The path of each joint's motor, and what voltage, current and speed allow.

    Args:
        series: At the motors' shafts, one cycle.
        motors: Of each joint of the series.
        joints: Those to draw, name to label of the panel.
        support: Start and end of every stretch of time in which the joints' leg stands [s].
    """
    columns = [series.joints.index(joint) for joint in joints]
    count = -(-len(joints) // 3)
    figure = new_figure(1.7 + 2.15 * count, title, subtitle)
    panels = figure.subplots(count, 3, sharex=True, sharey=True, squeeze=False)
    for axes in panels.ravel()[len(joints) :]:
        axes.set_visible(False)
    panels[0, 0].set_ylabel("motor torque [N·m]")
    rms = rms_over_time(series.time, series.torque[:, columns])
    breaks = np.flatnonzero(np.diff(series.time) <= 0) + 1
    blocks = [b for b in np.split(np.arange(series.time.size), breaks) if b.size > 1]
    middles = [0.5 * float(series.time[b[0]] + series.time[b[-1]]) for b in blocks]
    stands = [any(start <= at <= end for start, end in support) for at in middles]
    ends = np.zeros(2)
    for axes, column, label, own in zip(
        panels.ravel(), columns, joints.values(), rms, strict=False
    ):
        points = series.velocity[:, column] * _RPM / 1e3, series.torque[:, column]
        for block, down in zip(blocks, stands, strict=True):
            look = (BLUE, "support") if down else (VERMILION, "transfer")
            axes.plot(points[0][block], points[1][block], color=look[0], lw=1.7, label=look[1])
        allowed = _limits(axes, motors[column], column)
        share = f" of {number(allowed)}" if np.isfinite(allowed) else ""
        axes.set_title(f"{label}\nrms {number(float(own))}{share}", fontsize=8)
        axes.set_xlabel("speed [1000 rpm]")
        axes.locator_params(nbins=4)
        axes.grid(False)
        seen = np.array([np.abs(points).max(axis=1), axes.dataLim.max])
        seen[1, 1] = 1.1 * allowed if np.isfinite(allowed) else 0.0
        ends = np.maximum(ends, seen.max(axis=0))
    panels[0, 0].set(xlim=1.1 * ends[0] * np.array([-1, 1]), ylim=1.1 * ends[1] * np.array([-1, 1]))
    key(figure, 3)
    return figure


def _limits(axes: Axes, motor: DCMotor, column: int) -> float:
    """Draw the borders of what a motor can do; its continuous torque [N*m]."""
    constant = _of_joint(motor.torque_constant, column)
    continuous, peak = motor.continuous_current * constant, motor.peak_current * constant
    edges: dict[str, Any] = {"color": INK, "linewidth": 1.1, "zorder": 1}
    if np.isfinite(continuous):
        words = f"continuous: {number(continuous)} N·m"
        axes.axhspan(-continuous, continuous, color=GREEN, alpha=0.12, lw=0, label=words)
    for sign in (-1, 1):
        if np.isfinite(motor.supply_voltage):
            torque = 2 * np.array([-continuous, continuous]) if np.isfinite(continuous) else [0, 0]
            drop = _of_joint(motor.resistance, column) * np.array(torque) / constant
            at = (sign * motor.supply_voltage - drop) / constant * _RPM / 1e3
            axes.plot(at, torque, label=f"supply: {number(motor.supply_voltage)} V", **edges)
        if np.isfinite(motor.max_speed):
            words = f"permitted: {number(motor.max_speed * _RPM, 4)} rpm"
            axes.axvline(sign * motor.max_speed * _RPM / 1e3, ls=":", label=words, **edges)
        if np.isfinite(peak):
            axes.axhline(sign * peak, ls="-.", label=f"peak: {number(peak, 4)} N·m", **edges)
    for line in (axes.axhline, axes.axvline):
        line(0, color=QUIET, linewidth=0.7, zorder=1)
    return float(continuous)
