"""The verb `gap`: compute everything, then write everything."""

from __future__ import annotations

import argparse
import hashlib
import logging
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pipeline.app.gap_figures import write_where_map
from pipeline.app.gap_options import split_items
from pipeline.app.gap_run import Progress, Whereabouts, find_where
from pipeline.app.gap_setup import Setup, check_options, setup, take_in
from pipeline.app.gap_tables import quality_table, where_table
from pipeline.app.staging import staged
from pipeline.gap.circumstances import WHOLE
from reports.table import Table
from reports.writer import write_table

logger = logging.getLogger("legwatt")
PACKAGES = ("legwatt", "pin", "numpy", "scipy", "pyarrow", "matplotlib")
#: Written last: whoever sees them sees a whole run.
LAST = ("report.md", "index.html")


def run_gap(options: argparse.Namespace) -> int:
    """Run one step, or all of them.

    Returns:
        The exit code.

    Raises:
        PipelineError: Unusable robot.
        ActuatorError: Unusable actuators.
        GapError: Unusable log, mapping or model file.
        ReportError: The folder cannot be written.
    """
    split_items(options)
    check_options(options)
    given = setup(options)
    with Progress(8) as progress:
        progress.step("reading and judging the logs")
        intake, parts, fitted = take_in(given, options)
        if options.step == "read":
            tables = [quality_table(intake.findings)]
            _write(options, given, tables, None)
            for finding in intake.findings:
                if finding.verdict != "ok":
                    place = f" {finding.column}" if finding.column else ""
                    print(f"{finding.log}{place}: {finding.verdict}: {finding.detail}")
            return 0
        progress.step("simulating the logs' motion")
        found = find_where(given, given.model, intake, parts, fitted)
        tables = [quality_table(intake.findings), where_table(found.rows)]
        progress.step("writing")
        _write(options, given, tables, found)
        for row in [r for r in found.rows if r.by == WHOLE][:3]:
            print(
                f"{row.joint}: gap {row.gap:.3g} {row.unit}, {row.gap / row.noise_floor:.1f} times "
                f"the noise floor, {row.share_of_total:.0%} of the whole"
            )
    return 0


def _write(
    options: argparse.Namespace, given: Setup, tables: list[Table], where: Whereabouts | None
) -> None:
    meta = metadata(options, given)
    with staged(options.out, LAST) as folder:
        for table in tables:
            write_table(table, folder, meta=meta)
        if where is not None:
            write_where_map(where.rows, given.model.joints, given.model.name, folder)


def metadata(options: argparse.Namespace, given: Setup) -> dict[str, Any]:
    """What every sidecar says about the run: inputs by hash, versions, options."""
    files = [*options.logs, *options.holdout, *given.sources]
    files += [path for path in (options.mapping, options.model) if path]
    return {
        "inputs_sha256": {path.name: _sha256(path) for path in files},
        "versions": {name: version(name) for name in PACKAGES},
        "options": {
            "step": options.step,
            "base": options.base or "as the log and the robot say",
            "alternative": given.alternative,
            "effort": options.effort or "the log's most direct",
            "cutoff_Hz": options.cutoff,
            "prove_last": options.prove_last,
        },
        "conventions": "SI units; torque, velocity, current and voltage positive in the joint's "
        "direction; gap is measured less predicted",
        "warnings": [],
    }


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
