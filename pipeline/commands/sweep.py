"""Sweep: walk with many numbers; a row for each case and actuator."""

import argparse

from pipeline.commands.options import (
    OUT,
    AddVerb,
    add_machine_options,
    add_options,
    add_out_option,
    add_verbose_option,
    given_options,
)
from pipeline.commands.robots import machine_of
from pipeline.simulation.walk_stand import WalkOptions
from pipeline.sweeps import sweep


def add_verbs(add: AddVerb) -> None:
    """Declare the verb."""
    text = "walk with many speeds, loads, postures, dimensions; a row for each case and actuator"
    sub = add("sweep", text, run_sweep)
    sub.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="NAME=VALUES",
        help="a number of --set with its values, 'speed=0.1:0.4:7 m/s' (first, last, how many), "
        "or 'payload_mass=0,5,10 kg'; 'gait.' may be left out",
    )
    add_machine_options(sub, "robot file")
    names = [name for name in WalkOptions.model_fields if name != "motion"]
    add_options(sub, WalkOptions, *names, samples=101)
    text = "number of processes, 2, or the address of a Dask scheduler, such as tcp://host:8786"
    sub.add_argument("--workers", type=number_or_address, default=2, metavar="N|ADDRESS", help=text)
    add_out_option(sub, OUT / "sweep")
    add_verbose_option(sub)


def number_or_address(text: str) -> int | str:
    """How many processes, or where a scheduler is."""
    return text if "://" in text else int(text)


def run_sweep(options: argparse.Namespace) -> int:
    """Walk every case; 1 where the robot walks in none."""
    how = given_options(options, WalkOptions)
    done = sweep(machine_of(options), options.vary, options.out, workers=options.workers, **how)
    done.save(options.out)
    done.point.unlink(missing_ok=True)
    print(done)
    return int(done.refused.total() == done.rows["case"].nunique())
