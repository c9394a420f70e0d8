"""Measured logs against a machine: read, compare, identify, validate, drive."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

from pipeline.api.gap.results import Comparison, Driven, Identified, LogResult, MeasuredLog, Powered
from pipeline.api.machine import Machine
from pipeline.api.result import by_name
from pipeline.effects.model_file import edits_in
from pipeline.identification.supply.account import account
from pipeline.identification.workflow.compared import compare_logs, judged, load_logs
from pipeline.identification.workflow.forward import forward as drive_forward
from pipeline.identification.workflow.options import Options
from pipeline.identification.workflow.outcome import identified
from pipeline.identification.workflow.setup import Setup, check_options, setup
from pipeline.identification.workflow.validate import check
from pipeline.logs.errors import Finding, GapError
from pipeline.robot.urdf_source import read_urdf
from pipeline.simulation.found_bodies import FoundBodies, corrected_urdf, found_bodies, not_in_urdf
from reports.pages.gap_words import URDF_FILE
from reports.table import Table, table_of
from reports.tables.gap import (
    QualityRow,
    WhereRow,
    bodies,
    candidates_table,
    forward_table,
    found_table,
    power_tables,
    rollout_tables,
)

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
        GapError: The log cannot be used; one line says which row or column and why.
    """
    return _analysed(MeasuredLog, "read", machine, [path], mapping=mapping, **options)


def compare(logs: Any, machine: Machine, **options: Any) -> Comparison:
    """Where a machine's logs and its model disagree.

    Args:
        logs: One or several, from `read_log` or by path.
        machine: The model.
        **options: See `pipeline.identification.workflow.options.Options`.

    Raises:
        GapError: A log cannot be used, or does not fit the machine.
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
        GapError: A log cannot be used, or does not fit the machine.
    """
    return _analysed(Identified, "add", machine, logs, test, **options)


def validate(logs: Any, machine: Machine, **options: Any) -> Identified:
    """How much a machine's effects shrink the gap on logs, without naming anything.

    Args:
        logs: To hold the model against.
        machine: With effects: of a model file, or as `identify` returns it.
        **options: See `pipeline.identification.workflow.options.Options`.

    Raises:
        GapError: A log cannot be used, or the machine has no effects.
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
        GapError: A log has no power at the supply, or too few samples of it.
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
        GapError: A log does not say what drives the servos.
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
        PipelineError: Unusable robot.
        ActuatorError: Unusable actuators.
        GapError: Unusable log, mapping or model file.
    """
    files = machine.files if machine else None
    check_options(options, files)
    given = setup(options, files)
    if (options.out / URDF_FILE).resolve() in {source.resolve() for source in given.sources}:
        raise GapError(
            f"{options.out / URDF_FILE}: the robot's URDF lies where a corrected one is written; "
            "choose another folder with --out, or copy it elsewhere"
        )
    step, joints = options.step, given.model.joints
    logger.info("reading and judging the logs")
    loaded, parts, fitted = load_logs(given, options)
    if step in ("read", "power"):
        findings = judged(loaded).findings
        tables = [table_of(QualityRow, findings)]
        if step == "read":
            common = _common(options, given, tables, findings)
            return MeasuredLog(**common, path=options.logs[0], mapping=options.mapping)
        logger.info("adding up the drives")
        balance = account(given, loaded.prepared, len(options.holdout), options.prove_last)
        tables += power_tables(balance)
        return Powered(**_common(options, given, tables, findings), account=balance)
    logger.info("simulating the logs' motion")
    compared = compare_logs(given, given.model, loaded, parts, fitted)
    findings = compared.loaded.findings
    if step == "forward":
        logger.info("driving the model by its servos")
        drives = drive_forward(given, compared, options)
        tables = [forward_table(drives, joints), *rollout_tables(drives, joints)]
        return Driven(**_common(options, given, tables, findings), drives=drives)
    tables = [table_of(QualityRow, findings), table_of(WhereRow, compared.rows)]
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
    tables += [
        candidates_table(naming.candidates, naming.found, given.model),
        found_table(naming.found, given.model),
        *([bodies(others)] if others else []),
    ]
    common = _common(options, given, tables, findings)
    return Identified(**common, outcome=outcome, bodies=found, machine=machine)


def _common(
    options: Options, given: Setup, tables: Sequence[Table], findings: Sequence[Finding]
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
        "_tables": by_name(tables),
        "_said": said,
        "inputs": (*options.logs, *options.holdout, *given.sources, *filter(None, more)),
        "given": given,
        "findings": findings,
    }
