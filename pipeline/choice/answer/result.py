"""The choice as a result: tables, three lines, and what its sidecars say."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pandas as pd

from actuators.loading.parts import load_parts
from actuators.supply import HOUR
from pipeline.choice.answer.tables import ROBOT, tables_of, words
from pipeline.choice.asked import ChooseOptions
from pipeline.choice.choose import Chosen, choose
from pipeline.choice.full import lasting
from pipeline.choice.missions.mission import read_mission
from pipeline.columns import frame
from pipeline.result import Result
from reports.pages.choice_page import PartSource, write_choice_page

if TYPE_CHECKING:
    from pipeline.simulation.machine import Machine

#: What the break-even compares.
_PAIR: Final = (
    "of the best robot that locks and the best that can be driven back, both chosen at this day's "
    "share of standing,"
)
#: The day that comes with the project, of any walking robot.
DAY: Final = Path(__file__).parents[1] / "missions" / "day.csv"
#: Predicted over measured power of robots that others measured, by `python -m tests.measured`.
MEASURED: Final = Path(__file__).parents[1] / "measured_robots.csv"


@dataclass(frozen=True, eq=False)
class Choice(Result):
    """What to build."""

    chosen: Chosen = field(repr=False)  #: The search, with its arrays.

    def _write(self, out: Path, decimal: str) -> dict[str, Any]:
        """The page, too."""
        about = super()._write(out, decimal)
        parts = load_parts(self.chosen.wanted.parts)
        sources = {n: PartSource(p.title, p.basis, p.source, p.note) for n, p in parts.items()}
        title = f"Which actuators for a day of {self.chosen.asked.machine.robot.spec.name}"
        robots = pd.read_csv(MEASURED)
        write_choice_page(self.tables, sources, self.lines, out, title=title, measured=robots)
        return about

    def __str__(self) -> str:
        """The answer in three lines."""
        return "\n".join(self.lines)

    @property
    def front(self) -> pd.DataFrame:
        """Robots of which none is both lighter and takes less."""
        return self.table("front")

    @property
    def lines(self) -> list[str]:
        """The answer, each group's actuator, what to measure, how far to trust watts."""
        rows = {row["group"]: row for row in self.table("answer").to_dict("records")}
        robot = rows.pop(ROBOT)
        found = next(iter(self.chosen.found.values()))
        battery = self.chosen.battery
        lasts = f"{robot['battery_h']:.3g} h on {battery.energy / HOUR:.4g} Wh of {battery.name}"
        first = (
            f"{self.chosen.asked.machine.robot.spec.name}: {robot['power_W']:.4g} W "
            f"({robot['power_low_W']:.3g} to {robot['power_high_W']:.3g}), "
            f"{robot['energy_Wh_per_day']:.4g} Wh a day, {lasts}, "
            f"{robot['actuator_mass_kg']:.3g} kg of actuators; {len(found.designs)} designs a group"
        )
        each = [
            f"{group}: {words((row['motor'], row['gear'], row['brake']))} at {row['ratio']:.4g}:1 "
            f"({row['power_W']:.3g} W, "
            f"best in {100 * row['chance_best']:.0f} % of draws)"
            for group, row in rows.items()
        ]
        unknown = self.table("unknowns")
        last = "nothing that is not at hand would change the choice"
        if len(unknown) and unknown["worth_W"][0] > 1e-6:
            top = unknown.iloc[0]
            unit = "" if top["unit"] == "1" else f" {top['unit']}"
            last = (
                f"measure next {top['part']}.{top['entry']} ({top['low']:.3g} to "
                f"{top['high']:.3g}{unit}): worth {top['worth_W']:.2g} W of the expected "
                f"regret of {robot['regret_W']:.2g} W"
            )
        lighter = [row for row in self.table("answers").to_dict("records")[1:]]
        others = "; ".join(
            f"{row['answer']} {row['power_W']:.3g} W with {row['actuator_mass_kg']:.3g} kg"
            for row in lighter
        )
        each.append(f"on the same front: {others}")
        return [first, "; ".join(each), last + self._even, trust(pd.read_csv(MEASURED))]

    @property
    def _even(self) -> str:
        """From which share of standing on the best that locks takes less."""
        if "reversible_or_not" not in self.tables:
            return ""
        back, locks = self.table("reversible_or_not").to_dict("records")
        if pd.isna(even := back["break_even"]):
            less = "less" if locks["power_W"] < back["power_W"] else "more"
            return f"; {_PAIR} the one that locks takes {less} at every share"
        side = "above" if locks["standing_W"] < back["standing_W"] else "below"
        return f"; {_PAIR} the one that locks takes less {side} {100 * even:.3g} %"


