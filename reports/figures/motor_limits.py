"""Where a motor works in the plane of speed and torque, and the limits of its data sheet."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from actuators.arrays import Array
from actuators.energy.limits import operating_region, rms_over_time
from reports.figures.style import (
    BLUE,
    GREEN,
    INK,
    QUIET,
    SHADE_DARK,
    VERMILION,
    arrow,
    house_style,
    new_figure,
    note,
)
from reports.typeset import number

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from actuators.shaft import DCMotor, ShaftSeries

#: What the reader of the figure must know.
SUBTITLE = "one gait cycle of the motor, closed; grey: out of its reach"
_RPM = 60 / (2 * np.pi)
_CONTINUOUS = "#dff3ec"
#: From here on torques are written in N·m.
_STRONG = 10.0  # [N*m]
#: Least length of a piece of the path that gets an arrow, as a share of the panel.
_ARROW = 0.06


def common_scale(
    every: Iterable[tuple[ShaftSeries, Sequence[DCMotor]]], joints: Iterable[str]
) -> tuple[float, float]:
    """Half the ranges of panels in which the paths of several alternatives can be compared.

    They hold every path, the edge of the region at no torque, and the continuous torque.

    Args:
        every: Series at the motors' shafts and the motor of each of its joints.

    Returns:
        Speed [rad/s] and torque [N*m].
    """
    shown = list(joints)
    speeds, torques = [1e-9], [1e-9]
    for series, motors in every:
        columns = [series.joints.index(joint) for joint in shown]
        speeds.append(1.12 * float(np.abs(series.velocity[:, columns]).max()))
        torques.append(1.12 * float(np.abs(series.torque[:, columns]).max()))
        for column in columns:
            motor, constant = motors[column], _constants(motors[column], column)[0]
            speeds += [1.12 * motor.max_speed, 1.12 * motor.supply_voltage / constant]
            torques.append(1.25 * motor.continuous_current * constant)
    return max(filter(np.isfinite, speeds)), max(filter(np.isfinite, torques))


@house_style()
def motor_limits_figure(
    series: ShaftSeries,
    motors: Sequence[DCMotor],
    joints: Mapping[str, str],
    support: Sequence[tuple[float, float]],
    *,
    title: str,
    subtitle: str = "",
    scale: tuple[float, float] | None = None,
) -> Figure:
    """The closed path of each joint's motor within what voltage, current and speed allow.

    The first panel shows the whole region, with the part that the others enlarge as a frame. The
    continuous torque bounds the root mean square, stated above each panel, and no instant.

    Args:
        series: At the motor's shaft, over one cycle.
        motors: Whose limits are drawn, one per joint of the series.
        joints: Those to draw, name to label of the panel.
        support: Start and end of every stretch of time in which the joints' leg stands [s].
        scale: Of the panels, to give several figures the same: half the ranges of speed [rad/s]
            and torque [N*m].
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Rectangle

    columns = [series.joints.index(joint) for joint in joints]
    speed, strongest = scale or common_scale([(series, motors)], joints)
    unit, factor = ("N·m", 1.0) if strongest >= _STRONG else ("mN·m", 1e3)
    limits = (speed * _RPM, strongest * factor)
    count = -(-(1 + len(joints)) // 2)
    figure = new_figure(1.7 + 2.15 * count, title, subtitle)
    grid = figure.subplots(count, 2, squeeze=False)
    whole, *panels = grid.ravel()
    for axes in panels[len(joints) :]:
        axes.set_visible(False)
    # The whole region, and a frame around what the other panels show.
    constant, resistance = _constants(motors[columns[0]], columns[0])
    most = [motors[columns[0]].peak_current, motors[columns[0]].supply_voltage / resistance]
    finite = [current * constant for current in most if np.isfinite(current)]
    bounds = (1.05 * limits[0], 1.15 * max([*finite, strongest]) * factor)
    _region(whole, motors[columns[0]], columns[0], bounds, factor)
    corner, size = (-limits[0], -limits[1]), (2 * limits[0], 2 * limits[1])
    whole.add_patch(Rectangle(corner, *size, fill=False, edgecolor=INK, zorder=4))
    for axes in grid[:, 0]:
        axes.set_ylabel(f"motor torque [{unit}]")
    whole.set_title("whole region\n", fontweight="bold")
    whole.set_xlabel("motor speed [1000 rpm]")
    rms = rms_over_time(series.time, series.torque[:, columns])
    for k, (column, label) in enumerate(zip(columns, joints.values(), strict=True)):
        motor, axes = motors[column], panels[k]
        region = _region(axes, motor, column, limits, factor)
        points = np.column_stack(
            [series.velocity[:, column] * _RPM, series.torque[:, column] * factor]
        )
        breaks = np.flatnonzero(np.diff(series.time) <= 0) + 1
        blocks = [b for b in np.split(np.arange(series.time.size), breaks) if b.size > 1]
        for block, following in zip(blocks, [*blocks[1:], blocks[0]], strict=True):
            middle = 0.5 * float(series.time[block[0]] + series.time[block[-1]])
            stands = any(start <= middle <= end for start, end in support)
            color = BLUE if stands else VERMILION
            axes.plot(*points[block].T, color=color, linewidth=1.7, zorder=3)
            _arrow(axes, points[block], np.asarray(limits), color)
            jump = points[[block[-1], following[0]]]
            axes.plot(*jump.T, color=QUIET, linewidth=1.0, linestyle=(0, (1.2, 1.2)), zorder=2)
        key = [
            Line2D([], [], color=BLUE, label="support"),
            Line2D([], [], color=VERMILION, label="transfer"),
            Line2D([], [], color=QUIET, linewidth=1.0, linestyle=(0, (1.2, 1.2)), label="jump"),
            *region,
        ]
        allowed = motor.continuous_current * _constants(motor, column)[0]
        share = f" of {number(allowed * factor)}" if np.isfinite(allowed) else ""
        axes.set_title(f"{label}\n", fontweight="bold")
        words = f"rms {number(float(rms[k]) * factor)}{share} {unit}"
        note(axes, words, (0, 1), (0, 4), xycoords="axes fraction", color=QUIET, fontsize=8)
        axes.set_xlabel("motor speed [1000 rpm]")
    if any(motors[column] is not motors[columns[0]] for column in columns):
        for handle in key:  # the key of all panels says only what is the same in each
            handle.set_label(str(handle.get_label()).partition(":")[0])
    figure.legend(handles=key, loc="outside lower center", ncols=3, fontsize=8)
    return figure


def _constants(motor: DCMotor, column: int) -> tuple[float, float]:
    """Torque constant [N*m/A] and resistance [ohm] of one joint's motor."""
    columns = (np.ravel(values) for values in (motor.torque_constant, motor.resistance))
    constant, resistance = (float(c[column if c.size > 1 else 0]) for c in columns)
    return constant, resistance


def _region(
    axes: Axes, motor: DCMotor, column: int, limits: tuple[float, float], factor: float
) -> list[Artist]:
    """What the motor can do, bordered by its limits; returns their keys."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch, Polygon
    from matplotlib.ticker import MaxNLocator

    axes.set_xlim(-limits[0], limits[0])
    axes.set_ylim(-limits[1], limits[1])
    axes.set_facecolor(SHADE_DARK)
    constant, resistance = _constants(motor, column)
    display = np.array([_RPM, factor])
    reach = (1.1 * limits[0] / _RPM, 1.1 * limits[1] / factor)
    region = operating_region(motor, joint=column, reach=reach) * display
    axes.add_patch(Polygon(region, facecolor="white", edgecolor="none", zorder=0.5))
    keys: list[Artist] = []
    unit = "N·m" if factor == 1.0 else "mN·m"
    continuous = motor.continuous_current * constant
    if np.isfinite(continuous):
        zone = operating_region(motor, joint=column, reach=(reach[0], min(reach[1], continuous)))
        axes.add_patch(Polygon(zone * display, facecolor=_CONTINUOUS, edgecolor="none", zorder=0.6))
        for sign in (-1, 1):
            axes.axhline(sign * continuous * factor, color=GREEN, linewidth=1.0, zorder=1)
        words = f"continuous: {number(continuous * factor)} {unit}"
        keys.append(Patch(facecolor=_CONTINUOUS, edgecolor=GREEN, label=words))
    if np.isfinite(motor.supply_voltage):
        torque = np.array([-reach[1], reach[1]])
        for sign in (-1, 1):
            speed = (sign * motor.supply_voltage - resistance * torque / constant) / constant
            axes.plot(speed * _RPM, torque * factor, color=INK, linewidth=1.1, zorder=1)
        words = f"supply: {number(motor.supply_voltage)} V"
        keys.append(Line2D([], [], color=INK, linewidth=1.1, label=words))
    for value, name, along in (
        (motor.max_speed * _RPM, "permitted: {} rpm", axes.axvline),
        (motor.peak_current * constant * factor, f"peak: {{}} {unit}", axes.axhline),
    ):
        if not np.isfinite(value):
            continue
        style = (0, (1, 1.5)) if along == axes.axvline else (0, (5, 2, 1, 2))
        for sign in (-1, 1):
            along(sign * value, color=INK, linewidth=1.1, linestyle=style, zorder=1)
        words = name.format(number(value, 4))
        keys.append(Line2D([], [], color=INK, linewidth=1.1, linestyle=style, label=words))
    axes.axhline(0, color=QUIET, linewidth=0.7, zorder=1)
    axes.axvline(0, color=QUIET, linewidth=0.7, zorder=1)
    axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.xaxis.set_major_formatter(
        lambda value, _: f"{value / 1e3:g}".replace("-", "\N{MINUS SIGN}")
    )
    return keys


def _arrow(axes: Axes, points: Array, limits: Array, color: str) -> None:
    """An arrowhead half way along a piece of the path."""
    steps = np.hypot(*(np.diff(points, axis=0) / (2 * limits)).T)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    if length[-1] < _ARROW:
        return
    at = 0.5 * length[-1] + np.array([-0.01, 0.01])
    tail, tip = zip(*(np.interp(at, length, points[:, k]).tolist() for k in (0, 1)), strict=True)
    arrow(axes, tip, tail, color, head=(0.28, 0.55), width=1.2, zorder=3)
