"""The choice as a result: tables, lines, page."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pandas as pd

from actuators.energy import HOUR
from actuators.loading.parts import Part
from pipeline.choice.choose import Chosen, choose
from pipeline.choice.mission import read_mission
from pipeline.choice.options import ChooseOptions
from pipeline.choice.standing import crossing_range
from pipeline.choice.tables import tables_of
from pipeline.result import Result, of_table
from reports.pages.choice_page import write_choice_page

if TYPE_CHECKING:
    from pipeline.simulation.machine import Machine

#: The day that comes with the project, of any walking robot.
DAY: Final = Path(__file__).with_name("day.csv")
#: Measured over predicted power of robots that others measured, by `python -m tests.measured`.
MEASURED: Final = Path(__file__).with_name("measured_robots.csv")


@dataclass(frozen=True, eq=False)
class Choice(Result):
    """What to build."""

    chosen: Chosen = field(repr=False)  #: The search, with its arrays.

    def _write(self, out: Path) -> dict[str, Any]:
        """The page, too."""
        about = super()._write(out)
        rows = {n: (_bought(p), p.basis, p.source, p.note) for n, p in self._parts.items()}
        robots = pd.read_csv(MEASURED)
        span, words = trust(robots)
        write_choice_page(
            self.tables,
            pd.DataFrame(rows, ["title", "basis", "source", "note"]).T,
            out,
            title=f"Which actuators for a day of {self.chosen.problem.machine.robot.spec.name}",
            trust=(span, f"{words[:1].upper()}{words[1:]}."),
            buy=self.buy,
            notes=[f"{line[:1].upper()}{line[1:]}." for line in self.notes],
            measured=robots,
        )
        return about

    def __str__(self) -> str:
        """The answer in a few lines."""
        return "\n".join(self.lines).replace("**", "")

    front = of_table("front")  #: Robots of which none is both lighter and takes less.

    @property
    def _parts(self) -> dict[str, Part]:
        """Those that tables name, and others."""
        problem = self.chosen.problem
        return {**problem.shelf.parts, problem.pack.name: problem.pack}

    @property
    def buy(self) -> list[str]:
        """The actuators of each group, and the drivers."""
        *groups, robot = self.table("answer").to_dict("records")
        names = [[row[k] for k in ("motor", "gear", "brake") if row[k]] for row in groups]
        each = [
            f"{row['joints']} × {' + '.join(f'**{_bought(self._parts[n])}**' for n in own)} for "
            f"{row['group']}, {row['ratio']:.4g}:1 ({row['power_W']:.3g} W; {row['fit']}; "
            f"{' + '.join(own)})"
            for row, own in zip(groups, names, strict=True)
        ]
        driver = f"{robot['joints']} × **{self._parts[robot['driver']].title}**, a driver each"
        return [*each, driver]

    @property
    def lines(self) -> list[str]:
        """The answer, what to buy, the others of the front, what to measure, trust."""
        chosen, best = self.chosen, self.chosen.best
        robot = self.table("answer").iloc[-1]
        own, *answers = self.table("answers").to_dict("records")
        first = (
            f"{chosen.problem.machine.robot.spec.name}, {chosen.name}: {robot['power_W']:.3g} W "
            f"({robot['power_low_W']:.3g} to {robot['power_high_W']:.3g}), "
            f"{robot['battery_h']:.3g} h on {best.battery.energy / HOUR:.3g} Wh of "
            f"{chosen.problem.pack.title} at {best.full.parts[0].bus[0]:.3g} V, "
            f"{robot['actuator_mass_kg']:.3g} kg of actuators in a robot of "
            f"{own['robot_mass_kg']:.3g} kg{_aside(own['price_EUR'], own['chance_least'])}"
        )
        others = "; ".join(
            f"{row['answer']} {row['power_W']:.3g} W with {row['actuator_mass_kg']:.3g} kg"
            f"{_aside(row['price_EUR'], row['chance_least'])}"
            for row in answers
        )
        said = trust(pd.read_csv(MEASURED))[1]
        return [first, *self.buy, f"beside it: {others}", *self.notes, said]

    @property
    def notes(self) -> list[str]:
        """What the answer supposes, what was left out, and what to measure."""
        problem, battery = self.chosen.problem, self.chosen.best.battery
        usual = " (assumed: a fifth of the robot, as two that state it)" * problem.assumed
        held = (
            f"the bodies of the robot's file count as holding {problem.present:.3g} kg of every "
            f"actuator{usual} and {problem.held_battery:.3g} of the battery's {battery.mass:.3g} "
            "kg already; `present` and `present_battery` say otherwise"
        )
        wrong = [f"left out is {name}: {why}" for name, why in problem.left_out.items()]
        return [held, *wrong, self._unknown, *self._standing]

    @property
    def _unknown(self) -> str:
        """What to measure next: what moves the answer's watts most."""
        top, parts = self.table("unknowns").iloc[0], self._parts
        unit = "" if top["unit"] == "1" else f" {top['unit']}"
        name = parts[top["part"]].title if top["part"] in parts else top["part"]
        return (
            f"measure next {top['entry'].replace('_', ' ')} of {name} ({top['low']:.3g} to "
            f"{top['high']:.3g}{unit}): it moves the answer by {abs(top['sensitivity_W']):.3g} W, "
            f"{100 * top['variance_share']:.3g} % of the variance"
        )

    @property
    def _standing(self) -> list[str]:
        """From which share of standing on joints that lock take less."""
        own = self.chosen.envelope
        if own is None or len(own.power) < 3:
            return []
        rule = (
            "with robots chosen anew at every share of standing, brakes closed and drivers of "
            "locked joints off while it stands"
        )
        if not self.chosen.problem.wanted.unlisted:
            rule += ", and brakes as they are built into servos"
        if own.crossing is None:
            return [f"{rule}, one kind takes less at every share"]
        span = crossing_range(self.chosen.search, self.chosen.monte_carlo)
        ends = f" ({100 * span[0]:.0f} to {100 * span[1]:.0f} in the draws)" if span else ""
        share = f"{100 * own.crossing:.0f} %{ends}"
        return [f"{rule}, joints that lock take less from {share} of standing on"]


