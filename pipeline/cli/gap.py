"""The verbs `gap` and `gap export`: options, one call each, and what they say."""

from __future__ import annotations

import argparse
import logging
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

from actuators.errors import one_line
from pipeline.cli.options import (
    DECIMAL,
    AddVerb,
    add_machine_options,
    add_out_option,
    add_verbose_option,
    changes_of,
    named,
    named_path,
)
from pipeline.identification.workflow.options import DEFAULT_OUT, STEPS, Options

if TYPE_CHECKING:
    from pipeline.api.logs import LogResult
    from pipeline.logs.errors import Finding

logger = logging.getLogger("legwatt")
#: Findings that are no remark on the data, and what their owner wants to know.
READ_OFF = ("elasticity", "play", "ripple", "cannot_tell")
#: Remarks on the data that the terminal shows.
SAID = 5


def add_verb(add: AddVerb) -> None:
    """Declare the verb."""
    sub = add("gap", "find what the model lacks: from a measured log to a named effect", run_gap)
    sub.add_argument(
        "items",
        nargs="+",
        metavar="[STEP] LOG",
        help="logs (CSV or Parquet) to learn from; a step in front of them does that step only: "
        + "; ".join(f"{name}: {text}" for name, text in STEPS.items()),
    )
    changes = "change a number for this run, as `walk` takes it"
    add_machine_options(sub, "robot file, or URDF of a fixed robot", changes)
    sub.add_argument(
        "--holdout",
        type=named_path,
        nargs="+",
        default=[],
        metavar="LOG",
        help="logs on which the result is tested; nothing is fitted to them",
    )
    sub.add_argument(
        "--base",
        choices=["fixed", "level", "measured"],
        help="how the base stands; measured where the log has roll or pitch, else level or fixed "
        "as the robot file says",
    )
    sub.add_argument(
        "--gait-start",
        type=float,
        metavar="SECONDS",
        help="time in the log at which a period of the gait begins: tells which feet "
        "stand where the log has neither foot forces nor contacts; the lowest feet without it",
    )
    sub.add_argument(
        "--alternative",
        metavar="NAME",
        help="actuator between joint and supply: ideal, rotor (default), reversible or "
        "irreversible, or one of --actuators; a bare URDF has none by default",
    )
    sub.add_argument("--mapping", type=named_path, help="mapping file (TOML) for foreign columns")
    sub.add_argument(
        "--effort",
        metavar="CHANNEL",
        help="measured quantity that is compared: torque, current, voltage or "
        "power; the first of them in the log by default",
    )
    sub.add_argument(
        "--cutoff",
        type=float,
        metavar="HZ",
        help="cut-off frequency of the low-pass filter; chosen from the noise by default",
    )
    sub.add_argument(
        "--prove-last",
        type=float,
        metavar="SHARE",
        help="test on this last share of every log instead of on blocks in between",
    )
    add_out_option(sub, DEFAULT_OUT)
    add_verbose_option(sub)


def verb_of(given: argparse.Namespace) -> str:
    """The verb with its step, as results say it: ``"gap"`` or ``"gap where"``."""
    first = given.items[0]
    # A log file that is called like a step is a log.
    return f"gap {first}" if first in STEPS and not Path(first).is_file() else "gap"


def options_of(given: argparse.Namespace) -> Options:
    """What the command line asks for."""
    step = verb_of(given).partition(" ")[2]
    asked = named(given, (f.name for f in fields(Options))) | {
        "step": step or "all",
        "logs": tuple(Path(item) for item in given.items[bool(step) :]),
        "holdout": tuple(given.holdout),
        "changes": changes_of(given.set),
    }
    return Options(**asked)


def run_gap(given: argparse.Namespace) -> int:
    """Compute what is asked for, write it, say what a person wants to know first.

    Returns:
        0 where the gap is down to noise, 1 where a part stays unexplained.
    """
    from pipeline.api.logs import analyse

    options = options_of(given)
    result = analyse(options)
    logger.info("writing")
    result.save(options.out, decimal=DECIMAL[given.decimal])
    return int(_say(result, options.out))


