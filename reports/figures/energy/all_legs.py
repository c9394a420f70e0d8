"""All legs over a gait cycle: torque by place in the chain, ground forces, stability."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from reports.errors import FigureError
from reports.figures.style import (
    CYCLE,
    INK,
    QUIET,
    headline,
    horizontal_grid,
    new_figure,
    number,
    styled,
    zero_line,
)

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
_COLORS = (*CYCLE, INK)
_AIR, _GROUND = 0.9, 2.0  # widths of lines


@dataclass(frozen=True)
class LegsStretch:
    """All legs during one segment, both ends included.

    Attributes:
        time: Shape (N,) [s].
        stance: Legs that stand.
        torque: Of every joint, shape (N, J) [N*m]; of sliding ones their force [N].
        normal: Force of the ground across it, by leg, shape (N, L) [N].
        friction: Tangential over normal force, NaN where none rests, shape (N, L).
        margin: Static stability, shape (N,) [m].
    """

    time: Array
    stance: tuple[str, ...]
    torque: Array
    normal: Array
    friction: Array
    margin: Array


@styled
def joint_torques_figure(
    stretches: Sequence[LegsStretch],
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
        joints: Columns of the torques.
        legs: Leg to its joints from the base outward; legs may differ in how many they have.
        sliding: Joints whose torque is a force.
        title: First line.
        subtitle: Second line.

    Raises:
        FigureError: Nothing to draw, or a joint that is no column.
    """
    if not stretches or not legs:
        raise FigureError(f"'{title}': no stretch or no leg to draw")
    placed = [joint for own in legs.values() for joint in own]
    unknown = [joint for joint in placed if joint not in joints]
    if unknown:
        raise FigureError(f"'{title}': no joint '{unknown[0]}' among the torques")
    others = [joint for joint in joints if joint not in placed]
    depth = max(len(own) for own in legs.values())
    rows = depth + bool(others)
    figure = new_figure(1.4 + 1.55 * rows)
    headline(figure, title, subtitle)
    panels = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    for k in range(depth):
        here = {leg: own[k] for leg, own in legs.items() if k < len(own)}
        for i, (leg, own) in enumerate(legs.items()):
            if k < len(own):
                _line(panels[k], stretches, _columns(stretches, joints, own[k]), leg, i)
        _label(panels[k], f"joint {k + 1}", [joint in sliding for joint in here.values()])
    for i, joint in enumerate(others):
        _line(panels[-1], stretches, _columns(stretches, joints, joint), "", i, dashed=True)
    if others:
        _label(panels[-1], "outside legs", [joint in sliding for joint in others])
    _finish(figure, list(panels), stretches, list(legs), others)
    return figure


@styled
def ground_forces_figure(
    stretches: Sequence[LegsStretch], legs: Sequence[str], *, title: str, subtitle: str = ""
) -> Figure:
    """Normal force and friction needed of every foot, and the margin of stability.

    Args:
        stretches: One period.
        legs: Columns of the forces.
        title: First line.
        subtitle: Second line.

    Raises:
        FigureError: Nothing to draw.
    """
    if not stretches or not legs:
        raise FigureError(f"'{title}': no stretch or no leg to draw")
    figure = new_figure(6.2)
    headline(figure, title, subtitle)
    panels = figure.subplots(3, 1, sharex=True, height_ratios=[1.5, 1.0, 1.0])
    for i, leg in enumerate(legs):
        _line(panels[0], stretches, [s.normal[:, i] for s in stretches], leg, i)
        _line(panels[1], stretches, [s.friction[:, i] for s in stretches], leg, i)
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


def _columns(stretches: Sequence[LegsStretch], joints: Sequence[str], joint: str) -> list[Array]:
    column = list(joints).index(joint)
    return [stretch.torque[:, column] for stretch in stretches]


def _line(
    axes: Axes,
    stretches: Sequence[LegsStretch],
    values: Sequence[Array],
    leg: str,
    index: int,
    dashed: bool = False,
) -> None:
    """One line through all stretches, broken where it jumps."""
    for stretch, value in zip(stretches, values, strict=True):
        axes.plot(
            stretch.time,
            value,
            color=_COLORS[index % len(_COLORS)],
            linewidth=_GROUND if leg in stretch.stance else _AIR,
            linestyle="--" if dashed else "-",
        )


def _label(axes: Axes, place: str, sliding: Sequence[bool]) -> None:
    kinds = {"force [N]" if one else "torque [N·m]" for one in sliding}
    axes.set_ylabel(f"{place}\n" + " or ".join(sorted(kinds)))
    zero_line(axes)


def _handles(words: Sequence[str], dashed: bool = False) -> list[Artist]:
    from matplotlib.lines import Line2D

    return [
        Line2D([], [], color=_COLORS[i % len(_COLORS)], ls="--" if dashed else "-", label=word)
        for i, word in enumerate(words)
    ]


def _finish(
    figure: Figure,
    panels: Sequence[Axes],
    stretches: Sequence[LegsStretch],
    legs: Sequence[str],
    others: Sequence[str] = (),
) -> None:
    for axes in panels:
        horizontal_grid(axes)
        axes.margins(y=0.12)
    panels[-1].set_xlim(float(stretches[0].time[0]), float(stretches[-1].time[-1]))
    panels[-1].set_xlabel("time [s]")
    figure.align_ylabels(list(panels))
    handles = _handles([leg.upper() for leg in legs]) + _handles(others, dashed=True)
    figure.legend(handles=handles, loc="outside lower center", ncols=min(8, len(handles)))
