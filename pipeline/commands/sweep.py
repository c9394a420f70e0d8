"""Sweep: walk with many numbers; a row for each case and actuator."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pipeline.atomic import output_errors
from pipeline.commands.options import (
    DECIMAL,
    OF_MACHINE,
    OUT,
    AddVerb,
    add_machine_options,
    add_options,
    add_out_option,
    add_verbose_option,
    changes_of,
    given_options,
)
from pipeline.commands.robots import found_robot
from pipeline.simulation.options import WalkOptions
from pipeline.sweeps.sweep import Order, Swept, run


def sweep(
    robot: str | Path | None,
    vary: Sequence[str],
    folder: str | Path,
    *,
    model: str | Path | None = None,
    gait: str | Path | None = None,
    actuators: str | Path | None = None,
    changes: Mapping[str, object] | None = None,
    workers: int | str = 1,
    **options: Any,
) -> Swept:
    """Walk with every combination of values.

    Args:
        robot: As `load` takes it; files rather than a machine, since any process reads them again.
        vary: Numbers of ``--set`` with their values, such as ``"speed=0.1:0.4:7 m/s"``.
        folder: In which finished cases are kept until all are done; a run that was stopped goes on
            from them.
        model, gait, actuators, changes: See `load`.
        workers: Processes, or the address of a Dask scheduler.
        **options: See `pipeline.simulation.options.WalkOptions`.

    Raises:
        LegwattError: Unusable axes or machine, or workers that are gone; what was finished stays.
    """
    out = Path(folder)
    order = Order(
        robot=found_robot(robot),
        model=Path(model) if model else None,
        gait=Path(gait) if gait else None,
        actuators=Path(actuators) if actuators else None,
        changes=tuple((changes or {}).items()),
        options=WalkOptions.of(**options),
    )
    with output_errors(out):
        out.mkdir(parents=True, exist_ok=True)
        return run(order, vary, out, workers=workers)


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
        "or 'payload=0,5,10 kg'; 'gait.' may be left out",
    )
    add_machine_options(sub, "robot file")
    names = [name for name in WalkOptions.model_fields if name != "motion"]
    add_options(sub, WalkOptions, *names, samples=101)
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
    done = sweep(
        **{name: getattr(options, name) for name in (*OF_MACHINE, "workers")},
        vary=options.vary,
        folder=options.out,
        changes=changes_of(options.set),
        **given_options(options, WalkOptions),
    )
    done.save(options.out, decimal=DECIMAL[options.decimal])
    done.point.unlink(missing_ok=True)
    print(done)
    return int(done.refused.total() == done.rows["case"].nunique())