def _say(result: LogResult, out: Path) -> bool:
    """What a person wants to know first; whether the finding is negative."""
    from pipeline.api.logs import Comparison, Driven, Identified, Powered
    from reports.page import plain
    from reports.pages.gap_report import power_answer
    from reports.pages.gap_words import answer

    if isinstance(result, Driven):
        logs = len({drive.log.name for drive in result.drives})
        errors = result.errors()
        for model, error in errors:
            print(
                f"{model}: position misses by {1e3 * error:.1f} mrad root mean square, {logs} logs"
            )
        return len(errors) > 1 and errors[-1][1] >= errors[0][1]
    if not isinstance(result, Comparison | Identified | Powered):
        _say_findings(result.findings)
        return False
    warnings = [f for f in result.findings if f.verdict == "warning"]
    lines = [*result.given.warnings]
    lines += [f"{f.log}{' ' if f.column else ''}{f.column}: {f.detail}" for f in warnings]
    for line in lines[:SAID]:
        print(f"note: {line}")
    if len(lines) > SAID:
        print(f"note: {len(lines) - SAID} more remarks of this kind in quality.csv")
    if isinstance(result, Comparison):
        from pipeline.identification.compare.circumstances import WHOLE

        for row in [r for r in result.residuals.rows if r.by == WHOLE][:3]:
            print(
                f"{row.joint}: gap {row.gap:.3g} {row.unit}, {row.gap / row.noise_floor:.1f} times "
                f"the noise floor, {row.share_of_total:.0%} of the whole"
            )
        return False
    if isinstance(result, Identified):
        said = answer(result.outcome, result.bodies)
        negative = result.unexplained
    else:
        said, negative = power_answer(result.account), result.account.negative
    print(*map(plain, said), f"written to {out}", sep="\n")
    return negative


def _say_findings(findings: Sequence[Finding]) -> None:
    odd = [finding for finding in findings if finding.verdict != "ok"]
    known = [f for f in findings if f.check in READ_OFF]
    for finding in (*odd, *known):
        place = f" {finding.column}" if finding.column else ""
        word = finding.check if finding in known else finding.verdict
        print(f"{finding.log}{place}: {word.replace('_', ' ')}: {finding.detail}")
    print(f"{len(findings) - len(odd)} of {len(findings)} checks passed without a remark")


def add_export(add: AddVerb) -> None:
    """Declare the verb `gap export`: what was found, as other tools read it."""
    text = "write a model file's machine as MJCF or URDF, and what these leave out"
    sub = add("gap export", text, run_export)
    sub.add_argument("model", type=named_path, help="model file that `gap` wrote")
    sub.add_argument("--to", choices=("mjcf", "urdf"), required=True, help="what to write")
    sub.add_argument("--out", type=named_path, required=True, help="the file")
    sub.add_argument(
        "--robot", type=named_path, help="robot file or URDF; the one that the model file names"
    )
    text = "folder of actuator files that the model was found with; actuators/catalog by default"
    sub.add_argument("--actuators", type=named_path, metavar="DIR", help=text)
    sub.add_argument(
        "--mapping", type=named_path, help="mapping file with [pd_gains]: they become the gains"
    )


def run_export(given: argparse.Namespace) -> int:
    """Write the file and say what it cannot hold."""
    from pipeline.atomic import write_text
    from pipeline.simulation.export import exported

    files = {"robot": given.robot, "actuators": given.actuators, "mapping": given.mapping}
    made = exported(given.model, given.to, **files)
    write_text(given.out, made.text)
    print(f"written to {given.out}: {made.joints} joints")
    for words in made.remarks:
        print(f"note: {words}")
    for words in made.left:
        print(f"not carried over: {one_line(words)}")
    return 0
