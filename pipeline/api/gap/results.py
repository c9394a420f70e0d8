"""What steps over measured logs return: tables, and what they were made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from pipeline.api.machine import Machine
from pipeline.api.result import Result
from pipeline.atomic import write_text
from pipeline.effects.model_file import edits_in
from pipeline.identification.compare.circumstances import overall
from pipeline.identification.supply.account import Account
from pipeline.identification.workflow.compared import Compared
from pipeline.identification.workflow.forward import Drive, by_model, rms
from pipeline.identification.workflow.outcome import Outcome
from pipeline.identification.workflow.setup import Setup
from pipeline.logs.errors import Finding
from pipeline.simulation.found_bodies import FoundBodies
from reports.pages.gap_words import URDF_FILE
from reports.table import Table


@dataclass(frozen=True, eq=False)
class LogResult(Result):
    """What one step finds in logs."""

    given: Setup  #: The machine as the step computed it.
    findings: Sequence[Finding]  #: What the logs are worth.

    @property
    def quality(self) -> Table:
        """What the logs are worth: one row per judgement."""
        return self.table("quality")


@dataclass(frozen=True, eq=False)
class MeasuredLog(LogResult):
    """A log that was read and judged."""

    path: Path  #: CSV or Parquet.
    mapping: Path | None  #: Mapping file for foreign columns; None without.


@dataclass(frozen=True, eq=False)
class Comparison(LogResult):
    """Where model and machine disagree."""

    residuals: Compared  #: By joint and circumstance, with the predictions they rest on.

    @property
    def where(self) -> Table:
        """The gap by joint and circumstance."""
        return self.table("where")

    def _write(self, out: Path, decimal: str) -> None:
        from pipeline.api.gap.figures import write_where_map

        super()._write(out, decimal)
        model = self.given.model
        write_where_map(self.residuals.rows, model.joints, model.name, out)


@dataclass(frozen=True, eq=False)
class Identified(LogResult):
    """What the model lacks, and what it leaves once that is written into it."""

    outcome: Outcome  #: Everything that the files say.
    bodies: FoundBodies  #: Those found to be others, and the corrected URDF.
    #: That was compared; None for the command line.
    machine: Machine | None = field(default=None, repr=False)

    @property
    def model(self) -> Machine:
        """The machine with what was found and written."""
        assert self.machine is not None
        text = self.outcome.validated.text
        if not text or self.verb == "gap shrink":
            return self.machine
        return self.machine.with_model(replace(self.given.file, edits=edits_in(text)))

    @property
    def found(self) -> Table:
        """Effects with parameters, intervals, levels, and whether the model holds them."""
        return self.table("found")

    @property
    def candidates(self) -> Table:
        """Every effect that was tried, with its verdict."""
        return self.table("candidates")

    @property
    def gap(self) -> tuple[float, float]:
        """Root mean square gap on held-out rows, before and with the model as written."""
        stages = self.outcome.validated.stages
        return overall(stages[0].gap), overall(stages[-1].gap)

    @property
    def unexplained(self) -> bool:
        """Whether more than noise is left, or the log may not say what it seems to."""
        return self.outcome.unexplained

    def _write(self, out: Path, decimal: str) -> None:
        """The tables; but for ``name`` the model file; for all steps or ``shrink`` a page."""
        super()._write(out, decimal)
        files = {"model.toml": self.outcome.validated.text, URDF_FILE: self.bodies.urdf}
        for name, text in files.items() if self.verb != "gap name" else ():
            if text:
                write_text(out / name, text)
        if self.verb in ("gap", "gap shrink"):
            from pipeline.api.gap.figures import write_pictures_and_page

            write_pictures_and_page(self.outcome, self.bodies, list(self.tables.values()), out)


@dataclass(frozen=True, eq=False)
class Driven(LogResult):
    """A model that drove itself under its servos' law."""

    drives: Sequence[Drive]  #: One for each log and model.

    @property
    def position_rms(self) -> float:
        """Root mean square position error with all effects [rad]."""
        return self.errors()[-1][1]

    def errors(self) -> list[tuple[str, float]]:
        """Models in order of their effects, each with its position error [rad]."""
        return [(model, rms(drives)) for model, drives in by_model(self.drives).items()]


@dataclass(frozen=True, eq=False)
class Powered(LogResult):
    """The supply's power, term by term."""

    account: Account  #: With every sample.

    @property
    def power(self) -> Table:
        """Mean power of every term with its interval, what is unexplained last."""
        return self.table("power")

    def _write(self, out: Path, decimal: str) -> None:
        from pipeline.api.gap.figures import write_power_figures
        from reports.pages.gap_report import write_power_page

        super()._write(out, decimal)
        balance, robot = self.account, self.given.model.name
        write_power_figures(balance, robot, out)
        write_power_page(balance, robot, list(self.tables.values()), self.given.warnings, out)
