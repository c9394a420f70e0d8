"""The verbs sweep, twin, blind and calibrate: their options."""

from __future__ import annotations

import argparse

from pipeline.cli.options import (
    OUT,
    AddVerb,
    add_verbose_option,
    add_walk_options,
    changes_of,
    folder_held,
    named_path,
)


def add_verbs(add: AddVerb) -> None:
    """Declare the verbs."""
    _add_sweep(add)
    twin = add("twin", "simulate a machine with hidden effects and write its log", _run_twin)
    sources = "own: inverse of the true machine; mujoco: forward dynamics with a controller"
    twin.add_argument("--source", default="own", help=f"{sources}; own by default")
    twin.add_argument("--seed", type=int, default=1, help="of the random numbers")
    twin.add_argument("--number", type=int, default=0, help="of the trial; 0")
    text = "pendulum, leg, arm or walk (hexapod; own only); drawn by default"
    twin.add_argument("--machine", help=text)
    text = "effects to hide; drawn by default, none without names"
    twin.add_argument("--hide", nargs="*", metavar="EFFECT", help=text)
    text = "hide it between the supply and the motors of a walking hexapod, for gap power"
    twin.add_argument("--supply", action="store_true", help=text)
    twin.add_argument("--out", type=named_path, required=True, help="new folder for the trial")

    text = "simulate machines with hidden effects and count how often gap finds them"
    blind = add("blind", text, _run_blind)
    blind.add_argument(
        "--source", choices=["own", "mujoco", "both"], default="own", help=f"{sources}; own"
    )
    blind.add_argument("--trials", type=int, default=60, help="number per source; 60")
    blind.add_argument("--seed", type=int, default=1, help="of the random numbers")
    blind.add_argument("--workers", type=int, default=2, help="number of processes; 2")
    text = "address of a Dask scheduler whose workers run the trials, e.g. tcp://10.0.0.1:8786"
    blind.add_argument("--scheduler", metavar="ADDRESS", help=text)
    blind.add_argument("--resume", action="store_true", help="go on where a run was stopped")
    text = "folder for everything written"
    blind.add_argument("--out", type=named_path, default=OUT / "blind", help=text)


def _add_sweep(add: AddVerb) -> None:
    text = "walk with many speeds, loads, postures, dimensions; a row for each case and actuator"
    sub = add("sweep", text, _run_sweep)
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
    text = "of the draw: sobol (default), or lhs, a Latin hypercube"
    sub.add_argument("--method", default="sobol", help=text)
    sub.add_argument("--seed", type=int, default=1, help="of the draw; 1")
    add_walk_options(sub, samples=101)
    sub.add_argument("--workers", type=int, default=2, help="number of processes; 2")
    text = "send the cases to a Dask scheduler, such as tcp://host:8786, in place of processes"
    sub.add_argument("--scheduler", metavar="ADDRESS", help=text)
    text = "folder for sweep.parquet; the same command goes on where it was stopped there"
    sub.add_argument("--out", type=named_path, default=OUT / "sweep", help=text)
    add_verbose_option(sub)


def add_calibrate(add: AddVerb) -> None:
    """Declare the verb calibrate."""
    text = "fit the unpublished numbers to the paper's figures and store them"
    calibrate = add("calibrate", text, _run_calibrate)
    robot = named_path("urdf/hexapod.toml")
    calibrate.add_argument("--robot", type=named_path, default=robot, help="robot file")
    calibrate.add_argument("--workers", type=int, default=2, help="number of processes")
    calibrate.add_argument("--seed", type=int, default=1, help="of the random numbers")


def _run_sweep(options: argparse.Namespace) -> int:
    from pipeline.atomic import output_errors

    with folder_held(options), output_errors(options.out):
        from pipeline.simulation.force_choice import ForceChoice
        from pipeline.sweep.case import Order
        from pipeline.sweep.plan import read_plan
        from pipeline.sweep.sweep import sweep

        done = sweep(
            Order(
                *(options.robot, options.model, options.gait, options.actuators),
                tuple(changes_of(options.set).items()),
                options.samples,
                options.quasi_static,
                options.regeneration,
                ForceChoice(options.forces, options.power_of, options.friction_coefficient),
            ),
            [*(read_plan(options.plan) if options.plan else ()), *options.vary],
            options.out,
            sample=options.sample,
            method=options.method,
            seed=options.seed,
            workers=options.workers,
            scheduler=options.scheduler,
        )
    print(done)
    return int(sum(done.refused.values()) == done.cases)


def _run_twin(options: argparse.Namespace) -> int:
    with folder_held(options):
        from pipeline.cli.twin import run_twin

        return run_twin(options)


def _run_blind(options: argparse.Namespace) -> int:
    from pipeline.atomic import output_errors

    with folder_held(options), output_errors(options.out):
        from pipeline.cli.blind import run_blind

        return run_blind(options)


def _run_calibrate(options: argparse.Namespace) -> int:
    from pipeline.atomic import output_errors
    from pipeline.cli.calibrate import WORK, run_calibrate
    from reports.folder import holding

    with holding(WORK), output_errors(WORK):
        return run_calibrate(options)
