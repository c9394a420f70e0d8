"""Measured logs against a machine: read, compare, identify, validate, drive; what each returns."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from actuators.errors import LegwattError
from pipeline.api.machine import Machine
from pipeline.api.result import Result
from pipeline.atomic import write_text
from pipeline.effects.model_file import edits_in
from pipeline.identification.compare.circumstances import overall
from pipeline.identification.supply.account import Account, account
from pipeline.identification.workflow.compared import Compared, compare_logs, judged, load_logs
from pipeline.identification.workflow.forward import Drive, by_model, rms
from pipeline.identification.workflow.forward import forward as drive_forward
from pipeline.identification.workflow.options import Options
from pipeline.identification.workflow.outcome import Outcome, identified
from pipeline.identification.workflow.setup import Setup, check_options, setup
from pipeline.identification.workflow.tables import (
    Tables,
    bodies,
    candidates_table,
    forward_tables,
    found_table,
    power_tables,
    records,
)
from pipeline.identification.workflow.validate import check
from pipeline.logs.errors import Finding
from pipeline.robot.urdf_source import read_urdf
from pipeline.simulation.found_bodies import FoundBodies, corrected_urdf, found_bodies, not_in_urdf
from reports.pages.gap_words import URDF_FILE

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True, eq=False)
class LogResult(Result):
    """What one step finds in logs."""

    given: Setup  #: The machine as the step computed it.
    findings: Sequence[Finding]  #: What the logs are worth.

    @property
    def quality(self) -> DataFrame:
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

    shown = "where"
    residuals: Compared  #: By joint and circumstance, with the predictions they rest on.

    @property
    def where(self) -> DataFrame:
        """The gap by joint and circumstance."""
        return self.table("where")

    def _write(self, out: Path, decimal: str) -> dict[str, Any]:
        from pipeline.api.gap.figures import write_where_map

        about = super()._write(out, decimal)
        model = self.given.model
        write_where_map(self.residuals.rows, model.joints, model.name, out)
        return about


@dataclass(frozen=True, eq=False)
class Identified(LogResult):
    """What the model lacks, and what it leaves once that is written into it."""

    shown = "found"
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
    def found(self) -> DataFrame:
        """Effects with parameters, intervals, levels, and whether the model holds them."""
        return self.table("found")

    @property
    def candidates(self) -> DataFrame:
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

    def _write(self, out: Path, decimal: str) -> dict[str, Any]:
        """The tables; but for ``name`` the model file; for all steps or ``shrink`` a page."""
        about = super()._write(out, decimal)
        files = {"model.toml": self.outcome.validated.text, URDF_FILE: self.bodies.urdf}
        for name, text in files.items() if self.verb != "gap name" else ():
            if text:
                write_text(out / name, text)
        if self.verb in ("gap", "gap shrink"):
            from pipeline.api.gap.figures import write_pictures_and_page

            write_pictures_and_page(self.outcome, self.bodies, self.tables, out)
        return about


@dataclass(frozen=True, eq=False)
class Driven(LogResult):
    """A model that drove itself under its servos' law."""

    shown = "forward"
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

    shown = "power"
    account: Account  #: With every sample.

    @property
    def power(self) -> DataFrame:
        """Mean power of every term with its interval, what is unexplained last."""
        return self.table("power")

    def _write(self, out: Path, decimal: str) -> dict[str, Any]:
        from pipeline.api.gap.figures import write_power_figures
        from reports.pages.gap_report import write_power_page

        about = super()._write(out, decimal)
        balance, robot = self.account, self.given.model.name
        write_power_figures(balance, robot, out)
        write_power_page(balance, robot, self.tables, self.given.warnings, out)
        return about


logger = logging.getLogger("legwatt")

Kind = TypeVar("Kind", bound=LogResult)


def read_log(
    path: str | Path, machine: Machine, *, mapping: str | Path | None = None, **options: Any
) -> MeasuredLog:
    """Read a log and judge what it is worth.

    Args:
        path: CSV or Parquet.
        machine: Whose log it is.
        mapping: Mapping file for foreign columns.
        **options: See `pipeline.identification.workflow.options.Options`.

    Raises:
        LegwattError: The log cannot be used; one line says which row or column and why.
    """
    return _analysed(MeasuredLog, "read", machine, [path], mapping=mapping, **options)


def compare(logs: Any, machine: Machine, **options: Any) -> Comparison:
    """Where a machine's logs and its model disagree.

    Args:
        logs: One or several, from `read_log` or by path.
        machine: The model.
        **options: See `pipeline.identification.workflow.options.Options`.

    Raises:
        LegwattError: A log cannot be used, or does not fit the machine.
    """
    return _analysed(Comparison, "where", machine, logs, **options)


def identify(logs: Any, machine: Machine, *, test: Any = (), **options: Any) -> Identified:
    """What the model lacks, from logs of the machine.

    Args:
        logs: To learn from, from `read_log` or by path.
        machine: The model.
        test: Logs that are held out: nothing is fitted to them.
        **options: See `pipeline.identification.workflow.options.Options`.

    Raises:
        LegwattError: A log cannot be used, or does not fit the machine.
    """
    return _analysed(Identified, "add", machine, logs, test, **options)


def validate(logs: Any, machine: Machine, **options: Any) -> Identified:
    """How much a machine's effects shrink the gap on logs, without naming anything.

    Args:
        logs: To hold the model against.
        machine: With effects: of a model file, or as `identify` returns it.
        **options: See `pipeline.identification.workflow.options.Options`.

    Raises:
        LegwattError: A log cannot be used, or the machine has no effects.
    """
    return _analysed(Identified, "shrink", machine, logs, **options)


