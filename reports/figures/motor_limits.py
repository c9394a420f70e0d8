"""Where a motor works in the plane of speed and torque, and the limits of its data sheet."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from actuators.limits import rms_over_time
from reports.errors import FigureError
from reports.figures.style import (
    BLUE,
    QUIET,
    SHADE_DARK,
    VERMILION,
    headline,
    new_figure,
    number,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from actuators.motor import DCMotor
    from actuators.shaft import ShaftSeries

Array = NDArray[np.float64]
#: What the reader of the figure must know.
SUBTITLE = "motor over one cycle; grey: beyond the supply voltage or the permitted speed"
_RPM = 60 / (2 * np.pi)


@styled
def motor_limits_figure(
    series: ShaftSeries,
    motor: DCMotor,
    joints: Mapping[str, str],
    *,
    title: str,
    subtitle: str = SUBTITLE,
) -> Figure:
    """One panel per joint with the motor's operating path, within what the data sheet permits.

    The grey region cannot be reached at the supply voltage or exceeds the permitted speed; the
    dashed lines bound the torque that the motor bears continuously, which holds for the root mean
    square (above each panel) and not for every instant.

    Args:
        series: At the motor's shaft, over one cycle.
        motor: Whose limits are drawn.
        joints: Those to draw, name to label of the panel.
        title: First line.
        subtitle: Second line.

    Raises:
        FigureError: No joint to draw, or one that the series lacks.
    """
    from matplotlib.ticker import MaxNLocator

    unknown = [joint for joint in joints if joint not in series.joints]
    if unknown or not joints:
        raise FigureError(f"'{title}': no joint '{', '.join(unknown)}' in the motor's series")
    columns = [series.joints.index(joint) for joint in joints]
    constant = np.broadcast_to(motor.torque_constant, len(series.joints))[columns]
    resistance = np.broadcast_to(motor.resistance, len(series.joints))[columns]
    speed = series.velocity[:, columns] * _RPM  # [rpm]
    torque = series.torque[:, columns] * 1e3  # [mN*m]
    rms = rms_over_time(series.time, torque)
    blocks = np.split(np.arange(series.time.size), np.flatnonzero(np.diff(series.time) <= 0) + 1)
    continuous = motor.continuous_current * float(constant.min()) * 1e3
    x_max = 1.25 * max(float(np.abs(speed).max()), _corner(motor, float(constant.min())))
    y_max = 1.15 * max(float(np.abs(torque).max()), continuous if np.isfinite(continuous) else 0.0)
    figure = new_figure(9.0, 4.2)
    headline(figure, title, subtitle)
    panels = figure.subplots(1, len(joints), sharex=True, sharey=True, squeeze=False)[0]
    for j, (axes, label) in enumerate(zip(panels, joints.values(), strict=True)):
        axes.set_xlim(-x_max, x_max)
        axes.set_ylim(-y_max, y_max)
        _limits(axes, motor, float(constant[j]), float(resistance[j]), x_max, y_max)
        for block in blocks:
            axes.plot(speed[block, j], torque[block, j], color=BLUE, linewidth=1.6)
        axes.set_title(f"{label}\n", loc="center", fontweight="bold")
        axes.text(
            0.5,
            1.015,
            f"rms {number(float(rms[j]))} mN·m",
            transform=axes.transAxes,
            ha="center",
            va="bottom",
            color=BLUE,
            fontsize=8.5,
        )
        axes.axhline(0, color=QUIET, linewidth=0.7, zorder=1)
        axes.axvline(0, color=QUIET, linewidth=0.7, zorder=1)
        axes.xaxis.set_major_locator(MaxNLocator(5))
        axes.xaxis.set_major_formatter(
            lambda value, _: f"{value / 1e3:g}".replace("-", "\N{MINUS SIGN}")
        )
        axes.set_xlabel("motor speed [1000 rpm]")
    panels[0].set_ylabel("motor torque [mN·m]")
    return figure


def _corner(motor: DCMotor, constant: float) -> float:
    """The speed at which the first limit stands without load [rpm]."""
    limits = [motor.max_speed, motor.supply_voltage / constant]
    finite = [limit for limit in limits if np.isfinite(limit)]
    return min(finite) * _RPM if finite else 0.0


def _limits(
    axes: Axes, motor: DCMotor, constant: float, resistance: float, x_max: float, y_max: float
) -> None:
    torque = np.linspace(-y_max, y_max, 101)
    fastest = np.full(torque.shape, np.inf)  # towards positive speed [rpm]
    if np.isfinite(motor.supply_voltage):
        current = torque * 1e-3 / constant  # [A]
        fastest = (motor.supply_voltage - resistance * current) / constant * _RPM
        axes.plot(fastest, torque, color=QUIET, linewidth=1.1)
        axes.plot(-fastest[::-1], torque, color=QUIET, linewidth=1.1)
        axes.text(
            -float(fastest[75]) + 0.02 * x_max,
            -0.55 * y_max,
            f"{motor.supply_voltage:g} V",
            ha="left",
            va="center",
            fontsize=7.5,
            color=QUIET,
        )
    if np.isfinite(motor.max_speed):
        limit = motor.max_speed * _RPM
        for sign in (-1, 1):
            axes.axvline(sign * limit, color=QUIET, linewidth=1.1, linestyle=(0, (1, 1.5)))
        fastest = np.minimum(fastest, limit)
        axes.text(
            limit + 0.015 * x_max,
            0.0,
            f"{limit:.0f} rpm",
            rotation=90,
            ha="left",
            va="center",
            fontsize=7.5,
            color=QUIET,
            clip_on=True,
        )
    inside = np.isfinite(fastest)
    for sign in (-1, 1):
        axes.fill_betweenx(
            sign * torque[inside],
            sign * fastest[inside],
            sign * x_max,
            color=SHADE_DARK,
            linewidth=0,
        )
    if np.isfinite(motor.continuous_current):
        bound = motor.continuous_current * constant * 1e3
        for sign in (-1, 1):
            axes.axhline(sign * bound, color=VERMILION, linewidth=1.0, linestyle=(0, (4, 3)))
        axes.text(
            -0.03 * x_max,
            bound,
            f"continuous: {number(bound)}",
            ha="right",
            va="bottom",
            fontsize=7.5,
            color=VERMILION,
        )
