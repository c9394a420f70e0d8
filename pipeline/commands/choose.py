"""The verb `choose`: which motor, gear and brake for a robot's day."""

import argparse

from pipeline.choice.options import ChooseOptions
from pipeline.choice.result import DAY, choice
from pipeline.commands.options import (
    OUT,
    AddVerb,
    add_machine_options,
    add_options,
    add_out_option,
    given_options,
    named_path,
)
from pipeline.commands.robots import machine_of


def add_verbs(add: AddVerb) -> None:
    """Declare the verb."""
    sub = add("choose", "which motor, gear and brake: every combination over a day", run_choose)
    sub.description = (
        "Search every combination of the parts that can be bought over a robot's day, group of "
        "joints by group of joints: the least energy within limits, how sure, and what to measure."
    )
    add_machine_options(sub, "robot file or name")
    text = "CSV of modes with their share of the time; columns in pipeline/choice/README.md"
    sub.add_argument("--mission", type=named_path, default=DAY, help=text)
    add_options(sub, ChooseOptions)
    add_out_option(sub, OUT / "choose")


def run_choose(options: argparse.Namespace) -> int:
    """Search, write the tables, print the answer."""
    asked = ChooseOptions.of(**given_options(options, ChooseOptions))  # refused before files
    machine = machine_of(options)
    result = choice(machine, options.mission, **asked.model_dump())
    result.save(options.out)
    print(result, f"wrote {options.out}", sep="\n")
    return 0