def power(logs: Any, machine: Machine, *, test: Any = (), **options: Any) -> Powered:
    """What a machine's supply gives, against the sum over its drives.

    Args:
        logs: With samples of the supply, from `read_log` or by path.
        machine: With a motor in every joint.
        test: Logs that are held out: nothing is fitted to them.
        **options: See `pipeline.identification.workflow.options.Options`.

    Raises:
        LegwattError: A log has no power at the supply, or too few samples of it.
    """
    return _analysed(Powered, "power", machine, logs, test, **options)


def forward(logs: Any, machine: Machine, *, test: Any = (), **options: Any) -> Driven:
    """Let the model drive itself under its servos' law, and compare positions.

    Args:
        logs: On which tolerances are estimated.
        machine: Fixed base, a motor in every joint.
        test: Logs that are simulated; those of `logs` by default.
        **options: See `pipeline.identification.workflow.options.Options`.

    Raises:
        LegwattError: A log does not say what drives the servos.
    """
    return _analysed(Driven, "forward", machine, logs, test, **options)


def _analysed(
    kind: type[Kind],
    step: str,
    machine: Machine,
    logs: Any,
    test: Any = (),
    *,
    mapping: Any = None,
    **options: Any,
) -> Kind:
    """Run one step of `analyse` for a machine and its logs, from `read_log` or by path."""
    several = [[x] if isinstance(x, str | Path | MeasuredLog) else list(x) for x in (logs, test)]
    own = [log.mapping for log in (*several[0], *several[1]) if isinstance(log, MeasuredLog)]
    mapping = mapping or next((path for path in own if path), None)
    paths = [tuple(x.path if isinstance(x, MeasuredLog) else Path(x) for x in s) for s in several]
    asked = Options(
        paths[0],
        step=step,
        holdout=paths[1],
        robot=machine.path,
        gait=machine.files.gait,
        actuators=machine.files.actuators,
        changes=machine.changes,
        mapping=Path(mapping) if mapping else None,
        **options,
    )
    result = analyse(asked, machine=machine)
    assert isinstance(result, kind)
    return result


def analyse(options: Options, *, machine: Machine | None = None) -> LogResult:
    """Run one step, or all of them.

    Args:
        options: Of the run.
        machine: Where it was loaded; by the options otherwise.

    Raises:
        LegwattError: Unusable robot. Unusable actuators. Unusable log, mapping or model file.
    """
    files = machine.files if machine else None
    check_options(options, files)
    given = setup(options, files)
    if (options.out / URDF_FILE).resolve() in {source.resolve() for source in given.sources}:
        raise LegwattError(
            f"{options.out / URDF_FILE}: the robot's URDF lies where a corrected one is written; "
            "choose another folder with --out, or copy it elsewhere"
        )
    step, joints = options.step, given.model.joints
    logger.info("reading and judging the logs")
    loaded, parts, fitted = load_logs(given, options)
    if step in ("read", "power"):
        findings = judged(loaded).findings
        tables = {"quality": records("quality", findings)}
        if step == "read":
            common = _common(options, given, tables, findings)
            return MeasuredLog(**common, path=options.logs[0], mapping=options.mapping)
        logger.info("adding up the drives")
        balance = account(given, loaded.prepared, len(options.holdout), options.prove_last)
        tables |= power_tables(balance)
        return Powered(**_common(options, given, tables, findings), account=balance)
    logger.info("simulating the logs' motion")
    compared = compare_logs(given, given.model, loaded, parts, fitted)
    findings = compared.loaded.findings
    if step == "forward":
        logger.info("driving the model by its servos")
        drives = drive_forward(given, compared, options)
        tables = forward_tables(drives, joints)
        return Driven(**_common(options, given, tables, findings), drives=drives)
    tables = {
        "quality": records("quality", findings),
        "where": records("where", compared.rows),
    }
    if step == "where":
        return Comparison(**_common(options, given, tables, findings), residuals=compared)
    if step == "shrink":
        logger.info("validating the model file's effects")
        outcome = check(given, compared)
    else:
        outcome = identified(given, compared, options)
    text = outcome.validated.text
    edits = edits_in(text) if text else given.file.edits
    others = found_bodies(given.bare, edits)
    urdf = ""
    if text and others:
        source = given.robot.urdf if given.robot else read_urdf(given.path)
        urdf = corrected_urdf(source, str(given.path), given.bare, edits)
    found = FoundBodies(others, not_in_urdf(edits), urdf)
    naming = outcome.naming
    tables |= {
        "candidates": candidates_table(naming.candidates, naming.found, given.model),
        "found": found_table(naming.found, given.model),
        **({"bodies": bodies(others)} if others else {}),
    }
    common = _common(options, given, tables, findings)
    return Identified(**common, outcome=outcome, bodies=found, machine=machine)


def _common(
    options: Options, given: Setup, tables: Tables, findings: Sequence[Finding]
) -> dict[str, Any]:
    """What every result of a step begins with."""
    more = (options.mapping, options.gait, options.model)
    said = {
        "options": {
            "step": options.step,
            "set": [f"{key}={value}" for key, value in options.changes.items()],
            "base": options.base or "as the log and the robot say",
            "alternative": given.alternative or "none: the torque is the joint's",
            "effort": options.effort or "the log's most direct",
            "cutoff_Hz": options.cutoff,
            "gait_start_s": options.gait_start,
            "prove_last": options.prove_last,
        },
        "conventions": "SI units; torque, velocity, current and voltage positive in the joint's "
        "direction; gap is measured minus predicted",
        "warnings": list(given.warnings),
    }
    return {
        "verb": "gap" if options.step == "all" else f"gap {options.step}",
        "_tables": {name: partial(tables.__getitem__, name) for name in tables},
        "_said": said,
        "inputs": (*options.logs, *options.holdout, *given.sources, *filter(None, more)),
        "given": given,
        "findings": findings,
    }
