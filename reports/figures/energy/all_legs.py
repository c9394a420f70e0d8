"""All legs over a gait cycle: torque by place in the chain, ground forces, stability."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from reports.figures.stretch import Stretch
from reports.figures.style import (
    CYCLE,
    INK,
    QUIET,
    horizontal_grid,
    house_style,
    new_figure,
    number,
    zero_line,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
    figure = new_figure(1.4 + 1.55 * rows, title, subtitle)
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
    figure = new_figure(6.2, title, subtitle)
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
    figure.legend(handles=handles, loc="outside lower center", ncols=min(8, len(handles)))
