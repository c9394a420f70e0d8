"""Where a motor works in the plane of speed and torque, and the limits of its data sheet."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from actuators.energy.envelope import operating_region
from actuators.energy.limits import rms_over_time
from reports.errors import FigureError
from reports.figures.style import (
    BLUE,
    GREEN,
    INK,
    QUIET,
    SHADE_DARK,
    VERMILION,
    headline,
    new_figure,
    number,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from actuators.elements.motor import DCMotor
    from actuators.shaft import ShaftSeries

Array = NDArray[np.float64]
#: What the reader of the figure must know.
SUBTITLE = "one gait cycle of the motor, closed; grey: out of its reach"
_RPM = 60 / (2 * np.pi)
_CONTINUOUS = "#dff3ec"
#: From here on torques are written in N·m.
_STRONG = 10.0  # [N*m]
#: Joints side by side.
_IN_ROW = 4
#: Of half the path, more than a picture can show; the least of a piece of it.
_POINTS, _LEAST = 201, 31
#: Least length of a piece of the path that gets an arrow, as a share of the panel.
_ARROW = 0.06


@dataclass(frozen=True)
class MotorScale:
    """Half the ranges of a panel.

    Attributes:
        speed: [rad/s].
        torque: [N*m].
    """

    speed: float
    torque: float


def common_scale(
    every: Iterable[tuple[ShaftSeries, Sequence[DCMotor]]], joints: Iterable[str]
) -> MotorScale:
    """The scale on which the paths of several alternatives can be compared.

    It holds every path, the edge of the region at no torque, and the continuous torque.

    Args:
        every: Series at the motors' shafts and the motor of each of its joints.
        joints: Those to draw.

    Raises:
        FigureError: A joint that a series lacks.
    """
    shown = list(joints)
    speed, torque = [1e-9], [1e-9]
    for series, motors in every:
        columns = _columns(series, shown)
        speed.append(1.12 * float(np.abs(series.velocity[:, columns]).max()))
        torque.append(1.12 * float(np.abs(series.torque[:, columns]).max()))
        for column in columns:
            motor, constant = motors[column], _constants(motors[column], column)[0]
            edges = [motor.max_speed, motor.supply_voltage / constant]
            speed += [1.12 * edge for edge in edges if np.isfinite(edge)]
            continuous = motor.continuous_current * constant
            torque += [1.25 * continuous] if np.isfinite(continuous) else []
    return MotorScale(max(speed), max(torque))


@styled
def motor_limits_figure(
    series: ShaftSeries,
    motors: Sequence[DCMotor],
    joints: Mapping[str, str],
    support: Sequence[tuple[float, float]],
    *,
    title: str,
    subtitle: str = SUBTITLE,
    scale: MotorScale | None = None,
) -> Figure:
    """The closed path of each joint's motor within what voltage, current and speed allow.

    The first panel shows the whole region, with the part that the others enlarge as a frame. The
    continuous torque bounds the root mean square, stated above each panel, and no instant.

    Args:
        series: At the motor's shaft, over one cycle.
        motors: Whose limits are drawn, one per joint of the series.
        joints: Those to draw, name to label of the panel.
        support: Start and end of every stretch of time in which the joints' leg stands [s].
        title: First line.
        subtitle: Second line.
        scale: Of the panels, to give several figures the same.

    Raises:
        FigureError: No joint to draw, or one that the series lacks.
    """
    if not joints:
        raise FigureError(f"'{title}': no joint to draw")
    columns = _columns(series, list(joints))
    scale = scale or common_scale([(series, motors)], joints)
    rms = rms_over_time(series.time, series.torque[:, columns])
    unit, factor = ("N·m", 1.0) if scale.torque >= _STRONG else ("mN·m", 1e3)
    figure, whole, rows = _panels(len(joints))
    headline(figure, title, subtitle)
    panels = [axes for row in rows for axes in row]
    _whole(whole, motors[columns[0]], columns[0], scale, factor)
    whole.set_ylabel(f"motor torque [{unit}]")
    whole.set_title("whole region\n", loc="center", fontweight="bold")
    for column, value, axes, label in zip(columns, rms, panels, joints.values(), strict=True):
        motor, limits = motors[column], (scale.speed * _RPM, scale.torque * factor)
        key = _region(axes, motor, column, limits, factor)
        key = _path(axes, series, column, support, limits, factor) + key
        allowed = motor.continuous_current * _constants(motor, column)[0]
        share = f" of {number(allowed * factor)}" if np.isfinite(allowed) else ""
        axes.set_title(f"{label}\n", loc="center", fontweight="bold")
        words = f"rms {number(float(value) * factor)}{share} {unit}"
        look: dict[str, Any] = {"ha": "center", "va": "bottom", "color": QUIET, "fontsize": 8}
        axes.text(0.5, 1.015, words, transform=axes.transAxes, **look)
        if all(axes is not row[0] for row in rows):
            axes.tick_params(labelleft=False)
    for axes in (whole, *panels):
        axes.set_xlabel("motor speed [1000 rpm]")
    key = _common(key, [motors[column] for column in columns])
    figure.legend(handles=key, loc="outside lower center", ncols=4, fontsize=8, handlelength=2.2)
    return figure


def _panels(joints: int) -> tuple[Figure, Axes, list[list[Axes]]]:
    """A figure, its panel of the whole region, and rows of panels, one for each joint."""
    rows = -(-joints // _IN_ROW)
    across = -(-joints // rows)
    figure = new_figure(1.2 + 3.4 * rows)
    grid = figure.subplots(rows, 1 + across, width_ratios=[0.8] + [1.0] * across, squeeze=False)
    for axes in (*grid[1:, 0], *grid[:, 1:].ravel()[joints:]):
        axes.set_visible(False)
    shown = [list(row[1:]) for row in grid]
    shown[-1] = shown[-1][: joints - across * (rows - 1)]
    return figure, grid[0, 0], shown


def _common(key: list[Artist], motors: Sequence[DCMotor]) -> list[Artist]:
    """The key of all panels: how large a limit is only where it is the same in each."""
    if any(motor is not motors[0] for motor in motors):
        for handle in key:
            handle.set_label(str(handle.get_label()).partition(":")[0])
    return key


def _columns(series: ShaftSeries, joints: Sequence[str]) -> list[int]:
    unknown = [joint for joint in joints if joint not in series.joints]
    if unknown:
        raise FigureError(f"no joint '{', '.join(unknown)}' in the motor's series")
    return [series.joints.index(joint) for joint in joints]


def _constants(motor: DCMotor, column: int) -> tuple[float, float]:
    """Torque constant [N*m/A] and resistance [ohm] of one joint's motor."""
    columns = (np.ravel(values) for values in (motor.torque_constant, motor.resistance))
    constant, resistance = (float(c[column if c.size > 1 else 0]) for c in columns)
    return constant, resistance


