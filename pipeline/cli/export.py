"""The verb `gap export`: what was found, as other tools read it."""

from __future__ import annotations

import argparse

from actuators.errors import one_line
from pipeline.cli.options import AddVerb, named_path

KINDS = ("mjcf", "urdf")


def add_verb(add: AddVerb) -> None:
    """Declare the verb."""
    text = "write a model file's machine as MJCF or URDF, and what these leave out"
    sub = add("gap export", text, run_export)
    sub.add_argument("model", type=named_path, help="model file that `gap` wrote")
    sub.add_argument("--to", choices=KINDS, required=True, help="what to write")
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
