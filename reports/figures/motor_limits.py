"""Where a motor works in the plane of speed and torque, and the limits of its data sheet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.energy.energy import rms_over_time
from reports.figures.style import BLUE, GREEN, INK, QUIET, house_style, key, new_figure
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
    *,
    title: str,
    subtitle: str = "",
) -> Figure:
    """Where each joint's motor works, and what voltage, current and speed allow.

    Args:
        series: At the motors' shafts, one cycle.
        motors: Of each joint of the series.
        joints: Those to draw, name to label of the panel.
    """
    count = -(-len(joints) // 3)
    figure = new_figure(1.7 + 2.15 * count, title, subtitle)
    panels = figure.subplots(count, 3, sharex=True, sharey=True, squeeze=False)
    for axes in panels.ravel()[len(joints) :]:
        axes.set_visible(False)
    rms = rms_over_time(series.time, series.torque)
    ends = np.zeros(2)
    for axes, (joint, label) in zip(panels.ravel(), joints.items(), strict=False):
        column = series.joints.index(joint)
        points = np.array([series.velocity[:, column] * _RPM / 1e3, series.torque[:, column]])
        axes.plot(*points, ".", color=BLUE, markersize=1.5)
        allowed = _limits(axes, motors[column], column)
        share = f" of {number(allowed)}" if np.isfinite(allowed) else ""
        axes.set_title(f"{label}\nrms {number(float(rms[column]))}{share}", fontsize=8)
        axes.set_xlabel("speed [1000 rpm]")
        axes.locator_params(nbins=4)
        axes.grid(False)
        reach = axes.dataLim.max[0], 1.1 * allowed if np.isfinite(allowed) else 0.0
        ends = np.max([ends, np.abs(points).max(axis=1), reach], axis=0)
    panels[0, 0].set_ylabel("motor torque [N·m]")
    panels[0, 0].set(xlim=1.1 * ends[0] * np.array([-1, 1]), ylim=1.1 * ends[1] * np.array([-1, 1]))
    key(figure, 2)
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
