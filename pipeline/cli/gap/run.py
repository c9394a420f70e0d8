"""The verb `gap`: compute everything, then write everything."""

from __future__ import annotations

import argparse
import logging
from collections.abc import Sequence
from contextlib import AbstractContextManager
from importlib.metadata import version
from pathlib import Path

from pipeline.api.gap_bodies import bodies_of, bodies_tables, refuse_own_urdf, write_model
from pipeline.api.gap_figures import (
    write_in_time,
    write_signature,
    write_waterfall,
    write_where_map,
)
from pipeline.api.gap_meta import inputs_of, metadata
from pipeline.api.gap_tables import (
    base_table,
    candidates_table,
    forward_table,
    found_table,
    motion_table,
    quality_table,
    rollout_tables,
    where_table,
)
from pipeline.cli.gap.options import options_of
from pipeline.identification.compare.circumstances import WHOLE
from pipeline.identification.workflow.forward import Drive, by_model, forward, rms
from pipeline.identification.workflow.locate import Whereabouts, find_where, judged
from pipeline.identification.workflow.options import Options
from pipeline.identification.workflow.setup import Setup, check_options, setup, take_in
from pipeline.identification.workflow.story import Story, Told, signature_name, tell
from pipeline.identification.workflow.validate import check
from pipeline.logs.quality.finding import Finding
from pipeline.progress import Progress
from pipeline.simulation.found_bodies import FoundBodies
from reports.folder import staged
from reports.pages.gap_report import write_report
from reports.table import Table
from reports.typeset import plain
from reports.writer import write_table

logger = logging.getLogger("legwatt")
EXPLAINED, UNEXPLAINED = 0, 1
#: What is no remark on the data, and what their owner wants to know.
READ_OFF = ("elasticity", "play", "ripple", "cannot_tell")
#: Remarks on the data that the terminal shows.
SAID = 5


def run_gap(given: argparse.Namespace, progress: Progress) -> int:
    """Run what the command line asks for; see `run`."""
    return run(options_of(given), progress)


def run(options: Options, progress: Progress) -> int:
    """Run one step, or all of them.

    Args:
        options: Of the run.
        progress: Told what is being done.

    Returns:
        The exit code: 0 where the gap is down to noise, 1 where a part stays unexplained.

    Raises:
        PipelineError: Unusable robot.
        ActuatorError: Unusable actuators.
        GapError: Unusable log, mapping or model file.
        ReportError: The folder cannot be written.
    """
    check_options(options)
    given = setup(options)
    refuse_own_urdf(given, options.out)
    with progress:
        progress.step("reading and judging the logs")
        intake, parts, fitted = take_in(given, options)
        if options.step == "read":
            found = judged(intake).findings
            _write_tables(options, given, [quality_table(found)])
            progress.close()
            _say_findings(found)
            return EXPLAINED
        progress.step("simulating the logs' motion")
        where = find_where(given, given.model, intake, parts, fitted)
        tables = [quality_table(where.intake.findings), where_table(where.rows)]
        if options.step == "where":
            return _where(given, where, options, tables, progress)
        if options.step == "forward":
            progress.step("driving the model by its servos")
            return _drive(given, where, options, progress)
        if options.step == "shrink":
            progress.step("weighing the model file's effects")
            told = check(given, where)
        else:
            progress.step("letting effects compete")
            told = tell(given, where, options, progress)
        bodies = bodies_of(given, told.model_file)
        tables += [*_answer_tables(told, given), *bodies_tables(bodies)]
        progress.step("writing")
        if options.step == "name":
            _write_tables(options, given, tables)
        else:
            with _staged(options, given) as folder:
                _tables_into(folder, options, given, tables)
                write_model(folder, told.model_file, bodies)
                if options.step != "add":
                    _figures_and_page(told, bodies, tables, folder)
    _say_warnings(given, where.intake.findings)
    _say_answer(told.story, bodies, options.out)
    logger.info("what took long: %s", progress.took())
    return UNEXPLAINED if told.story.unexplained else EXPLAINED


def _answer_tables(told: Told, given: Setup) -> list[Table]:
    naming = told.story.naming
    return [
        candidates_table(naming.candidates, naming.found, given.model),
        found_table(naming.found, given.model),
        *([base_table(naming)] if naming.base else []),
        *([motion_table(told.deciding, given.model.joints)] if told.deciding else []),
    ]


