"""Options of the command line, made from the options models of the verbs."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

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
