"""What joints and feet of a run do over a gait cycle: torque, forces, footfall."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from actuators.arrays import Array, Mask
from pipeline.motion.gait import gait_of
from pipeline.simulation.machine import Machine
from pipeline.simulation.walk_stand import Standing, Walking
from reports.figures.style import (
    BLUE,
    CYCLE,
    INK,
    QUIET,
    house_style,
    key,
    new_figure,
    zero_line,
)
from reports.pages.robot_page import conditions, gait_and_conditions, short_titles, shown_leg

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from pandas import DataFrame


_COLORS = (*CYCLE, INK)
_AIR, _GROUND = 0.9, 2.0  # widths of lines
_THIN = "a line is thin while its leg is in the air"
#: Quantity to how its columns end, and the unit of each.
_ENDS = {
    "velocity": {"__velocity_rad_s": "rad/s", "__velocity_m_s": "m/s"},
    "torque": {"__torque_Nm": "N·m", "__torque_N": "N"},
}


@dataclass(frozen=True, eq=False)
class Run:
    """A machine that stood and walked, of which figures are drawn."""

    machine: Machine
    standing: Standing
    walking: Walking
    tables: Mapping[str, DataFrame]  #: Of both, by name.

    @property
    def name(self) -> str:
        """Robot and gait, which every figure names."""
        spec = self.machine.robot.spec
        return f"{spec.name}, {gait_and_conditions(spec)}"

    @cached_property
    def legs(self) -> dict[str, tuple[str, ...]]:
        """Leg to its joints from the base outward; legs may differ in how many they have."""
        return {leg.name: leg.joints for leg in self.machine.robot.spec.legs}

    @cached_property
    def titles(self) -> dict[str, str]:
        """Drivetrain option to its title."""
        return short_titles(self.machine.catalog)

    @cached_property
    def leg(self) -> str:
        """The leg whose stages are drawn."""
        return shown_leg(self.machine.robot)

    @cached_property
    def labels(self) -> dict[str, str]:
        """Joints of that leg to the labels of their panels."""
        return {joint: f"joint {n}" for n, joint in enumerate(self.legs[self.leg], start=1)}


@house_style()
def joint_demand_figure(run: Run) -> Figure:
    """Velocity and torque of every joint: a row for each place in the chain, a line for each leg.

    Joints outside the legs have a row of their own.
    """
    demand, contacts = run.tables["walking_joint_demand"], run.tables["walking_contact_forces"]
    legs, title = run.legs, "Velocity and torque of every joint over one cycle"
    depth = max(map(len, legs.values()))
    rows = {
        f"joint {k + 1}": [(leg, own[k]) for leg, own in legs.items() if k < len(own)]
        for k in range(depth)
    }
    known = {joint for own in legs.values() for joint in own}
    every = [
        c.removesuffix(end) for c in map(str, demand) for end in _ENDS["torque"] if c.endswith(end)
    ]
    if others := [("", joint) for joint in every if joint not in known]:
        rows["outside legs"] = others
    figure = new_figure(1.5 + 1.3 * len(rows), title, f"{run.name}; {_THIN}")
    panels = figure.subplots(len(rows), 2, sharex=True, squeeze=False)
    time = demand["time_s"].to_numpy()
    for pair, (place, row) in zip(panels, rows.items(), strict=True):
        for axes, (quantity, ends) in zip(pair, _ENDS.items(), strict=True):
            units = set()
            for i, (leg, joint) in enumerate(row):
                end = next(end for end in ends if f"{joint}{end}" in demand)
                units.add(ends[end])
                at = [*legs].index(leg) if leg else i
                values = demand[f"{joint}{end}"].to_numpy()
                down = contacts[f"{leg}__contact"].to_numpy() > 0 if leg else time >= 0
                _line(axes, time, values, down, leg or joint, at)
            axes.set_ylabel(f"{' or '.join(sorted(units))}")
            axes.set_title(f"{place}, {quantity}", fontsize=8.5)
            zero_line(axes)
    _finish(figure, time)
    return figure


@house_style()
def ground_forces_figure(run: Run) -> Figure:
    """Vertical force on every foot, and the friction that it needs."""
    contacts = run.tables["walking_contact_forces"]
    figure = new_figure(3.9, "Ground forces", f"{run.name}; {_THIN}")
    panels = figure.subplots(2, 1, sharex=True, height_ratios=[1.5, 1.0])
    time = contacts["time_s"].to_numpy()
    for i, leg in enumerate(run.legs):
        down = contacts[f"{leg}__contact"].to_numpy() > 0
        for axes, name in zip(panels, ("force_z_N", "friction_needed"), strict=True):
            _line(axes, time, contacts[f"{leg}__{name}"].to_numpy(), down, leg, i)
    for axes, word in zip(panels, ("vertical force [N]", "friction\nneeded [1]"), strict=True):
        axes.set_ylabel(word)
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    _finish(figure, time)
    return figure


@house_style()
def gait_figure(run: Run) -> Figure:
    """Foot paths from above, in the base frame, and when each foot stands."""
    contacts, spec = run.tables["walking_contact_forces"], run.machine.robot.spec
    places = [part.position for part in run.walking.demand.contacts if part is not None]
    feet = dict(zip(run.legs, np.moveaxis(np.concatenate(places), 1, 0), strict=True))
    gait = gait_of(spec)
    path = "; ".join((f"transfer path '{gait.table.transfer_path}'", *conditions(spec)))
    figure = new_figure(3.6 + 0.17 * len(feet), f"{spec.name}: {gait.title}", path)
    paths, fall = figure.subplots(2, 1, height_ratios=[2.4, 0.4 + 0.17 * len(feet)])
    time = contacts["time_s"].to_numpy()
    for row, (leg, path) in enumerate(feet.items()):
        down, color = contacts[f"{leg}__contact"].to_numpy() > 0, _COLORS[row % len(_COLORS)]
        for piece in _pieces(time, down):
            width = 3.5 if down[piece[0]] else _AIR
            paths.plot(*path[piece, :2].T, color=color, linewidth=width)
            if down[piece[0]]:
                ends = time[piece[[0, -1]]]
                fall.barh(row, ends[1] - ends[0], left=ends[0], height=0.62, color=BLUE)
        # Its name, on the side of the base: outside are title and axis.
        (left, low), (right, high) = path[:, :2].min(axis=0), path[:, :2].max(axis=0)
        y, gap, va = (low, -5, "top") if low + high >= 0 else (high, 5, "bottom")
        paths.annotate(leg.upper(), (0.5 * (left + right), y), (0, gap), ha="center", va=va,
                       textcoords="offset points", fontweight="bold", color=color)  # fmt: skip
    paths.plot(0, 0, "+", color=INK)
    paths.set_aspect("equal", adjustable="datalim")
    paths.margins(0.15)
    paths.set(xlabel="x, ahead [m]", ylabel="y, left [m]")
    paths.set_title("foot paths from above, about the base; bold on the ground", color=QUIET)
    fall.grid(False)
    fall.set_yticks(range(len(feet)), [leg.upper() for leg in feet])
    fall.set_ylim(len(feet) - 0.4, -0.6)
    fall.set_title("foot on the ground", color=QUIET)
    fall.set_xlim(time[0], time[-1])
    fall.set_xlabel("time [s]")
    return figure


def _pieces(time: Array, down: Mask) -> list[Array]:
    """Samples between jumps: a time that repeats, or a foot that comes or goes."""
    new = (np.diff(time) <= 0) | (np.diff(down.astype(int)) != 0)
    return np.split(np.arange(time.size), np.flatnonzero(new) + 1)


def _line(axes: Axes, time: Array, values: Array, down: Mask, name: str, index: int) -> None:
    """A line that is broken where it jumps, bold where its leg is on the ground."""
    for k, piece in enumerate(_pieces(time, down)):
        axes.plot(
            time[piece],
            values[piece],
            color=_COLORS[index % len(_COLORS)],
            linewidth=_GROUND if down[piece[0]] else _AIR,
            label="" if k else name.upper(),
        )


def _finish(figure: Figure, time: Array) -> None:
    """One axis of time below all panels; a key of every line that has a name."""
    for axes in figure.axes:
        axes.set_xlim(time[0], time[-1])
        if axes.xaxis.get_tick_params()["labelbottom"]:  # of the last row
            axes.set_xlabel("time [s]")
    figure.align_ylabels()
    for handle in key(figure, 6).get_lines():
        handle.set_linewidth(_GROUND)
