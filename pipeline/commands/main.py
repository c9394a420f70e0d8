"""The command line: its grammar, options made from the options models of the verbs, exit codes.

Exit 0: it ran. Exit 1: it ran and the finding is negative. Exit 2: the input cannot be used; one
line on standard error says where and what to do, and nothing is left half-written.
"""

from __future__ import annotations

import argparse
import logging
import os
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actuators.errors import LegwattError, StanceError
from reports.folder import check_writable

if TYPE_CHECKING:
    from actuators.checked import Table

OUT: Final = Path("reports/out")
#: Runs a verb and returns the exit code.
Run = Callable[[argparse.Namespace], int]
#: Adds a verb: its name, what it does, and what runs it.
AddVerb = Callable[[str, str, Run], argparse.ArgumentParser]


def named_path(text: str) -> Path:
    """The path that an option names.

    Raises:
        argparse.ArgumentTypeError: There is no name in it.
    """
    if not text.strip():  # what an unset variable leaves would be the folder the command runs in
        raise argparse.ArgumentTypeError("expected a name, got an empty one")
    if "\x00" in text:
        raise argparse.ArgumentTypeError("no file can have this name")
    return Path(text)


def add_options(
    sub: argparse.ArgumentParser, model: type[Table], *names: str, **defaults: Any
) -> None:
    """Options of a verb from fields of an options model, all by default, some with own defaults."""
    properties = model.model_json_schema()["properties"]
    for name in names or properties:
        entry = properties[name]
        usual = defaults.get(name, model.model_fields[name].default)
        kinds = entry.get("anyOf", [entry])
        types = {kind.get("type") for kind in kinds}
        text = entry.get("description", "").replace("%", "%%")
        if usual not in (None, False, "", ()) and str(usual) not in text:
            text += f"; {usual}"
        flag = f"--{name.replace('_', '-')}"
        choices = [choice for kind in kinds for choice in kind.get("enum", ())]
        if "boolean" in types:
            sub.add_argument(flag, action="store_true", help=text)
        elif "array" in types:
            sub.add_argument(flag, action="append", metavar=name.upper(), help=text)
        elif choices:
            sub.add_argument(flag, choices=choices, default=usual, help=text)
        else:
            path = name == "motion" or any(kind.get("format") == "path" for kind in kinds)
            number = int if "integer" in types else float if "number" in types else None
            sub.add_argument(
                flag,
                type=number or (named_path if path else str),
                default=usual,
                metavar="FILE" if path else name.upper().rpartition("_")[2],
                help=text,
            )


def given_options(options: argparse.Namespace, model: type[Table]) -> dict[str, Any]:
    """What the command line says of an options model, what it leaves out left out."""
    found = {n: getattr(options, n) for n in model.model_fields if n in options}
    return {name: value for name, value in found.items() if value is not None}


def add_out_option(sub: argparse.ArgumentParser, default: Path = OUT) -> None:
    """Folder for what is written."""
    text = f"folder for what is written; {default}"
    sub.add_argument("--out", type=named_path, default=default, help=text)


def add_verbose_option(sub: argparse.ArgumentParser, text: str = "say every step") -> None:
    """How much is said."""
    sub.add_argument("-v", "--verbose", action="store_true", help=text)


def add_machine_options(sub: argparse.ArgumentParser, robot: str) -> None:
    """Robot, effects, actuators, and numbers that differ; `robot`: what it may name."""
    text = f"{robot}; the model file's or the hexapod by default"
    sub.add_argument("--robot", type=named_path, help=text)
    text = "model file: include the effects that `gap` found"
    sub.add_argument("--model", type=named_path, help=text)
    text = "folder of actuator files of your own; actuators/catalog by default"
    sub.add_argument("--actuators", type=named_path, metavar="DIR", help=text)
    sub.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change a number for this run, in the unit of its file or with one behind it: "
        "NAME=VALUE of the robot file ('gait_period=3 s'), COMPONENT.NAME=VALUE for an actuator, "
        "gait.KEY=VALUE ('gait.slope_forward=5 deg'), "
        "standing.feet=LEG,LEG,LEG (standing.feet=lf,lr,rm), tables of [gait] as TOML: "
        "'gait.phase={lf=0, rf=0.5, ...}'",
    )


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
