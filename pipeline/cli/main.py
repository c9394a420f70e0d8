"""The command line: its grammar and its exit codes.

Exit 0: it ran. Exit 1: it ran and the finding is negative. Exit 2: the input cannot be used; one
line on standard error says where and what to do, and nothing is left half-written.
"""

from __future__ import annotations

import argparse
import logging
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from actuators.errors import LegwattError, StanceError
from pipeline.cli import (
    choose,
    components,
    gap,
    mapping,
    robots,
    sweep,
    walking,
)
from pipeline.cli.options import AddVerb, Run
from reports.folder import holding, settled

#: What declares the verbs, in the order of the help.
VERBS: Final[tuple[Callable[[AddVerb], None], ...]] = (
    *(robots.add_verbs, components.add_verb, choose.add_verb, walking.add_verbs),
    *(gap.add_verb, mapping.add_verb, gap.add_export, sweep.add_verb),
)
#: Verbs of two words, each with options of its own.
TWO_WORDS: Final = ("gap mapping", "gap export")
#: Verbs that hold their folder of results from the start.
HOLDING: Final = {*("stand", "walk", "reports", "choose", "gap", "sweep")}
EXIT_OK, EXIT_NEGATIVE, EXIT_UNUSABLE, EXIT_INTERRUPTED = 0, 1, 2, 130


class _Parser(argparse.ArgumentParser):
    """Errors in one line, as everywhere else; a verb's own help begins with what it does."""

    def error(self, message: str) -> None:  # type: ignore[override]
        self.exit(EXIT_UNUSABLE, f"{self.prog}: {message}; see {self.prog} --help\n")

    def parse_args(self, args: Sequence[str] | None = None, namespace: Any = None) -> Any:  # type: ignore[override]
        """Parse a command; a verb of two words is joined before."""
        words = list(sys.argv[1:] if args is None else args)
        # A log file that is called like a verb's second word is a log.
        if " ".join(words[:2]) in TWO_WORDS and not Path(words[1]).is_file():
            words[:2] = [" ".join(words[:2])]
        return super().parse_args(words, namespace)


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

    def add(name: str, text: str, run: Run) -> argparse.ArgumentParser:
        sub = verbs.add_parser(name, help=text, description=f"{text[0].upper()}{text[1:]}.")
        sub.set_defaults(run=run)
        return sub

    for declare in VERBS:
        declare(add)
    return root


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        arguments: Without the program's name; those of the process by default.

    Returns:
        The exit code.
    """
    options = parser().parse_args(arguments)
    told = getattr(options, "verbose", False) or sys.stderr.isatty()
    logging.basicConfig(format="%(message)s")
    logging.getLogger("legwatt").setLevel(logging.INFO if told else logging.WARNING)
    run: Run = options.run
    verb = gap.verb_of(options) if options.verb == "gap" else options.verb
    try:
        if getattr(options, "model", None):
            settled(options.model.parent)
        with holding(options.out, verb) if options.verb in HOLDING else nullcontext():
            return run(options)
    except StanceError as error:
        print(error, file=sys.stderr)
        return EXIT_NEGATIVE
    except LegwattError as error:
        print(error, file=sys.stderr)
        return EXIT_UNUSABLE
    except BrokenPipeError:  # who reads has enough: `| head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_OK
    except KeyboardInterrupt as reason:
        print(str(reason) or "interrupted; nothing is half-written", file=sys.stderr)
        return EXIT_INTERRUPTED