def _whole(axes: Axes, motor: DCMotor, column: int, scale: MotorScale, factor: float) -> None:
    """The whole region, and a frame around what the other panels show."""
    from matplotlib.patches import Rectangle

    constant, resistance = _constants(motor, column)
    strongest = [motor.peak_current * constant, motor.supply_voltage / resistance * constant]
    finite = [torque for torque in strongest if np.isfinite(torque)]
    limits = (1.05 * scale.speed * _RPM, 1.15 * max([*finite, scale.torque]) * factor)
    _region(axes, motor, column, limits, factor)
    width, height = 2 * scale.speed * _RPM, 2 * scale.torque * factor
    axes.add_patch(
        Rectangle((-width / 2, -height / 2), width, height, fill=False, edgecolor=INK, zorder=4)
    )


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


def _path(
    axes: Axes,
    series: ShaftSeries,
    column: int,
    support: Sequence[tuple[float, float]],
    limits: tuple[float, float],
    factor: float,
) -> list[Artist]:
    """The closed path by phase, with arrows along time; returns the keys."""
    from matplotlib.lines import Line2D

    points = np.column_stack([series.velocity[:, column] * _RPM, series.torque[:, column] * factor])
    breaks = np.flatnonzero(np.diff(series.time) <= 0) + 1
    blocks = [b for b in np.split(np.arange(series.time.size), breaks) if b.size > 1]
    most = max(_LEAST, 2 * _POINTS // max(2, len(blocks)))
    for block, following in zip(blocks, [*blocks[1:], blocks[0]], strict=True):
        shown = block[np.unique(np.linspace(0, block.size - 1, most).round().astype(int))]
        middle = 0.5 * float(series.time[block[0]] + series.time[block[-1]])
        stands = any(start <= middle <= end for start, end in support)
        color = BLUE if stands else VERMILION
        axes.plot(*points[shown].T, color=color, linewidth=1.7, zorder=3)
        _arrow(axes, points[shown], np.asarray(limits), color)
        jump = points[[block[-1], following[0]]]
        axes.plot(*jump.T, color=QUIET, linewidth=1.0, linestyle=(0, (1.2, 1.2)), zorder=2)
    return [
        Line2D([], [], color=BLUE, label="support"),
        Line2D([], [], color=VERMILION, label="transfer"),
        Line2D([], [], color=QUIET, linewidth=1.0, linestyle=(0, (1.2, 1.2)), label="jump"),
    ]


def _arrow(axes: Axes, points: Array, limits: Array, color: str) -> None:
    """An arrowhead half way along a piece of the path."""
    steps = np.hypot(*(np.diff(points, axis=0) / (2 * limits)).T)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    if length[-1] < _ARROW:
        return
    at = 0.5 * length[-1] + np.array([-0.01, 0.01])
    tail, tip = zip(*(np.interp(at, length, points[:, k]).tolist() for k in (0, 1)), strict=True)
    axes.annotate(
        "",
        tip,
        tail,
        arrowprops={
            "arrowstyle": "-|>,head_width=0.28,head_length=0.55",
            "color": color,
            "linewidth": 1.2,
            "shrinkA": 0,
            "shrinkB": 0,
        },
        zorder=3,
    )
