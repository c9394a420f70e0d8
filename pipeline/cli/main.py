"""The command line: verbs, options, exit codes.

Exit 0: it ran. Exit 1: it ran and the finding is negative. Exit 2: the input cannot be used; one
line on standard error says where and what to do, and nothing is left half-written.
"""

from __future__ import annotations

import argparse
import logging
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

from pipeline.cli.blind_options import add_blind_options, add_twin_options
from pipeline.cli.decimal_option import add_decimal_option
from pipeline.cli.gap.options import add_gap_options
from pipeline.cli.init_actuator.options import add_actuator_options
from pipeline.cli.named_path import named_path
from pipeline.cli.view import add_view_options
from pipeline.cli.walk_options import add_force_options, add_machine_options
from pipeline.errors import PipelineError, StanceError
from pipeline.progress import Progress

EXIT_OK, EXIT_NEGATIVE, EXIT_UNUSABLE = 0, 1, 2
DEFAULT_ROBOT = Path("urdf/hexapod.toml")
DEFAULT_OUT = Path("reports/out")

logger = logging.getLogger("legwatt")


class _Parser(argparse.ArgumentParser):
    """Errors in one line, as everywhere else; a verb's own help begins with what it does."""

    def error(self, message: str) -> None:  # type: ignore[override]
        self.exit(EXIT_UNUSABLE, f"{self.prog}: {message}; see {self.prog} --help\n")


def parser() -> argparse.ArgumentParser:
    """The command line's grammar."""
    root = _Parser(
        prog="python -m pipeline",
        description="The electrical energy it takes to actuate a legged robot, and, from measured "
        "logs, what its model lacks. VERB --help lists a verb's options.",
        epilog="Exit codes: 0 it ran; 1 it ran and the finding is negative (the robot tips or "
        "slides, a check fails, a part of the gap stays unexplained); 2 the input cannot be used; "
        "130 interrupted.",
    )
    root.add_argument("--version", action="version", version=f"legwatt {version('legwatt')}")
    verbs = root.add_subparsers(dest="verb", required=True, metavar="VERB", parser_class=_Parser)

    _robot_verbs(verbs)
    for verb, text in (
        ("stand", "standing still: torques, currents, power of every alternative"),
        ("walk", "one walking cycle: demand, stage energies, losses, limits"),
        ("reports", "stand and walk, with all figures and a page, index.html"),
    ):
        sub = _verb(verbs, verb, text)
        _run_options(sub)
        if verb == "walk":
            sub.add_argument(
                "--motion",
                type=named_path,
                metavar="FILE",
                help="CSV to move by instead of the gait: time_s, JOINT__position_rad and, unless "
                "the base is fixed, LEG__contact (0 or 1); base__x_m to base__yaw_rad where known",
            )
        sub.set_defaults(run=_run_reports)

    view = _verb(verbs, "view", "play robot, gait, forces and torques in a browser, in 3D")
    add_view_options(view)
    view.set_defaults(run=_run_view)

    gap = _verb(verbs, "gap", "find what the model lacks: from a measured log to a named effect")
    add_gap_options(gap)
    gap.set_defaults(run=_run_gap)

    twin = _verb(verbs, "twin", "simulate a machine with hidden effects and write its log")
    add_twin_options(twin)
    twin.set_defaults(run=_run_twin)

    text = "simulate machines with hidden effects and count how often gap finds them"
    blind = _verb(verbs, "blind", text)
    add_blind_options(blind)
    blind.set_defaults(run=_run_blind)

    diff = _verb(verbs, "diff", "lay two finished runs side by side on one page")
    _diff_options(diff)
    diff.set_defaults(run=_run_diff)

    text = "fit the unpublished numbers to the paper's figures and store them"
    calibrate = _verb(verbs, "calibrate", text)
    calibrate.add_argument("--robot", type=named_path, default=DEFAULT_ROBOT, help="robot file")
    calibrate.add_argument("--workers", type=int, default=2, help="number of processes")
    calibrate.add_argument("--seed", type=int, default=1, help="of the random numbers")
    calibrate.set_defaults(run=_run_calibrate)
    return root


def _verb(verbs: argparse._SubParsersAction[_Parser], name: str, text: str) -> _Parser:
    return verbs.add_parser(name, help=text, description=f"{text[0].upper()}{text[1:]}.")


def _robot_verbs(verbs: argparse._SubParsersAction[_Parser]) -> None:
    """What makes and judges robot files."""
    check = _verb(verbs, "check", "judge a robot file or URDF for physical sense")
    check.add_argument(
        "file", type=named_path, help="robot file (.toml), URDF, or a name as `init` takes it"
    )
    check.add_argument("-v", "--verbose", action="store_true", help="list what passed, too")
    check.set_defaults(run=_run_check)

    init = _verb(verbs, "init", "write a robot file for a URDF or a robot's name")
    init.add_argument(
        "source",
        help="URDF, or a robot that example-robot-data ships, e.g. solo12",
    )
    init.add_argument("--out", type=named_path, help="robot file; NAME.toml here by default")
    init.add_argument(
        "--foot",
        action="append",
        default=[],
        metavar="LINK",
        help="a link at a foot, once for each leg; looked for by default",
    )
    init.add_argument("--base", metavar="LINK", help="the base's link; the root by default")
    init.set_defaults(run=_run_init)

    actuator = _verb(verbs, "init-actuator", "write actuator files from a data sheet")
    add_actuator_options(actuator)
    actuator.set_defaults(run=_run_init_actuator)

    urdf = _verb(verbs, "urdf", "build the URDFs from their robot files")
    urdf.description = (
        "Write the URDF of each robot file with robot.build from its numbers, over the file that "
        "robot.urdf names; a robot file with a URDF of its own is left alone."
    )
    urdf.add_argument(
        "files", type=named_path, nargs="*", help="robot files; all in urdf/ by default"
    )
    urdf.set_defaults(run=_run_urdf)


