"""The verbs stand, walk and reports: options in, one call, lines out."""

from __future__ import annotations

import argparse

from pipeline.api.machine import load
from pipeline.api.reports import write
from pipeline.cli.decimal_option import decimal_of
from pipeline.cli.walk_options import changes_of, force_choice
from pipeline.progress import Progress
from pipeline.simulation.settings import Settings


def run(options: argparse.Namespace, progress: Progress) -> int:
    """Compute what the verb asks for and write it to the output folder.

    Raises:
        PipelineError: Unusable input.
        ActuatorError: Unusable catalogue.
        ReportError: The folder cannot be written.
    """
    given, decimal = settings_of(options), decimal_of(options)
    lines = write(given, options.verb, options.out, decimal, progress)
    progress.close()
    for line in lines:
        print(line)
    return 0


def settings_of(options: argparse.Namespace) -> Settings:
    """What the command line asks for, loaded."""
    machine = load(
        options.robot,
        model=options.model,
        gait=options.gait,
        actuators=options.actuators,
        changes=changes_of(options.set),
    )
    return machine.walking(
        samples=options.samples,
        quasi_static=options.quasi_static,
        regeneration=options.regeneration,
        forces=force_choice(options),
        compare_forces=options.compare_forces,
        motion=getattr(options, "motion", None),
        walks=options.verb != "stand",
    )