def _bought(part: Part) -> str:
    """Its product's name, and inside which other product alone it is sold."""
    return f"{part.title} (sold inside {part.built_into} alone)" if part.built_into else part.title


def _aside(price: float, chance: float) -> str:
    words = "" if pd.isna(price) else f", {price:.0f} EUR without drivers"
    return words + f", takes least in {100 * chance:.0f} % of the draws" * pd.notna(chance)


def trust(measured: pd.DataFrame) -> tuple[str, str]:
    """How far to trust watts: measured over predicted power of robots that others measured."""
    watts = measured[measured["unit"] == "W"]
    span = f"{watts['likeliest'].min():.2g} to {watts['likeliest'].max():.2g} times"
    return span, (
        f"walking robots that others measured took {span} the watts that this model gives them "
        f"({len(watts)} quantities of {watts['robot'].nunique()} robots); ratios between designs "
        "are better known"
    )


def choice(machine: Machine, mission: str | Path = DAY, **options: Any) -> Choice:
    """Choose the actuators of a machine for a mission's file.

    `mission`: CSV; see `pipeline.choice.mission`; the day that comes with the project by default.
    `options`: what is searched and counted; see `pipeline.choice.options.ChooseOptions`.

    Raises:
        LegwattError: The mission or parts cannot be used, or no robot is within limits.
    """
    path = Path(mission)
    chosen = choose(machine, read_mission(path), ChooseOptions.of(**options))
    computed = {name: partial(lambda own: own, own) for name, own in tables_of(chosen).items()}
    return Choice("choose", computed, machine.record, (*machine.inputs, path), chosen)
