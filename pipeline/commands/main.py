"""The command line: its grammar and its exit codes.

Exit 0: it ran. Exit 1: it ran and the finding is negative. Exit 2: the input cannot be used; one
line on standard error says where and what to do, and nothing is left half-written.
"""

import argparse
import logging
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Final

from actuators.errors import LegwattError, StanceError
from pipeline.commands.options import Run
from reports.folder import check_writable

#: Verbs in the order of the help, and the module that declares each.
VERBS: Final = {
    **dict.fromkeys(("check", "init", "init-actuator"), "robots"),
    **dict.fromkeys(("components", "choose"), "choose"),
    **dict.fromkeys(("stand", "walk", "reports", "sweep"), "walking"),
    **dict.fromkeys(("gap", "gap mapping", "gap export"), "gap"),
}
#: Verbs of two words, each with options of its own.
TWO_WORDS: Final = ("gap mapping", "gap export")
#: Verbs whose folder of results is looked at before anything is computed.
WRITING: Final = {*("stand", "walk", "reports", "choose", "gap", "sweep")}
EXIT_OK, EXIT_NEGATIVE, EXIT_UNUSABLE, EXIT_INTERRUPTED = 0, 1, 2, 130


class _Parser(argparse.ArgumentParser):
    """Errors in one line, as everywhere else; a verb's own help begins with what it does."""

    def error(self, message: str) -> None:  # type: ignore[override]
        self.exit(EXIT_UNUSABLE, f"{self.prog}: {message}; see {self.prog} --help\n")


def joined(arguments: Sequence[str]) -> list[str]:
    """The words of a command, a verb of two words as one."""
    words = list(arguments)
    # A log file that is called like a verb's second word is a log.
    if " ".join(words[:2]) in TWO_WORDS and not Path(words[1]).is_file():
        words[:2] = [" ".join(words[:2])]
    return words


def parser(verb: str = "") -> argparse.ArgumentParser:
    """The command line's grammar; of one verb alone where it is named, which imports no other."""
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

    for module in dict.fromkeys([VERBS[verb]] if verb in VERBS else VERBS.values()):
        import_module(f"pipeline.commands.{module}").add_verbs(add)
    return root


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        arguments: Without the program's name; those of the process by default.

    Returns:
        The exit code.
    """
    words = joined(sys.argv[1:] if arguments is None else arguments)
    options = parser(words[0] if words else "").parse_args(words)
    told = getattr(options, "verbose", False) or sys.stderr.isatty()
    logging.basicConfig(format="%(message)s")
    logging.getLogger("legwatt").setLevel(logging.INFO if told else logging.WARNING)
    run: Run = options.run
    try:
        if options.verb in WRITING:
            check_writable(options.out)
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