def _where(
    given: Setup, where: Whereabouts, options: Options, tables: Sequence[Table], progress: Progress
) -> int:
    """Step `where`."""
    with _staged(options, given) as folder:
        _tables_into(folder, options, given, tables)
        write_where_map(where.rows, given.model.joints, given.model.name, folder)
    progress.close()
    _say_warnings(given, where.intake.findings)
    _say_where(where)
    return EXPLAINED


def _drive(given: Setup, where: Whereabouts, options: Options, progress: Progress) -> int:
    """Step `forward`: 1 where the model file's effects bring positions no nearer."""
    drives = forward(given, where, options)
    joints = given.model.joints
    found = [forward_table(drives, joints), *rollout_tables(drives, joints)]
    _write_tables(options, given, found)
    progress.close()
    _say_drives(drives)
    first, *rest = (rms(own) for own in by_model(drives).values())
    return UNEXPLAINED if rest and rest[-1] >= first else EXPLAINED


def _staged(options: Options, given: Setup) -> AbstractContextManager[Path]:
    """Every step writes what the steps before it do, so a step's files replace any other's."""
    step = "" if options.step == "all" else f" {options.step}"
    return staged(options.out, f"gap{step}", inputs=inputs_of(options, given))


def _write_tables(options: Options, given: Setup, tables: Sequence[Table]) -> None:
    with _staged(options, given) as folder:
        _tables_into(folder, options, given, tables)


def _tables_into(folder: Path, options: Options, given: Setup, tables: Sequence[Table]) -> None:
    meta = metadata(options, given)
    for table in tables:
        write_table(table, folder, meta=meta, decimal=options.decimal)


def _figures_and_page(
    told: Told, bodies: FoundBodies, tables: Sequence[Table], folder: Path
) -> None:
    story, where = told.story, told.story.where
    model, weighed = story.given.model, told.story.weighed
    write_where_map(where.rows, model.joints, model.name, folder)
    unit = story.naming.unit
    write_waterfall(weighed.stages, story.noise, unit, model.name, folder)
    write_in_time(where.measurements, weighed.stages[1], weighed.stages[-1], told.shown, folder)
    for found, pair, joint in zip(story.naming.found, weighed.pairs, weighed.joints, strict=True):
        name = signature_name(found)
        if name in story.signatures:
            stem, place = Path(name).stem, found.place
            write_signature(where.measurements, *pair, joint, found.effect, place, stem, folder)
    footer = (
        f"legwatt {version('legwatt')}. Every CSV has a .meta.json beside it: meanings, units, "
        "input hashes, versions."
    )
    write_report(story, bodies, tables, folder, footer)


def _say_findings(findings: Sequence[Finding]) -> None:
    odd = [finding for finding in findings if finding.verdict != "ok"]
    told = [f for f in findings if f.check in READ_OFF]
    for finding in (*odd, *told):
        place = f" {finding.column}" if finding.column else ""
        word = finding.check if finding in told else finding.verdict
        print(f"{finding.log}{place}: {word.replace('_', ' ')}: {finding.detail}")
    print(f"{len(findings) - len(odd)} of {len(findings)} checks passed without a remark")


def _say_warnings(given: Setup, findings: Sequence[Finding]) -> None:
    """What a reader of the answer should know about files and logs, the first few."""
    lines = list(given.warnings)
    for f in findings:
        if f.verdict == "warning":
            lines.append(f"{f.log}{' ' if f.column else ''}{f.column}: {f.detail}")
    for line in lines[:SAID]:
        print(f"note: {line}")
    if len(lines) > SAID:
        print(f"note: {len(lines) - SAID} more remarks of this kind in quality.csv")


def _say_where(where: Whereabouts) -> None:
    for row in [r for r in where.rows if r.by == WHOLE][:3]:
        print(
            f"{row.joint}: gap {row.gap:.3g} {row.unit}, {row.gap / row.noise_floor:.1f} times "
            f"the noise floor, {row.share_of_total:.0%} of the whole"
        )


def _say_answer(story: Story, bodies: FoundBodies, out: Path) -> None:
    from reports.pages.gap_report import answer, whose_motors

    for paragraph in (whose_motors(story), *answer(story, bodies)):
        print(plain(paragraph))
    print(f"written to {out}")


def _say_drives(drives: Sequence[Drive]) -> None:
    """What a person wants to know first."""
    logs = len({d.log.name for d in drives})
    for model, own in by_model(drives).items():
        print(
            f"{model}: position misses by {1e3 * rms(own):.1f} mrad root mean square, {logs} logs"
        )
