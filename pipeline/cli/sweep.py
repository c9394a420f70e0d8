"""The verb sweep: walk with many numbers; a row for each case and actuator."""

from __future__ import annotations

import argparse
from dataclasses import fields

from pipeline.cli.options import (
    DECIMAL,
    OUT,
    AddVerb,
    add_out_option,
    add_verbose_option,
    add_walk_options,
    changes_of,
    named,
    named_path,
)


def add_verb(add: AddVerb) -> None:
    """Declare the verb."""
    text = "walk with many speeds, loads, postures, dimensions; a row for each case and actuator"
    sub = add("sweep", text, run_sweep)
    sub.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="NAME=VALUES",
        help="a number of --set with its values, 'speed=0.1:0.4:7 m/s' (first, last, how many), "
        "'payload=0,5,10 kg', or with --sample a range, 'lift=20:60 mm'; 'gait.' may be left out",
    )
    text = 'TOML with a table [vary] of lines NAME = "VALUES", in place of or beside --vary'
    sub.add_argument("--plan", type=named_path, metavar="FILE", help=text)
    text = "draw so many cases; every combination by default"
    sub.add_argument("--sample", type=int, metavar="N", help=text)
    sub.add_argument("--seed", type=int, default=1, help="of the draw; 1")
    add_walk_options(sub, samples=101)
    text = "number of processes, 2, or the address of a Dask scheduler, such as tcp://host:8786"
    sub.add_argument("--workers", type=_workers, default=2, metavar="N|ADDRESS", help=text)
    add_out_option(sub, OUT / "sweep")
    add_verbose_option(sub)


def _workers(text: str) -> int | str:
    if "://" in text:
        return text
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"'{text}' is neither a number nor an address such as tcp://host:8786"
        ) from None


def run_sweep(options: argparse.Namespace) -> int:
    """Walk every case; 1 where the robot walks in none."""
    from pipeline.atomic import output_errors
    from pipeline.sweep.plan import read_plan
    from pipeline.sweep.sweep import Order, sweep

    asked = named(options, (f.name for f in fields(Order)))
    how = named(options, ("sample", "seed", "workers"))
    with output_errors(options.out):
        options.out.mkdir(parents=True, exist_ok=True)
        order = Order(**asked, changes=tuple(changes_of(options.set).items()))
        vary = [*(read_plan(options.plan) if options.plan else ()), *options.vary]
        done = sweep(order, vary, options.out, **how)
    done.save(options.out, decimal=DECIMAL[options.decimal])
    done.point.unlink(missing_ok=True)
    print(done)
    return int(done.refused.total() == done.rows["case"].nunique())
