"""The choice as a result: tables, three lines, and what its sidecars say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from actuators.loading.parts import load_parts
from pipeline.api.result import Result, by_name
from pipeline.api.tables import inputs_of, metadata
from pipeline.choice.break_even import known_candidate, rows
from pipeline.choice.choose import Chosen, Wanted, choose
from pipeline.choice.mission import read_mission
from pipeline.choice.tables import ROBOT, tables_of, words
from pipeline.progress import Progress
from reports.pages.choice_page import PartSource, write_choice_page
from reports.table import table_of
from reports.tables.choice import BreakEvenRow

if TYPE_CHECKING:
    from pipeline.api.machine import Machine


@dataclass(frozen=True, eq=False)
class Choice(Result):
    """What to build.

    Attributes:
        chosen: The search, with its arrays.
    """

    chosen: Chosen = field(repr=False)

    def _write(self, out: Path, decimal: str) -> None:
        """The page, too."""
        super()._write(out, decimal)
        parts = load_parts(self.chosen.wanted.parts)
        sources = {n: PartSource(p.title, p.basis, p.source, p.note) for n, p in parts.items()}
        title = f"Which actuators for a day of {self.chosen.machine.ready.robot.spec.name}"
        write_choice_page(self.tables, sources, self.lines, out, title=title)

    @property
    def lines(self) -> list[str]:
        """The answer in three lines."""
        rows = {row["group"]: row for row in self.table("answer").frame().to_dict("records")}
        robot = rows.pop(ROBOT)
        found = next(iter(self.chosen.found.values()))
        battery = ""
        if self.chosen.wanted.battery:
            battery = f", {robot['battery_h']:.3g} h on {self.chosen.wanted.battery:.4g} Wh"
        first = (
            f"{self.chosen.machine.ready.robot.spec.name}: {robot['power_W']:.4g} W "
            f"({robot['power_low_W']:.3g} to {robot['power_high_W']:.3g}), "
            f"{robot['energy_Wh_per_day']:.4g} Wh a day{battery}, "
            f"{robot['actuator_mass_kg']:.3g} kg of actuators; {len(found.designs)} designs a group"
        )
        each = [
            f"{group}: {words((row['motor'], row['gear'], row['brake']))} at {row['ratio']:.4g}:1 "
            f"({row['power_W']:.3g} W, "
            f"best in {100 * row['chance_best']:.0f} % of draws)"
            for group, row in rows.items()
        ]
        unknown = self.table("unknowns").frame()
        last = "nothing unprinted would change the choice"
        if len(unknown) and unknown["worth_W"][0] > 0.0:
            top = unknown.iloc[0]
            last = (
                f"measure next {top['part']}.{top['entry']} ({top['low']:.3g} to "
                f"{top['high']:.3g} {top['unit']}): worth {top['worth_W']:.2g} W of the expected "
                f"regret of {robot['regret_W']:.2g} W"
            )
        return [first, "; ".join(each), last]


def choice(
    machine: Machine,
    mission: str | Path,
    wanted: Wanted | None = None,
    *,
    compare: Sequence[str] = (),
    compare_joints: str = "*",
    progress: Progress | None = None,
) -> Choice:
    """Choose the actuators of a machine for a mission's file.

    Args:
        machine: From `load`.
        mission: CSV; see `pipeline.choice.mission`.
        wanted: What is searched and counted.
        compare: Two candidates for the table ``break_even``: alternatives of the machine's actuator
            files, or ``answer``.
        compare_joints: Pattern of the joints that count in it.
        progress: Told of each step.

    Raises:
        PipelineError: The mission cannot be used, or no design is within limits.
        ActuatorError: Parts cannot be read.
    """
    path = Path(mission)
    wanted = wanted or Wanted()
    for name in compare:
        known_candidate(machine, name)  # before the search: nothing is lost by a misspelt name
    chosen = choose(machine, read_mission(path), wanted, progress)
    tables = tables_of(chosen)
    if compare:
        idle = wanted.account.idle
        found = rows(machine, compare, idle=idle, chosen=chosen, joints=compare_joints)
        tables.append(table_of(BreakEvenRow, list(found)))
    given = machine.ready
    inputs: Sequence[Path] = (*inputs_of(given), path)
    return Choice("choose", by_name(tables), lambda: metadata(given), tuple(inputs), chosen)
