"""Measured logs against a machine: read, compare, identify, validate, drive."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pipeline.api.gap_bodies import bodies_of, bodies_tables, write_model
from pipeline.api.gap_meta import metadata
from pipeline.api.gap_tables import (
    candidates_table,
    forward_table,
    found_table,
    quality_table,
    rollout_tables,
    where_table,
)
from pipeline.api.machine import Machine
from pipeline.api.result import Result, by_name
from pipeline.effects.model_file import edits_in
from pipeline.identification.compare.stages import overall
from pipeline.identification.workflow.forward import forward as drive_forward
from pipeline.identification.workflow.forward import rms
from pipeline.identification.workflow.locate import Whereabouts, find_where, judged
from pipeline.identification.workflow.options import Options
from pipeline.identification.workflow.setup import Setup, check_options, setup, take_in
from pipeline.identification.workflow.story import Story, tell
from pipeline.identification.workflow.validate import check
from pipeline.progress import Progress
from pipeline.simulation.found_bodies import FoundBodies
from reports.table import Table


@dataclass(frozen=True, eq=False)
class MeasuredLog(Result):
    """A log that was read and judged.

    Attributes:
        path: CSV or Parquet.
        mapping: Mapping file for foreign columns; None without.
    """

    path: Path
    mapping: Path | None

    @property
    def quality(self) -> Table:
        """What the log is worth: one row per judgement."""
        return self.table("quality")


@dataclass(frozen=True, eq=False)
class Comparison(Result):
    """Where model and machine disagree."""

    @property
    def where(self) -> Table:
        """The gap by joint and circumstance."""
        return self.table("where")


@dataclass(frozen=True, eq=False)
class Identified(Result):
    """What the model lacks, and what it leaves once that is written into it.

    Attributes:
        model: The machine with what was found and written.
        story: Everything the page tells.
        bodies: Those found to be others, and the corrected URDF.
    """

    model: Machine
    story: Story
    bodies: FoundBodies

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
        """Root mean square gap on rows that had no say, before and with the model as written."""
        stages = self.story.weighed.stages
        return overall(stages[0].gap), overall(stages[-1].gap)

    @property
    def unexplained(self) -> bool:
        """Whether more than noise is left, or the log may not say what it seems to."""
        return self.story.unexplained

    def _write(self, out: Path, decimal: str) -> None:
        super()._write(out, decimal)
        write_model(out, self.story.weighed.text, self.bodies)


@dataclass(frozen=True, eq=False)
class Driven(Result):
    """A model that drove itself under its servos' law.

    Attributes:
        position_rms: Root mean square position error with all effects [rad].
    """

    position_rms: float


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
        GapError: The log cannot be used; one line says which row or column and why.
    """
    more = {**options, "mapping": Path(mapping) if mapping else None, "step": "read"}
    run = _Run(machine, [path], [], more)
    intake, _, _ = take_in(run.given, run.options)
    tables = [quality_table(judged(intake).findings)]
    return MeasuredLog("gap read", by_name(tables), run.meta, Path(path), more["mapping"])


def compare(logs: Any, machine: Machine, **options: Any) -> Comparison:
    """Where a machine's logs and its model disagree.

    Args:
        logs: One or several, from `read_log` or by path.
        machine: The model.
        **options: See `pipeline.identification.workflow.options.Options`.

    Raises:
        GapError: A log cannot be used, or does not fit the machine.
    """
    run = _Run(machine, logs, (), {**options, "step": "where"})
    where = run.where()
    tables = [quality_table(where.intake.findings), where_table(where.rows)]
    return Comparison("gap where", by_name(tables), run.meta)


def identify(logs: Any, machine: Machine, *, test: Any = (), **options: Any) -> Identified:
    """What the model lacks, from logs of the machine.

    Args:
        logs: To learn from, from `read_log` or by path.
        machine: The model.
        test: Logs that only prove: they decide nothing.
        **options: See `pipeline.identification.workflow.options.Options`.

    Raises:
        GapError: A log cannot be used, or does not fit the machine.
    """
    run = _Run(machine, logs, test, {**options, "step": "add"})
    where = run.where()
    told = tell(run.given, where, run.options, Progress())
    model = machine
    if told.model_file:
        model = machine.with_model(replace(run.given.file, edits=edits_in(told.model_file)))
    return run.told(where, told.story, model)


def validate(logs: Any, machine: Machine, **options: Any) -> Identified:
    """How much a machine's effects shrink the gap on logs, without naming anything.

    Args:
        logs: To hold the model against.
        machine: With effects: of a model file, or as `identify` returns it.
        **options: See `pipeline.identification.workflow.options.Options`.

    Raises:
        GapError: A log cannot be used, or the machine has no effects.
    """
    run = _Run(machine, logs, (), {**options, "step": "shrink"})
    where = run.where()
    return run.told(where, check(run.given, where).story, machine)


def forward(logs: Any, machine: Machine, *, test: Any = (), **options: Any) -> Driven:
    """Let the model drive itself under its servos' law, and compare positions.

    Args:
        logs: On which tolerances are estimated.
        machine: Fixed base, a motor in every joint.
        test: Logs that are simulated; those of `logs` by default.
        **options: See `pipeline.identification.workflow.options.Options`.

    Raises:
        GapError: A log does not say what drives the servos.
    """
    run = _Run(machine, logs, test, {**options, "step": "forward"})
    drives = drive_forward(run.given, run.where(), run.options)
    joints = run.given.model.joints
    tables = [forward_table(drives, joints), *rollout_tables(drives, joints)]
    last = [d for d in drives if d.model == drives[-1].model]
    return Driven("gap forward", by_name(tables), run.meta, rms(last))


class _Run:
    """Options and machine of one call, as the workflow takes them."""

    def __init__(self, machine: Machine, logs: Any, test: Any, options: dict[str, Any]) -> None:
        mapping = options.get("mapping")
        for log in (*_several(logs), *_several(test)):
            if mapping is None and isinstance(log, MeasuredLog):
                mapping = log.mapping
        named = {**options, "mapping": Path(mapping) if mapping else None}
        self.options = Options(
            tuple(map(_path, _several(logs))),
            holdout=tuple(map(_path, _several(test))),
            robot=machine.path,
            gait=machine.files.gait,
            actuators=machine.files.actuators,
            changes=machine.changes,
            **named,
        )
        check_options(self.options, machine.model)
        self.given: Setup = setup(self.options, machine.model)

    def meta(self) -> dict[str, Any]:
        """What every sidecar says of the run."""
        return metadata(self.options, self.given)

    def where(self) -> Whereabouts:
        """Steps 1 and 2."""
        intake, parts, fitted = take_in(self.given, self.options)
        return find_where(self.given, self.given.model, intake, parts, fitted)

    def told(self, where: Whereabouts, story: Story, model: Machine) -> Identified:
        """A result of the workflow."""
        naming = story.naming
        tables = [
            quality_table(where.intake.findings),
            where_table(where.rows),
            candidates_table(naming.candidates, naming.found, self.given.model),
            found_table(naming.found, self.given.model),
        ]
        bodies = bodies_of(self.given, story.weighed.text)
        tables += bodies_tables(bodies)
        verb = f"gap {self.options.step}"
        return Identified(verb, by_name(tables), self.meta, model, story, bodies)


def _several(logs: Any) -> list[Any]:
    if isinstance(logs, str | Path | MeasuredLog):
        return [logs]
    return list(logs)


def _path(log: Any) -> Path:
    return log.path if isinstance(log, MeasuredLog) else Path(log)
