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
    house_style,
    key,
    new_figure,
    note,
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


_COLORS = (*CYCLE, INK)
_AIR, _GROUND = 0.9, 2.0  # widths of lines


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
    """Velocity and torque of one joint over the cycle, with their ends; support is shaded.

    Every stretch is drawn by itself, so that a jump between two is a gap and not a slope. A sliding
    joint has metres and newtons instead of radians and newton metres.

    Args:
        stretches: One period.
        column: Of the joint.
        leg: To which it belongs.
    """
    figure = new_figure(3.6, title, f"{subtitle}; shaded: support" if subtitle else subtitle)
    panels = figure.subplots(2, 1, sharex=True)
    names = ("velocity", "m/s", "force", "N") if slides else ("velocity", "rad/s", "torque", "N·m")
    for axes, kind, color in zip(panels, ("velocity", "torque"), (BLUE, VERMILION), strict=True):
        word, unit = names[:2] if kind == "velocity" else names[2:]
        for stretch in stretches:
            axes.plot(stretch.time, getattr(stretch, kind)[:, column], color=color, clip_on=False)
            if leg in stretch.stance:
                axes.axvspan(stretch.time[0], stretch.time[-1], color=SHADE, lw=0, zorder=0)
        zero_line(axes)
        axes.set_ylabel(f"{word} [{unit}]")
        axes.margins(y=0.26)
        time = np.concatenate([s.time for s in stretches])
        values = np.concatenate([getattr(s, kind)[:, column] for s in stretches])
        for k, up in ((int(values.argmax()), 1), (int(values.argmin()), -1)):
            share = (time[k] - time[0]) / (time[-1] - time[0])
            side = "left" if share < 0.08 else "right" if share > 0.92 else "center"
            look: dict[str, Any] = {"ha": side, "va": "bottom" if up > 0 else "top", "color": color}
            note(axes, f"{number(values[k])} {unit}", (time[k], values[k]), (0, 4 * up), **look)
    _finish(figure, stretches)
    return figure


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
        joints: All of them, in the order of the torque's columns.
        legs: Leg to its joints from the base outward; legs may differ in how many they have.
        sliding: Joints whose effort is a force.
    """
    depth = max(len(own) for own in legs.values())
    rows = {
        f"joint {k + 1}": [(leg, own[k]) for leg, own in legs.items() if k < len(own)]
        for k in range(depth)
    }
    known = {joint for own in legs.values() for joint in own}
    if others := [("", joint) for joint in joints if joint not in known]:
        rows["outside legs"] = others
    figure = new_figure(1.4 + 1.3 * len(rows), title, subtitle)
    panels = figure.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0]
    order = [*legs]
    for axes, (place, row) in zip(panels, rows.items(), strict=True):
        for i, (leg, joint) in enumerate(row):
            at = order.index(leg) if leg else i
            _line(axes, stretches, "torque", [*joints].index(joint), leg or joint, at)
        kinds = sorted({"force [N]" if one in sliding else "torque [N·m]" for _, one in row})
        axes.set_ylabel(f"{place}\n{' or '.join(kinds)}")
        zero_line(axes)
    _finish(figure, stretches)
    return figure


@house_style()
def ground_forces_figure(
    stretches: Sequence[Stretch], legs: Sequence[str], *, title: str, subtitle: str = ""
) -> Figure:
    """Normal force and friction needed of every foot, and the margin of stability.

    Args:
        stretches: One period.
        legs: In the order of the forces' columns.
    """
    figure = new_figure(5.0, title, subtitle)
    panels = figure.subplots(3, 1, sharex=True, height_ratios=[1.5, 1.0, 1.0])
    for i, leg in enumerate(legs):
        _line(panels[0], stretches, "normal", i, leg, i)
        _line(panels[1], stretches, "friction", i, leg, i)
    for s in stretches:
        panels[2].plot(s.time, 1e3 * s.margin, color=INK)
    words = ("normal force [N]", "friction\nneeded [1]", "stability\nmargin [mm]")
    for axes, word in zip(panels, words, strict=True):
        axes.set_ylabel(word)
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    worst = min(stretches, key=lambda s: float(s.margin.min()))
    at = int(worst.margin.argmin())
    least = f"least margin {number(1e3 * float(worst.margin[at]))} mm at {worst.time[at]:.2f} s"
    panels[2].set_title(least, color=QUIET)
    _finish(figure, stretches)
    return figure


def _line(
    axes: Axes, stretches: Sequence[Stretch], variable: str, column: int, leg: str, index: int
) -> None:
    """A column of a variable through all stretches, broken where it jumps, bold on the ground."""
    for k, stretch in enumerate(stretches):
        axes.plot(
            stretch.time,
            getattr(stretch, variable)[:, column],
            color=_COLORS[index % len(_COLORS)],
            linewidth=_GROUND if leg in stretch.stance else _AIR,
            label="" if k else leg.upper(),
        )


def _finish(figure: Figure, stretches: Sequence[Stretch]) -> None:
    """One axis of time below all panels; a key of every line that has a name."""
    figure.axes[-1].set_xlim(float(stretches[0].time[0]), float(stretches[-1].time[-1]))
    figure.axes[-1].set_xlabel("time [s]")
    figure.align_ylabels()
    if any(axes.get_legend_handles_labels()[1] for axes in figure.axes):
        for handle in key(figure, 6).get_lines():
            handle.set_linewidth(_GROUND)
