"""Velocity and torque demanded of one joint over a gait cycle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from reports.errors import FigureError
from reports.figures.style import (
    BLUE,
    QUIET,
    SHADE,
    VERMILION,
    headline,
    horizontal_grid,
    new_figure,
    number,
    styled,
    zero_line,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pipeline.dynamics.joint_demand import MotionDemand

Array = NDArray[np.float64]
#: Torque in the air gets a panel of its own below this share of the torque on the ground.
_READABLE = 0.2
#: A phase shorter than this share of the cycle has no room for its name.
_NARROW = 0.09


@dataclass(frozen=True)
class Stretch:
    """One joint during one segment, both ends included.

    Attributes:
        time: Shape (N,) [s].
        velocity: Shape (N,) [rad/s].
        torque: Shape (N,) [N*m].
        support: Whether the joint's leg stands on the ground.
    """

    time: Array
    velocity: Array
    torque: Array
    support: bool


def stretches(demand: MotionDemand, joint: str, leg: str) -> tuple[Stretch, ...]:
    """The stretches of one joint out of a motion's demand.

    Raises:
        FigureError: The demand has no such joint.
    """
    if joint not in demand.joints:
        raise FigureError(f"joint '{joint}' is not among {', '.join(demand.joints)}")
    j = demand.joints.index(joint)
    return tuple(
        Stretch(
            segment.time,
            segment.velocity[:, j],
            segment.torque[:, j],
            contacts is not None and leg in contacts.stance,
        )
        for segment, contacts in zip(demand.segments, demand.contacts, strict=True)
    )


@styled
def joint_demand_figure(
    joint: str,
    parts: Sequence[Stretch],
    *,
    title: str = "",
    subtitle: str = "",
    slides: bool = False,
) -> Figure:
    """Panels over the cycle: velocity, torque, and transfer's torque enlarged where it is small.

    Every stretch is drawn by itself, so that a jump between two is a gap and not a slope. Support
    is shaded. A sliding joint has metres and newtons instead of radians and newton metres.

    Raises:
        FigureError: There is nothing to draw.
    """
    if not parts:
        raise FigureError(f"joint '{joint}': no stretch of motion to draw")
    enlarged = _hidden(parts)
    figure = new_figure(6.4 if enlarged else 4.8)
    headline(figure, title or f"{joint}: velocity and torque demand", subtitle)
    panels = figure.subplots(3 if enlarged else 2, 1, sharex=True)
    upper, middle = panels[:2]
    rate, effort, unit = ("m/s", "force", "N") if slides else ("rad/s", "torque", "N·m")
    _panel(upper, parts, [p.velocity for p in parts], BLUE, f"velocity [{rate}]", rate)
    _panel(middle, parts, [p.torque for p in parts], VERMILION, f"{effort} [{unit}]", unit)
    if enlarged:
        torque, label = [p.torque for p in enlarged], f"{effort} in transfer,\nenlarged [{unit}]"
        _panel(panels[2], enlarged, torque, VERMILION, label, unit)
    whole = float(parts[-1].time[-1] - parts[0].time[0])
    for first, last, support in _phases(parts):
        if support:
            for axes in panels:
                axes.axvspan(first, last, color=SHADE, linewidth=0, zorder=0)
        if last - first < _NARROW * whole:
            continue
        upper.text(
            (first + last) / 2,
            1.02,
            "support" if support else "transfer",
            transform=upper.get_xaxis_transform(),
            ha="center",
            va="bottom",
            color=QUIET,
        )
    panels[-1].set_xlim(float(parts[0].time[0]), float(parts[-1].time[-1]))
    panels[-1].set_xlabel("time [s]")
    figure.align_ylabels(list(panels))
    return figure


def _phases(parts: Sequence[Stretch]) -> list[tuple[float, float, bool]]:
    """Start, end and whether the leg stands, of stretches of the same kind in a row."""
    phases: list[tuple[float, float, bool]] = []
    for part in parts:
        first, last = float(part.time[0]), float(part.time[-1])
        if phases and phases[-1][2] == part.support:
            first = phases.pop()[0]
        phases.append((first, last, part.support))
    return phases


def _hidden(parts: Sequence[Stretch]) -> list[Stretch]:
    """The stretches in the air where the scale of those on the ground would hide their torque."""
    spans = [
        [float(np.ptp(np.append(p.torque, 0.0))) for p in parts if p.support is support]
        for support in (True, False)
    ]
    if not all(spans) or max(spans[1]) > _READABLE * max(spans[0]):
        return []
    return [p for p in parts if not p.support]


def _panel(
    axes: Axes,
    parts: Sequence[Stretch],
    values: Sequence[Array],
    color: str,
    label: str,
    unit: str,
) -> None:
    for part, value in zip(parts, values, strict=True):
        axes.plot(part.time, value, color=color, clip_on=False)
    zero_line(axes)
    horizontal_grid(axes)
    axes.set_ylabel(label)
    joined = np.concatenate(values)
    low, high = float(joined.min()), float(joined.max())
    span = max(high - low, 1e-12)
    axes.set_ylim(min(low, 0.0) - 0.2 * span, max(high, 0.0) + 0.2 * span)
    time = np.concatenate([part.time for part in parts])
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
