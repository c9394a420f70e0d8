"""What a machine's supply gives, held against the sum over its drives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.api.gap_tables import quality_table
from pipeline.api.logs import Common, LogResult, analysed
from pipeline.api.machine import Machine
from pipeline.identification.compare.intake import Intake
from pipeline.identification.supply.account import (
    BASIS_FOUND,
    MEASURED,
    Account,
    account,
)
from pipeline.identification.workflow.locate import judged
from pipeline.identification.workflow.options import Options
from pipeline.identification.workflow.setup import Setup
from pipeline.logs.quality.finding import Finding
from pipeline.progress import Progress
from reports.figures.gap.power import (
    PowerBar,
    PowerTrace,
    power_shares_figure,
    power_time_figure,
)
from reports.figures.save import save_figure
from reports.figures.style import NARROW, WIDTH
from reports.pages.power_page import write_power_page
from reports.table import Table
from reports.tables.power import power_tables


@dataclass(frozen=True, eq=False)
class Powered(LogResult):
    """The supply's power, term by term.

    Attributes:
        account: With every sample.
    """

    account: Account

    @property
    def power(self) -> Table:
        """Mean power of every term with its interval, what is unexplained last."""
        return self.table("power")

    def _write(self, out: Path, decimal: str) -> None:
        super()._write(out, decimal)
        told, robot = self.account, self.given.model.name
        write_power_figures(told, robot, out)
        write_power_page(told, robot, list(self.tables.values()), self.given.warnings, out)


def added_up(
    given: Setup,
    intake: Intake,
    options: Options,
    progress: Progress,
    common: Callable[[Sequence[Table], Sequence[Finding]], Common],
) -> Powered:
    """The account of all logs' supply; `common` makes what every result begins with."""
    progress.step("adding up the drives")
    told = account(given, intake.prepared, len(options.holdout), options.prove_last)
    findings = judged(intake).findings
    own = common([quality_table(findings), *power_tables(told)], findings)
    return Powered(*own, told)


def power(logs: Any, machine: Machine, *, test: Any = (), **options: Any) -> Powered:
    """What a machine's supply gives, against the sum over its drives.

    Args:
        logs: With samples of the supply, from `read_log` or by path.
        machine: With a motor in every joint.
        test: Logs that are held out: nothing is fitted to them.
        **options: See `pipeline.identification.workflow.options.Options`.

    Raises:
        GapError: A log has no power at the supply, or too few samples of it.
    """
    result = analysed("power", machine, logs, test, **options)
    assert isinstance(result, Powered)
    return result


def write_power_figures(told: Account, robot: str, out: Path) -> None:
    """Draw `power_in_time` of the first log and `power_shares`."""
    own = told.rows.log == 0
    trace = PowerTrace(
        told.rows.end[own],
        told.rows.power[own],
        told.rows.predicted[own],
        told.explained[own],
        told.proves[own],
    )
    subtitle = f"log '{told.logs[0]}', {np.count_nonzero(own)} samples; shaded: held-out samples"
    title = f"{robot}: power at the supply"
    save_figure(power_time_figure(trace, title=title, subtitle=subtitle), out, "power_in_time")
    kinds = {BASIS_FOUND: "found", "": "left"}
    bars = [
        PowerBar(
            s.term.replace("_", " "),
            s.watts,
            s.watts_low,
            s.watts_high,
            kinds.get(s.basis, "model"),
        )
        for s in told.shares
        if s.term != MEASURED
    ]
    measured = next(s.watts for s in told.shares if s.term == MEASURED)
    for name, width in (("power_shares", WIDTH), ("power_shares_narrow", NARROW)):
        figure = power_shares_figure(
            bars,
            measured,
            title=f"{robot}: what the supply gives",
            subtitle="blue: by log and model; green: found; orange: unexplained",
            width=width,
        )
        save_figure(figure, out, name)
