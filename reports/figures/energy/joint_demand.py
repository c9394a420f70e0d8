"""Velocity and torque demanded of one joint over a gait cycle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from actuators.arrays import Array
from reports.figures.stretch import Stretch
from reports.figures.style import (
    BLUE,
    QUIET,
    SHADE,
    VERMILION,
    horizontal_grid,
    house_style,
    new_figure,
    number,
    zero_line,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Torque in the air gets a panel of its own below this share of the torque on the ground.
_READABLE = 0.2
#: A phase shorter than this share of the cycle has no room for its name.
_NARROW = 0.09
_VARIABLES = ("velocity", "torque")


@house_style()
def joint_demand_figure(
    stretches: Sequence[Stretch],
    column: int,
    leg: str,
    *,
    title: str,
    subtitle: str = "",
    slides: bool = False,
) -> Figure:
    """Panels over the cycle: velocity, torque, and transfer's torque enlarged where it is small.

    Every stretch is drawn by itself, so that a jump between two is a gap and not a slope. Support
    is shaded. A sliding joint has metres and newtons instead of radians and newton metres.

    Args:
        stretches: One period.
    """
    times = [s.time for s in stretches]
    velocities, torques = ([getattr(s, n)[:, column] for s in stretches] for n in _VARIABLES)
    support = [leg in s.stance for s in stretches]
    enlarged = _hidden(torques, support)
    figure = new_figure(6.4 if enlarged else 4.8, title, subtitle)
    panels = figure.subplots(3 if enlarged else 2, 1, sharex=True)
    rate, effort, unit = ("m/s", "force", "N") if slides else ("rad/s", "torque", "N·m")
    _panel(panels[0], times, velocities, BLUE, f"velocity [{rate}]", rate)
    _panel(panels[1], times, torques, VERMILION, f"{effort} [{unit}]", unit)
    if enlarged:
        shown, label = [times[k] for k in enlarged], f"{effort} in transfer,\nenlarged [{unit}]"
        _panel(panels[2], shown, [torques[k] for k in enlarged], VERMILION, label, unit)
    whole = float(times[-1][-1] - times[0][0])
    for first, last, stands in _phases(times, support):
        if stands:
            for axes in panels:
                axes.axvspan(first, last, color=SHADE, linewidth=0, zorder=0)
        if last - first >= _NARROW * whole:
            panels[0].text(
                (first + last) / 2,
                1.02,
                "support" if stands else "transfer",
                transform=panels[0].get_xaxis_transform(),
                ha="center",
                va="bottom",
                color=QUIET,
            )
    panels[-1].set_xlim(float(times[0][0]), float(times[-1][-1]))
    panels[-1].set_xlabel("time [s]")
    figure.align_ylabels(list(panels))
    return figure


def _phases(times: Sequence[Array], support: Sequence[bool]) -> list[tuple[float, float, bool]]:
    """Start, end and whether the leg stands, of stretches of the same kind in a row."""
    phases: list[tuple[float, float, bool]] = []
    for time, stands in zip(times, support, strict=True):
        first = float(time[0])
        if phases and phases[-1][2] == stands:
            first = phases.pop()[0]
        phases.append((first, float(time[-1]), stands))
    return phases


def _hidden(torques: Sequence[Array], support: Sequence[bool]) -> list[int]:
    """The stretches in the air where the scale of those on the ground would hide their torque."""
    spans = [float(np.ptp(np.append(torque, 0.0))) for torque in torques]
    ground, air = ([k for k, s in enumerate(support) if s is stands] for stands in (True, False))
    if not ground or not air:
        return []
    return air if max(spans[k] for k in air) <= _READABLE * max(spans[k] for k in ground) else []


def _panel(
    axes: Axes,
    times: Sequence[Array],
    values: Sequence[Array],
    color: str,
    label: str,
    unit: str,
) -> None:
    for time, value in zip(times, values, strict=True):
        axes.plot(time, value, color=color, clip_on=False)
    zero_line(axes)
    horizontal_grid(axes)
    axes.set_ylabel(label)
    joined = np.concatenate(values)
    low, high = float(joined.min()), float(joined.max())
    span = max(high - low, 1e-12)
    axes.set_ylim(min(low, 0.0) - 0.2 * span, max(high, 0.0) + 0.2 * span)
    time = np.concatenate(times)
    for index, above in ((int(joined.argmax()), True), (int(joined.argmin()), False)):
        share = (time[index] - time[0]) / max(time[-1] - time[0], 1e-12)
        axes.annotate(
            f"{number(joined[index])} {unit}",
            (time[index], joined[index]),
            xytext=(0, 4 if above else -4),
            textcoords="offset points",
            ha="left" if share < 0.08 else "right" if share > 0.92 else "center",
            va="bottom" if above else "top",
            color=color,
            fontsize=8.5,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.8},
        )
