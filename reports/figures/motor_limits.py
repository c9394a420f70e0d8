"""Where a motor works in the plane of speed and torque, and the limits of its data sheet."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.energy.limits import operating_region, rms_over_time
from reports.figures.style import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    QUIET,
    VERMILION,
    house_style,
    new_figure,
)
from reports.typeset import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from actuators.shaft import DCMotor, ShaftSeries

#: What the reader of the figure must know.
SUBTITLE = "one gait cycle of the motor; grey: out of its reach"
_RPM = 60 / (2 * np.pi)
_CONTINUOUS = "#dff3ec"


def _of_joint(value: Any, column: int) -> float:
    """A motor's number where joints may have one each."""
    values = np.ravel(value)
    return float(values[column if values.size > 1 else 0])


def common_scale(
    every: Iterable[tuple[ShaftSeries, Sequence[DCMotor]]], joints: Iterable[str]
) -> tuple[float, float]:
    """Half the ranges of speed [rad/s] and torque [N*m] in which several options compare.

    They hold every path, the edge of the region at no torque, and the continuous torque.

    Args:
        every: Series at the motors' shafts and the motor of each of its joints.
        joints: Those to draw.
    """
    shown = list(joints)
    speeds, torques = [1e-9], [1e-9]
    for series, motors in every:
        for column in (series.joints.index(joint) for joint in shown):
            motor, constant = motors[column], _of_joint(motors[column].torque_constant, column)
            speeds += [float(np.abs(series.velocity[:, column]).max())]
            speeds += [motor.max_speed, motor.supply_voltage / constant]
            torques += [float(np.abs(series.torque[:, column]).max())]
            torques += [1.1 * motor.continuous_current * constant]
    return 1.12 * max(filter(np.isfinite, speeds)), 1.12 * max(filter(np.isfinite, torques))


@house_style()
def motor_limits_figure(
    series: ShaftSeries,
    motors: Sequence[DCMotor],
    joints: Mapping[str, str],
    support: Sequence[tuple[float, float]],
    *,
    scale: tuple[float, float],
    title: str,
    subtitle: str = "",
) -> Figure:
    """The path of each joint's motor within what voltage, current and speed allow.

    Args:
        series: At the motors' shafts, one cycle.
        motors: Of each joint of the series.
        joints: Those to draw, name to label of the panel.
        support: Start and end of every stretch of time in which the joints' leg stands [s].
        scale: From `common_scale`.
    """
    columns = [series.joints.index(joint) for joint in joints]
    speed, strongest = scale
    count = -(-len(joints) // 3)
    figure = new_figure(1.7 + 2.15 * count, title, subtitle)
    panels = figure.subplots(count, 3, sharex=True, sharey=True, squeeze=False)
    for axes in panels.ravel()[len(joints) :]:
        axes.set_visible(False)
    for axes in panels[:, 0]:
        axes.set_ylabel("motor torque [N·m]")
    for axes in panels[-1]:
        axes.set_xlabel("speed [1000 rpm]")
    rms = rms_over_time(series.time, series.torque[:, columns])
    breaks = np.flatnonzero(np.diff(series.time) <= 0) + 1
    blocks = [b for b in np.split(np.arange(series.time.size), breaks) if b.size > 1]
    middles = [0.5 * float(series.time[b[0]] + series.time[b[-1]]) for b in blocks]
    stands = [any(start <= at <= end for start, end in support) for at in middles]
    for axes, column, label, own in zip(
        panels.ravel(), columns, joints.values(), rms, strict=False
    ):
        _region(axes, motors[column], column, (speed, strongest))
        points = series.velocity[:, column] * _RPM, series.torque[:, column]
        axes.plot(*points, color=QUIET, linewidth=0.8, linestyle=(0, (1, 1.5)), label="jump")
        for block, down in zip(blocks, stands, strict=True):
            look = (BLUE, "support") if down else (VERMILION, "transfer")
            axes.plot(points[0][block], points[1][block], color=look[0], lw=1.7, label=look[1])
        constant = _of_joint(motors[column].torque_constant, column)
        allowed = motors[column].continuous_current * constant
        share = f" of {number(allowed)}" if np.isfinite(allowed) else ""
        axes.set_title(f"{label}\nrms {number(float(own))}{share}", fontsize=8)
        axes.set_xlim(-speed * _RPM, speed * _RPM)
        axes.set_ylim(-strongest, strongest)
        axes.xaxis.set_major_formatter(lambda value, _: number(value / 1e3))
        axes.locator_params(nbins=4)
    named: dict[str, Any] = {}
    alike = all(motors[column] is motors[columns[0]] for column in columns)
    for axes in panels.ravel():
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            # The key of unlike motors says only what is the same in each.
            named.setdefault(label if alike else label.partition(":")[0], handle)
    figure.legend([*named.values()], [*named], loc="outside lower center", ncols=3, fontsize=8)
    return figure


def _region(axes: Axes, motor: DCMotor, column: int, limits: tuple[float, float]) -> None:
    """What the motor can do, bordered by its limits."""
    axes.set_facecolor(FAINT)
    axes.grid(False)
    constant = _of_joint(motor.torque_constant, column)
    reach, scale = (1.1 * limits[0], 1.1 * limits[1]), np.array([_RPM, 1.0])
    axes.fill(*(operating_region(motor, joint=column, reach=reach) * scale).T, color="white")
    continuous, peak = motor.continuous_current * constant, motor.peak_current * constant
    if np.isfinite(continuous):
        inner = operating_region(motor, joint=column, reach=(reach[0], min(reach[1], continuous)))
        words = f"continuous: {number(continuous)} N·m"
        axes.fill(*(inner * scale).T, facecolor=_CONTINUOUS, edgecolor=GREEN, label=words)
    edges: dict[str, Any] = {"color": INK, "linewidth": 1.1, "zorder": 1}
    for sign in (-1, 1):
        if np.isfinite(motor.supply_voltage):
            torque = np.array([-reach[1], reach[1]])
            drop = _of_joint(motor.resistance, column) * torque / constant
            at = (sign * motor.supply_voltage - drop) / constant
            axes.plot(at * _RPM, torque, label=f"supply: {number(motor.supply_voltage)} V", **edges)
        if np.isfinite(motor.max_speed):
            words = f"permitted: {number(motor.max_speed * _RPM, 4)} rpm"
            axes.axvline(sign * motor.max_speed * _RPM, linestyle=":", label=words, **edges)
        if np.isfinite(peak):
            words = f"peak: {number(peak, 4)} N·m"
            axes.axhline(sign * peak, linestyle="-.", label=words, **edges)
    for line in (axes.axhline, axes.axvline):
        line(0, color=QUIET, linewidth=0.7, zorder=1)
