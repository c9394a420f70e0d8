"""What joints and feet do over a gait cycle: velocity, torque, ground forces, stability."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.arrays import Array
from reports.figures.style import (
    BLUE,
    CYCLE,
    INK,
    QUIET,
    SHADE,
    VERMILION,
    horizontal_grid,
    house_style,
    new_figure,
    note,
    on_white,
    zero_line,
)
from reports.typeset import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Stretch:
    """Part of a gait during which the same feet stand, both ends included.

    N samples, L legs, J joints. A figure reads no more of it than it shows.
    """

    time: Array  #: Shape (N,) [s].
    stance: tuple[str, ...]  #: Legs that stand.
    velocity: Array  #: Of every joint, shape (N, J) [rad/s]; of sliding ones [m/s].
    torque: Array  #: Of every joint, shape (N, J) [N*m]; of sliding ones their force [N].
    feet: Array  #: In the base frame, shape (N, L, 3) [m].
    normal: Array  #: Force of the ground across it, by leg, shape (N, L) [N].
    friction: Array  #: Tangential over normal force, NaN where none rests, shape (N, L).
    mass_centre: Array  #: In the base frame, shape (N, 3) [m].
    #: Distance of the centre of mass from the nearest edge of the support polygon, seen from above,
    #: shape (N,) [m].
    margin: Array


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
    # The stretches in the air where the scale of those on the ground would hide their torque.
    spans = [float(np.ptp(np.append(torque, 0.0))) for torque in torques]
    ground = max((span for span, stands in zip(spans, support, strict=True) if stands), default=0.0)
    enlarged = [k for k, stands in enumerate(support) if not stands]
    if max((spans[k] for k in enlarged), default=0.0) > _READABLE * ground:
        enlarged = []
    figure = new_figure(4.8 if enlarged else 3.6, title, subtitle)
    panels = figure.subplots(3 if enlarged else 2, 1, sharex=True)
    rate, effort, unit = ("m/s", "force", "N") if slides else ("rad/s", "torque", "N·m")
    _panel(panels[0], times, velocities, BLUE, f"velocity [{rate}]", rate)
    _panel(panels[1], times, torques, VERMILION, f"{effort} [{unit}]", unit)
    if enlarged:
        shown, label = [times[k] for k in enlarged], f"{effort} in transfer,\nenlarged [{unit}]"
        _panel(panels[2], shown, [torques[k] for k in enlarged], VERMILION, label, unit)
    phases: list[tuple[float, float, bool]] = []  # of stretches of the same kind in a row
    for time, stands in zip(times, support, strict=True):
        first = phases.pop()[0] if phases and phases[-1][2] == stands else float(time[0])
        phases.append((first, float(time[-1]), stands))
    whole = float(times[-1][-1] - times[0][0])
    for first, last, stands in phases:
        if stands:
            for axes in panels:
                axes.axvspan(first, last, color=SHADE, linewidth=0, zorder=0)
        if last - first >= _NARROW * whole:
            word, above = "support" if stands else "transfer", panels[0].get_xaxis_transform()
            look: dict[str, Any] = {"ha": "center", "va": "bottom", "color": QUIET}
            panels[0].text((first + last) / 2, 1.02, word, transform=above, **look)
    panels[-1].set_xlim(float(times[0][0]), float(times[-1][-1]))
    panels[-1].set_xlabel("time [s]")
    figure.align_ylabels(list(panels))
    return figure


def _panel(
    axes: Axes, times: Sequence[Array], values: Sequence[Array], color: str, label: str, unit: str
) -> None:
    for time, value in zip(times, values, strict=True):
        axes.plot(time, value, color=color, clip_on=False)
    zero_line(axes)
    horizontal_grid(axes)
    axes.set_ylabel(label)
    joined = np.concatenate(values)
    low, high = float(joined.min()), float(joined.max())
    span = max(high - low, 1e-12)
    axes.set_ylim(min(low, 0.0) - 0.26 * span, max(high, 0.0) + 0.26 * span)
    time = np.concatenate(times)
    for index, above in ((int(joined.argmax()), True), (int(joined.argmin()), False)):
        share = (time[index] - time[0]) / max(time[-1] - time[0], 1e-12)
        side = "left" if share < 0.08 else "right" if share > 0.92 else "center"
        place = {"ha": side, "va": "bottom" if above else "top"}
        look: dict[str, Any] = {"fontsize": 8.5, "bbox": on_white(0.6) | {"alpha": 0.8}}
        at, shift = (time[index], joined[index]), (0, 4 if above else -4)
        note(axes, f"{number(at[1])} {unit}", at, shift, color=color, **place, **look)


_COLORS = (*CYCLE, INK)
_AIR, _GROUND = 0.9, 2.0  # widths of lines


@house_style()
def joint_torques_figure(
    stretches: Sequence[Stretch],
    joints: Sequence[str],
    legs: Mapping[str, Sequence[str]],
    *,
    sliding: Sequence[str] = (),
    title: str,
    subtitle: str = "",
) -> Figure:
    """Torque of every joint: a panel for each place in the chain, a line for each leg.

    Joints outside the legs share a panel of their own. A leg's line is thin while it is in the air.

    Args:
        stretches: One period.
        legs: Leg to its joints from the base outward; legs may differ in how many they have.
    """
    columns = {joint: column for column, joint in enumerate(joints)}
    others = [joint for joint in joints if not any(joint in own for own in legs.values())]
    depth = max(len(own) for own in legs.values())
    rows = depth + bool(others)
    figure = new_figure(1.4 + 1.3 * rows, title, subtitle)
    panels = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    for k in range(depth):
        here = {leg: own[k] for leg, own in legs.items() if k < len(own)}
        for i, leg in enumerate(legs):
            if leg in here:
                _line(panels[k], stretches, "torque", columns[here[leg]], leg, i)
        _label(panels[k], f"joint {k + 1}", [joint in sliding for joint in here.values()])
    for i, joint in enumerate(others):
        _line(panels[-1], stretches, "torque", columns[joint], "", i, "--")
    if others:
        _label(panels[-1], "outside legs", [joint in sliding for joint in others])
    _finish(figure, list(panels), stretches, list(legs), others)
    return figure


@house_style()
def ground_forces_figure(
    stretches: Sequence[Stretch], legs: Sequence[str], *, title: str, subtitle: str = ""
) -> Figure:
    """Normal force and friction needed of every foot, and the margin of stability.

    Args:
        stretches: One period.
    """
    figure = new_figure(5.0, title, subtitle)
    panels = figure.subplots(3, 1, sharex=True, height_ratios=[1.5, 1.0, 1.0])
    for i, leg in enumerate(legs):
        _line(panels[0], stretches, "normal", i, leg, i)
        _line(panels[1], stretches, "friction", i, leg, i)
    panels[0].set_ylabel("normal force [N]")
    panels[1].set_ylabel("friction\nneeded [1]")
    for s in stretches:
        panels[2].plot(s.time, 1e3 * s.margin, color=INK)
    panels[2].set_ylabel("stability\nmargin [mm]")
    worst = min(stretches, key=lambda s: float(s.margin.min()))
    at = int(worst.margin.argmin())
    panels[2].set_title(
        f"least margin {number(1e3 * float(worst.margin[at]))} mm at {worst.time[at]:.2f} s",
        color=QUIET,
    )
    for axes in panels:
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    _finish(figure, panels, stretches, legs)
    return figure


def _line(
    axes: Axes,
    stretches: Sequence[Stretch],
    variable: str,
    column: int,
    leg: str,
    index: int,
    style: str = "-",
) -> None:
    """A column of a variable through all stretches, broken where it jumps."""
    for stretch in stretches:
        axes.plot(
            stretch.time,
            getattr(stretch, variable)[:, column],
            color=_COLORS[index % len(_COLORS)],
            linewidth=_GROUND if leg in stretch.stance else _AIR,
            linestyle=style,
        )


def _label(axes: Axes, place: str, sliding: Sequence[bool]) -> None:
    kinds = {"force [N]" if one else "torque [N·m]" for one in sliding}
    axes.set_ylabel(f"{place}\n" + " or ".join(sorted(kinds)))
    zero_line(axes)


def _finish(
    figure: Figure,
    panels: Sequence[Axes],
    stretches: Sequence[Stretch],
    legs: Sequence[str],
    others: Sequence[str] = (),
) -> None:
    from matplotlib.lines import Line2D

    for axes in panels:
        horizontal_grid(axes)
        axes.margins(y=0.12)
    panels[-1].set_xlim(float(stretches[0].time[0]), float(stretches[-1].time[-1]))
    panels[-1].set_xlabel("time [s]")
    figure.align_ylabels(list(panels))
    handles = [
        Line2D([], [], color=_COLORS[i % len(_COLORS)], ls=style, label=word)
        for words, style in (([leg.upper() for leg in legs], "-"), (others, "--"))
        for i, word in enumerate(words)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=min(6, len(handles)))
