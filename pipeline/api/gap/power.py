"""What a machine's supply gives, held against the sum over its drives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipeline.api.gap.log_result import Common, LogResult
from pipeline.identification.compare.loaded import LoadedLogs
from pipeline.identification.supply.account import Account, account
from pipeline.identification.workflow.compared import judged
from pipeline.identification.workflow.setup import Options, Setup
from pipeline.logs.errors import Finding
from pipeline.progress import Progress
from reports.figures.bars import power_shares_figure
from reports.figures.gap import power_time_figure
from reports.figures.save import save_figure
from reports.figures.style import NARROW, WIDTH
from reports.pages.power_page import write_power_page
from reports.table import Table, table_of
from reports.tables.gap import QualityRow
from reports.tables.power import power_tables


@dataclass(frozen=True, eq=False)
class Powered(LogResult):
    """The supply's power, term by term."""

    account: Account  #: With every sample.

    @property
    def power(self) -> Table:
        """Mean power of every term with its interval, what is unexplained last."""
        return self.table("power")

    def _write(self, out: Path, decimal: str) -> None:
        super()._write(out, decimal)
        balance, robot = self.account, self.given.model.name
        write_power_figures(balance, robot, out)
        write_power_page(balance, robot, list(self.tables.values()), self.given.warnings, out)


def added_up(
    given: Setup,
    loaded: LoadedLogs,
    options: Options,
    progress: Progress,
    common: Callable[[Sequence[Table], Sequence[Finding]], Common],
) -> Powered:
    """The account of all logs' supply; `common` makes what every result begins with."""
    progress.step("adding up the drives")
    balance = account(given, loaded.prepared, len(options.holdout), options.prove_last)
    findings = judged(loaded).findings
    own = common([table_of(QualityRow, findings), *power_tables(balance)], findings)
    return Powered(*own, balance)


def write_power_figures(balance: Account, robot: str, out: Path) -> None:
    """Draw `power_in_time` of the first log and `power_shares`."""
    title = f"{robot}: power at the supply"
    save_figure(power_time_figure(balance, title=title), out, "power_in_time")
    title = f"{robot}: what the supply gives"
    for name, width in (("power_shares", WIDTH), ("power_shares_narrow", NARROW)):
        save_figure(power_shares_figure(balance.shares, title=title, width=width), out, name)
