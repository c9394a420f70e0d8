"""The verbs stand, walk and reports: compute everything, then write everything."""

from __future__ import annotations

import argparse
import logging

from pipeline.api.tables import (
    findings,
    inputs_of,
    metadata,
    table_of_parameters,
    tables_of_standing,
    tables_of_walking,
)
from pipeline.cli.decimal_option import decimal_of
from pipeline.errors import RobotFileError
from pipeline.simulation.settings import Settings, settings
from pipeline.simulation.walk_stand import stand, walk
from reports.folder.staging import staged
from reports.table import Table
from reports.writer import write_table

logger = logging.getLogger("legwatt")


def run(options: argparse.Namespace) -> int:
    """Compute what the verb asks for and write it to the output folder.

    Raises:
        PipelineError: Unusable input.
        ActuatorError: Unusable catalogue.
        ReportError: The folder cannot be written.
    """
    given = settings_of(options)
    if not given.robot.floating:
        raise RobotFileError(
            f"{given.robot.spec.path}: a robot on a stand neither stands nor walks; "
            "give one with a floating base"
        )
    tables: list[Table] = []
    standing = walking = None
    if options.verb in ("stand", "reports"):
        logger.info("standing on %s", ", ".join(given.robot.spec.standing_feet))
        standing = stand(given.machine, given.chains(), adjust=given.adjust)
        tables += tables_of_standing(given, standing)
    if options.verb in ("walk", "reports"):
        logger.info("walking one cycle, %d samples per segment", given.samples)
        walking = walk(
            given.machine,
            given.chains(),
            samples=given.samples,
            quasi_static=given.quasi_static,
            regeneration=given.regeneration,
            adjust=given.adjust,
        )
        tables += tables_of_walking(given, walking)
    tables.append(table_of_parameters(given))
    judgement = None
    if options.verb == "reports":
        from pipeline.api import judgement as judging
        from pipeline.paper.judgement.basis import basis

        by = basis(given)
        if isinstance(by, str):
            print(f"not held against the paper: {by}")
        else:
            logger.info("holding the run against the paper")
            judgement, more = judging.judged(given, by)
            tables += more
            if by.word:
                print(by.word)
    meta = metadata(given)
    with staged(options.out, options.verb, inputs=inputs_of(given)) as out:
        for table in tables:
            write_table(table, out, meta=meta, decimal=decimal_of(options))
        files = len(tables)
        if options.verb == "reports":
            from pipeline.api.figures import write_figures

            assert standing is not None
            assert walking is not None
            logger.info("drawing figures")
            files += write_figures(given, standing, walking, out)
            if judgement is not None:
                files += judging.pages(given, judgement, tables, out)
    print(f"{files} tables{' and figures' if options.verb == 'reports' else ''} in {options.out}")
    for line in (
        *given.remarks,
        *(given.effects.remarks if given.effects else ()),
        *(findings(walking, given) if walking else ()),
    ):
        print(line)
    return 0


def settings_of(options: argparse.Namespace) -> Settings:
    """What the command line asks for, loaded."""
    return settings(
        robot=options.robot,
        model=options.model,
        changes=options.set,
        samples=options.samples,
        quasi_static=options.quasi_static,
        regeneration=options.regeneration,
        actuators=options.actuators,
        walks=options.verb != "stand",
    )
