"""Measured logs against a machine: read, compare, identify, validate, drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pipeline.api.gap.bodies import bodies_of, refuse_own_urdf, write_model
from pipeline.api.gap.log_result import Common, LogResult
from pipeline.api.gap.meta import inputs_of, metadata
from pipeline.api.gap.power import Powered, added_up
from pipeline.api.gap.tables import (
    candidates_table,
    forward_table,
    found_table,
    rollout_tables,
)
from pipeline.api.machine import Machine
from pipeline.api.result import by_name
from pipeline.effects.model_file import edits_in
from pipeline.identification.compare.stages import overall
from pipeline.identification.workflow.compared import Compared, compare_logs, judged, load_logs
from pipeline.identification.workflow.forward import Drive, by_model, rms
from pipeline.identification.workflow.forward import forward as drive_forward
from pipeline.identification.workflow.outcome import Outcome, identified
from pipeline.identification.workflow.setup import Options, Setup, check_options, setup
from pipeline.identification.workflow.validate import check
from pipeline.logs.errors import Finding
from pipeline.logs.formats.convert import plain
from pipeline.progress import Progress
from pipeline.simulation.files import Files
from pipeline.simulation.found_bodies import FoundBodies
from reports.table import Table, table_of
from reports.tables.gap import QualityRow, WhereRow, bodies, deciding_motion


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
    #: ``name`` saves tables, ``add`` the model file with them, others pictures and a page.
    step: str
    #: That was compared; None for the command line.
    machine: Machine | None = field(default=None, repr=False)

    @property
    def model(self) -> Machine:
        """The machine with what was found and written."""
        assert self.machine is not None
        text = self.outcome.validated.text
        if not text or self.step == "shrink":
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
        super()._write(out, decimal)
        if self.step != "name":
            write_model(out, self.outcome.validated.text, self.bodies)
        if self.step in ("all", "shrink"):
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


def read_log(
    path: str | Path, machine: Machine, *, mapping: str | Path | None = None, **options: Any
) -> MeasuredLog:
    """Read a log and judge what it is worth.

    Args:
        path: CSV or Parquet.
        machine: Whose log it is.
        mapping: Mapping file for foreign columns.
        **options: See `pipeline.identification.workflow.setup.Options`.

    Raises:
        GapError: The log cannot be used; one line says which row or column and why.
    """
    result = analysed("read", machine, [path], mapping=mapping, **options)
    assert isinstance(result, MeasuredLog)
    return result


def compare(logs: Any, machine: Machine, **options: Any) -> Comparison:
    """Where a machine's logs and its model disagree.

    Args:
        logs: One or several, from `read_log` or by path.
        machine: The model.
        **options: See `pipeline.identification.workflow.setup.Options`.

    Raises:
        GapError: A log cannot be used, or does not fit the machine.
    """
    result = analysed("where", machine, logs, **options)
    assert isinstance(result, Comparison)
    return result


def identify(logs: Any, machine: Machine, *, test: Any = (), **options: Any) -> Identified:
    """What the model lacks, from logs of the machine.

    Args:
        logs: To learn from, from `read_log` or by path.
        machine: The model.
        test: Logs that are held out: nothing is fitted to them.
        **options: See `pipeline.identification.workflow.setup.Options`.

    Raises:
        GapError: A log cannot be used, or does not fit the machine.
    """
    result = analysed("add", machine, logs, test, **options)
    assert isinstance(result, Identified)
    return replace(result, machine=machine)


def validate(logs: Any, machine: Machine, **options: Any) -> Identified:
    """How much a machine's effects shrink the gap on logs, without naming anything.

    Args:
        logs: To hold the model against.
        machine: With effects: of a model file, or as `identify` returns it.
        **options: See `pipeline.identification.workflow.setup.Options`.

    Raises:
        GapError: A log cannot be used, or the machine has no effects.
    """
    result = analysed("shrink", machine, logs, **options)
    assert isinstance(result, Identified)
    return replace(result, machine=machine)


def power(logs: Any, machine: Machine, *, test: Any = (), **options: Any) -> Powered:
    """What a machine's supply gives, against the sum over its drives.

    Args:
        logs: With samples of the supply, from `read_log` or by path.
        machine: With a motor in every joint.
        test: Logs that are held out: nothing is fitted to them.
        **options: See `pipeline.identification.workflow.setup.Options`.

    Raises:
        GapError: A log has no power at the supply, or too few samples of it.
    """
    result = analysed("power", machine, logs, test, **options)
    assert isinstance(result, Powered)
    return result


def forward(logs: Any, machine: Machine, *, test: Any = (), **options: Any) -> Driven:
    """Let the model drive itself under its servos' law, and compare positions.

    Args:
        logs: On which tolerances are estimated.
        machine: Fixed base, a motor in every joint.
        test: Logs that are simulated; those of `logs` by default.
        **options: See `pipeline.identification.workflow.setup.Options`.

    Raises:
        GapError: A log does not say what drives the servos.
    """
    result = analysed("forward", machine, logs, test, **options)
    assert isinstance(result, Driven)
    return result


def analysed(
    step: str, machine: Machine, logs: Any, test: Any = (), *, mapping: Any = None, **options: Any
) -> LogResult:
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
    return analyse(asked, files=machine.files)


def analyse(
    options: Options, progress: Progress | None = None, *, files: Files | None = None
) -> LogResult:
    """Run one step, or all of them.

    Args:
        options: Of the run.
        progress: Told what is being done.
        files: What names the machine, where it was read; by the options otherwise.

    Raises:
        PipelineError: Unusable robot.
        ActuatorError: Unusable actuators.
        GapError: Unusable log, mapping or model file.
    """
    progress = progress or Progress()
    check_options(options, files)
    progress.step("reading foreign files")
    logs = (*options.logs, *options.holdout)
    for k, path in enumerate(logs):
        plain(path, lambda share, k=k: progress.done((k + share) / len(logs)))  # type: ignore[misc]
    given = setup(options, files)
    refuse_own_urdf(given, options.out)
    step = options.step

    def common(tables: Sequence[Table], findings: Sequence[Finding]) -> Common:
        verb = "gap" if step == "all" else f"gap {step}"
        inputs = tuple(inputs_of(options, given))
        return verb, by_name(tables), lambda: metadata(options, given), inputs, given, findings

    progress.step("reading and judging the logs")
    loaded, parts, fitted = load_logs(given, options)
    if step == "read":
        findings = judged(loaded).findings
        read = common([table_of(QualityRow, findings)], findings)
        return MeasuredLog(*read, options.logs[0], options.mapping)
    if step == "power":
        return added_up(given, loaded, options, progress, common)
    progress.step("simulating the logs' motion")
    compared = compare_logs(given, given.model, loaded, parts, fitted)
    findings, joints = compared.loaded.findings, given.model.joints
    tables = [table_of(QualityRow, findings), table_of(WhereRow, compared.rows)]
    if step == "where":
        return Comparison(*common(tables, findings), compared)
    if step == "forward":
        progress.step("driving the model by its servos")
        drives = drive_forward(given, compared, options)
        driven = [forward_table(drives, joints), *rollout_tables(drives, joints)]
        return Driven(*common(driven, findings), drives)
    if step == "shrink":
        progress.step("validating the model file's effects")
        outcome = check(given, compared)
    else:
        progress.step("letting effects compete")
        outcome = identified(given, compared, options, progress)
    found = bodies_of(given, outcome.validated.text)
    tables += _answer_tables(outcome, given, found)
    return Identified(*common(tables, findings), outcome, found, step)


def _answer_tables(outcome: Outcome, given: Setup, found: FoundBodies) -> list[Table]:
    naming, decided = outcome.naming, outcome.decided
    return [
        candidates_table(naming.candidates, naming.found, given.model),
        found_table(naming.found, given.model),
        *(
            [deciding_motion(decided[0].time, given.model.joints, decided[0].position)]
            if decided
            else []
        ),
        *([bodies(found.bodies)] if found.bodies else []),
    ]
