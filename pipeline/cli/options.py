"""Options that several verbs share, and what they ask for."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actuators.errors import LegwattError, one_line

if TYPE_CHECKING:
    from pipeline.api.machine import Machine
    from pipeline.simulation.settings import Settings

OUT = Path("reports/out")
#: Sign of decimals by the word that asks for it.
DECIMAL: Final = {"dot": ".", "comma": ","}
#: Options that `load` and `Machine.walking` take by these names.
OF_MACHINE: Final = ("robot", "model", "gait", "actuators")
OF_WALK: Final = (
    *("samples", "quasi_static", "regeneration", "motion", "forces", "friction_coefficient"),
)
#: Runs a verb and returns the exit code.
Run = Callable[[argparse.Namespace], int]
#: Adds a verb: its name, what it does, and what runs it.
AddVerb = Callable[[str, str, Run], argparse.ArgumentParser]


def named_path(text: str) -> Path:
    """The path that an option names.

    An empty one is what an unset variable of a shell leaves; taken for a path it would be the
    folder the command runs in.

    Raises:
        argparse.ArgumentTypeError: There is no name in it.
    """
    if not text.strip():
        raise argparse.ArgumentTypeError("expected a name, got an empty one")
    if "\x00" in text:
        raise argparse.ArgumentTypeError("no file can have this name")
    return Path(text)


def add_out_option(sub: argparse.ArgumentParser, default: Path = OUT) -> None:
    """Folder, decimal sign, and how much is said."""
    text = f"folder for what is written; {default}"
    sub.add_argument("--out", type=named_path, default=default, help=text)
    sub.add_argument(
        "--decimal",
        choices=DECIMAL,
        default="dot",
        help="comma: CSV files with semicolons and decimal commas, for spreadsheets that do",
    )


def add_verbose_option(sub: argparse.ArgumentParser, text: str = "say every step") -> None:
    """How much is said."""
    sub.add_argument("-v", "--verbose", action="store_true", help=text)


def add_machine_options(sub: argparse.ArgumentParser, robot: str, changes: str) -> None:
    """Robot, gait, effects, actuators, and numbers that differ.

    Args:
        sub: The verb's parser.
        robot: What ``--robot`` may name, in words.
        changes: What ``--set`` takes, in words.
    """
    text = f"{robot}; the model file's or the hexapod by default"
    sub.add_argument("--robot", type=named_path, help=text)
    text = "model file: include the effects that `gap` found"
    sub.add_argument("--model", type=named_path, help=text)
    sub.add_argument(
        "--gait",
        type=named_path,
        metavar="FILE",
        help="TOML with a table [gait] to walk instead of the robot file's",
    )
    sub.add_argument(
        "--actuators",
        type=named_path,
        metavar="DIR",
        help="folder of actuator files of your own; actuators/catalog by default",
    )
    sub.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help=changes)


def add_walk_options(sub: argparse.ArgumentParser, samples: int) -> None:
    """Machine, forces of the ground, regeneration, samples.

    Args:
        sub: The verb's parser.
        samples: Per half period of the gait, by default.
    """
    add_machine_options(
        sub,
        "robot file",
        "change a number for this run: NAME=VALUE in the unit the robot file writes, "
        "COMPONENT.NAME=VALUE for an actuator, gait.KEY=VALUE ('gait.slope_forward=5 deg'), "
        "standing.feet=LEG,LEG,LEG (standing.feet=lf,lr,rm), lists and tables of [gait] as TOML: "
        """'gait.sets=[["lf", "rr"], ["rf", "lr"]]'""",
    )
    sub.add_argument(
        "--quasi-static", action="store_true", help="leave out the links' inertial terms"
    )
    sub.add_argument(
        "--regeneration",
        default="none",
        metavar="POLICY",
        help="what becomes of electrical energy that motors return: none (it is lost), bus (other "
        "motors use it at that instant), or the fraction that is used again, e.g. 0.5",
    )
    text = f"per half period of the gait; {samples}"
    sub.add_argument("--samples", type=int, default=samples, help=text)
    sub.add_argument(
        "--forces",
        default="least_tangential",
        metavar="RULE",
        help="how the ground's forces are chosen: least_tangential (the paper's rule) or "
        "least_torque (joint torques squared)",
    )
    sub.add_argument(
        "--friction-coefficient",
        type=float,
        metavar="MU",
        help="greatest tangential over normal force of a foot; gait.friction_coefficient, else no "
        "limit, by default",
    )


def changes_of(texts: Iterable[str]) -> dict[str, str]:
    """Keys and values of ``--set KEY=VALUE``; the last counts where a key comes twice.

    Raises:
        LegwattError: One is something else.
    """
    changes = {}
    for text in texts:
        key, _, value = (part.strip() for part in text.partition("="))
        if not key or not value:
            raise LegwattError(f"--set {one_line(text)}: expected KEY=VALUE")
        changes[key] = value
    return changes


def named(options: argparse.Namespace, names: Iterable[str]) -> dict[str, Any]:
    """Those options by name that the verb has."""
    return {name: getattr(options, name) for name in names if name in options}


def machine_of(options: argparse.Namespace) -> Machine:
    """The machine that is asked for, loaded."""
    from pipeline.api.machine import load

    return load(**named(options, OF_MACHINE), changes=changes_of(options.set))


def settings_of(options: argparse.Namespace) -> Settings:
    """The machine that is asked for, and how it walks."""
    return machine_of(options).walking(**named(options, OF_WALK))