def _diff_options(sub: argparse.ArgumentParser) -> None:
    kinds = "folder that stand, walk and reports wrote, or gap"
    sub.add_argument("a", type=named_path, metavar="A", help=kinds)
    sub.add_argument("b", type=named_path, metavar="B", help="another, of a run of the same kind")
    out = DEFAULT_OUT / "diff"
    sub.add_argument("--out", type=named_path, default=out, help="folder for the page and the CSV")
    add_decimal_option(sub)


def _run_options(sub: argparse.ArgumentParser) -> None:
    add_machine_options(sub)
    sub.add_argument(
        "--out",
        type=named_path,
        default=DEFAULT_OUT,
        help=f"folder for what is written; {DEFAULT_OUT}",
    )
    sub.add_argument("--samples", type=int, default=751, help="per half period of the gait; 751")
    add_force_options(sub)
    sub.add_argument(
        "--compare-forces",
        action="store_true",
        help="write walking_force_rules.csv: what each rule costs in energy",
    )
    add_decimal_option(sub)
    sub.add_argument("-v", "--verbose", action="store_true", help="say what is being done")


def _run_init(options: argparse.Namespace) -> int:
    from pipeline.cli.init import run_init

    return run_init(options.source, options.out, feet=options.foot, base=options.base)


def _run_init_actuator(options: argparse.Namespace) -> int:
    from pipeline.cli.init_actuator.run import run_init_actuator

    return run_init_actuator(options)


def _run_check(options: argparse.Namespace) -> int:
    from pipeline.cli.init import run_check

    return run_check(options.file, verbose=options.verbose)


def _run_urdf(options: argparse.Namespace) -> int:
    from pipeline.robot.robot_file import load_robot_file
    from pipeline.robot.urdf_builder import build_urdf
    from reports.writer import write_text

    for path in options.files or sorted(Path("urdf").glob("*.toml")):
        spec = load_robot_file(path)
        if spec.build:
            write_text(spec.urdf, build_urdf(spec))
            print(f"{spec.urdf}: built from {path}")
        else:
            print(f"{path}: nothing built, its URDF {spec.urdf.name} is its own (no robot.build)")
    return EXIT_OK


@contextmanager
def _folder_held(options: argparse.Namespace) -> Iterator[None]:
    """Hold the folder of results from the start, and see that the model's folder is settled."""
    from reports.folder import holding, settled

    if getattr(options, "model", None):
        settled(options.model.parent)
    with holding(options.out):
        yield


def _run_reports(options: argparse.Namespace) -> int:
    with _folder_held(options), Progress(options.verb) as progress:
        progress.step("loading")
        from pipeline.cli.run import run

        return run(options, progress)


def _run_view(options: argparse.Namespace) -> int:
    from pipeline.cli.view import run_view

    return run_view(options)


def _run_gap(options: argparse.Namespace) -> int:
    with _folder_held(options), Progress(options.verb) as progress:
        progress.step("loading")
        from pipeline.cli.gap.run import run_gap

        return run_gap(options, progress)


def _run_diff(options: argparse.Namespace) -> int:
    from pipeline.api.diff.page import write_diff
    from pipeline.cli.decimal_option import decimal_of

    for line in write_diff(options.a, options.b, options.out, decimal_of(options)):
        print(line)
    return EXIT_OK


def _run_twin(options: argparse.Namespace) -> int:
    with _folder_held(options):
        from pipeline.cli.twin import run_twin

        return run_twin(options)


def _run_blind(options: argparse.Namespace) -> int:
    from reports.folder import output_errors

    with _folder_held(options), output_errors(options.out):
        from pipeline.cli.blind import run_blind

        return run_blind(options)


def _run_calibrate(options: argparse.Namespace) -> int:
    from pipeline.cli.calibrate import WORK, run_calibrate
    from reports.folder import holding, output_errors

    with holding(WORK), output_errors(WORK):
        return run_calibrate(options)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        arguments: Without the program's name; those of the process by default.

    Returns:
        The exit code.
    """
    options = parser().parse_args(arguments)
    logging.basicConfig(
        level=logging.INFO if getattr(options, "verbose", False) else logging.WARNING,
        format="%(message)s",
    )
    run: Callable[[argparse.Namespace], int] = options.run
    from actuators.errors import ActuatorError
    from pipeline.logs.errors import GapError
    from reports.errors import ReportError

    try:
        return run(options)
    except StanceError as error:
        print(error, file=sys.stderr)
        return EXIT_NEGATIVE
    except (PipelineError, ActuatorError, GapError, ReportError) as error:
        print(error, file=sys.stderr)
        return EXIT_UNUSABLE
    except BrokenPipeError:  # who reads has enough: `| head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_OK
    except KeyboardInterrupt as reason:
        print(str(reason) or "interrupted; nothing is half-written", file=sys.stderr)
        return 130