def trust(measured: pd.DataFrame) -> str:
    """How far to trust watts: predicted over measured power of robots that others measured."""
    watts = measured[measured["unit"] == "W"]
    low, high = watts["likeliest"].min(), watts["likeliest"].max()
    return (
        f"watts of walking robots that others measured came out {low:.2g} to {high:.2g} times as "
        f"measured ({len(watts)} quantities of {watts['robot'].nunique()} robots, at their "
        "likeliest inputs); ratios between designs are better known than watts"
    )


def choice(
    machine: Machine,
    mission: str | Path = DAY,
    **options: Any,
) -> Choice:
    """Choose the actuators of a machine for a mission's file.

    Args:
        machine: From `load`.
        mission: CSV; see `pipeline.choice.missions.mission`; the day that comes with the project
            by default.
        **options: What is searched and counted; see `pipeline.choice.asked.ChooseOptions`.

    Raises:
        LegwattError: The mission cannot be used, or no design is within limits. Parts cannot be
            read.
    """
    path = Path(mission)
    wanted = ChooseOptions.of(**options)
    chosen = choose(machine, read_mission(path), wanted)
    tables = tables_of(chosen)
    tables["answers"] = frame("answers", pick_rows(chosen))
    if sides := side_rows(chosen):
        tables["reversible_or_not"] = frame("reversible_or_not", sides)
    inputs = (*machine.inputs, path)
    computed = {name: partial(tables.__getitem__, name) for name in tables}
    return Choice("choose", computed, machine.record, inputs, chosen)


def pick_rows(chosen: Chosen) -> list[dict[str, Any]]:
    """Least power, lightest and knee, each in full chains with its own mass."""
    rows = []
    hours = np.array([load.mode.hours for load in chosen.loads])
    for name, (robot, loads) in chosen.picks.items():
        day = chosen.through(robot, loads)
        demanded = chosen.asked.demanded(loads)
        designs = {g: chosen.shelf.designs([design]) for g, design in robot.items()}
        use = {
            f"{limit} of {g}": float(share[0])
            for g, d in designs.items()
            for limit, share in demanded[g].limits(d).items()
        }
        nearest = max(use, key=lambda limit: use[limit])
        battery = chosen.asked.battery(robot)
        rows.append(
            dict(
                answer=name,
                power_W=float(np.array([full.total for full in day]) @ hours / hours.sum()),
                actuator_mass_kg=sum(
                    float(d.mass[0]) * len(demanded[g].joints) for g, d in designs.items()
                ),
                battery_h=lasting(battery, day, chosen.least_voltage),
                nearest_limit=nearest,
                limit_use=use[nearest],
                design="; ".join(f"{g}: {words(robot[g])}" for g in designs),
            )
        )
    return rows


def side_rows(chosen: Chosen) -> list[dict[str, Any]]:
    """Both, in full chains; none if the day has no standing or no motion, or both are one.

    The power of all modes that move, and of all that stand, keeps its mean while their shares
    change; each robot carries its own actuators.
    """
    hours = np.array([load.mode.hours for load in chosen.loads])
    stands = np.array([load.mode.stands for load in chosen.loads])
    (one, _), (two, _) = chosen.sides.values()
    if stands.all() or not stands.any() or one == two:
        return []
    share = float(hours[stands].sum() / hours.sum())
    rows = []
    for name, (robot, loads) in chosen.sides.items():
        power = np.array([full.total for full in chosen.through(robot, loads)])
        moving, standing = (
            float(power[at] @ hours[at] / hours[at].sum()) for at in (~stands, stands)
        )
        demanded = chosen.asked.demanded(loads)
        designs = {g: chosen.shelf.designs([design]) for g, design in robot.items()}
        limits = [demanded[g].limits(design) for g, design in designs.items()]
        mass = sum(float(d.mass[0]) * len(demanded[g].joints) for g, d in designs.items())
        row: dict[str, Any] = dict(
            candidate=name,
            moving_W=moving,
            standing_W=standing,
            power_W=(1.0 - share) * moving + share * standing,
            actuator_mass_kg=mass,
            limit_use=max(float(use[0]) for own in limits for use in own.values()),
            standing_share=share,
            break_even=None,
            design="; ".join(f"{g}: {words(robot[g])}" for g in designs),
        )
        rows.append(row)
    first, second = rows
    moving = second["moving_W"] - first["moving_W"]
    standing = second["standing_W"] - first["standing_W"]
    # Both take the same at f where (1 - f) moving + f standing = 0.
    even = moving / (moving - standing) if moving * standing < 0.0 else None
    return [row | {"break_even": even} for row in rows]
