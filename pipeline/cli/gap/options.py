"""Options of the verb `gap` and its steps."""

from __future__ import annotations

import argparse
from dataclasses import fields
from pathlib import Path

from pipeline.cli.decimal_option import add_decimal_option, decimal_of
from pipeline.cli.named_path import named_path
from pipeline.cli.walk_options import add_gait_option, changes_of
from pipeline.identification.workflow.options import DEFAULT_OUT, STEPS, Options


def add_gap_options(sub: argparse.ArgumentParser) -> None:
    """Declare the options."""
    sub.add_argument(
        "items",
        nargs="+",
        metavar="[STEP] LOG",
        help="logs (CSV or Parquet) to learn from; a step in front of them does that step only: "
        + "; ".join(f"{name}: {text}" for name, text in STEPS.items()),
    )
    sub.add_argument(
        "--robot",
        type=named_path,
        help="robot file, or URDF of a fixed robot; the model file's or the hexapod by default",
    )
    sub.add_argument("--model", type=named_path, help="model file with effects found earlier")
    add_gait_option(sub)
    sub.add_argument(
        "--holdout",
        type=named_path,
        nargs="+",
        default=[],
        metavar="LOG",
        help="logs on which the result is tested; nothing is fitted to them",
    )
    sub.add_argument(
        "--base",
        choices=["fixed", "level", "measured"],
        help="how the base stands; measured where the log has roll or pitch, else level or fixed "
        "as the robot file says",
    )
    sub.add_argument(
        "--gait-start",
        type=float,
        metavar="SECONDS",
        help="time in the log at which a period of the gait begins: tells which feet "
        "stand where the log has neither foot forces nor contacts; the lowest feet without it",
    )
    _machine_options(sub)
    _comparison_options(sub)
    sub.add_argument(
        "--out",
        type=named_path,
        default=DEFAULT_OUT,
        help=f"folder for what is written; {DEFAULT_OUT}",
    )
    add_decimal_option(sub)
    sub.add_argument("-v", "--verbose", action="store_true", help="say what is being done")


def _comparison_options(sub: argparse.ArgumentParser) -> None:
    """What of the logs is compared, and how."""
    sub.add_argument("--mapping", type=named_path, help="mapping file (TOML) for foreign columns")
    sub.add_argument(
        "--effort",
        metavar="CHANNEL",
        help="measured quantity that is compared: torque, current, voltage or "
        "power; the first of them in the log by default",
    )
    sub.add_argument(
        "--cutoff",
        type=float,
        metavar="HZ",
        help="cut-off frequency of the low-pass filter; chosen from the noise by default",
    )
    sub.add_argument(
        "--prove-last",
        type=float,
        metavar="SHARE",
        help="test on this last share of every log instead of on blocks in between",
    )


def _machine_options(sub: argparse.ArgumentParser) -> None:
    """What drives the joints, and numbers that differ."""
    sub.add_argument(
        "--alternative",
        metavar="NAME",
        help="actuator between joint and supply: ideal, rotor (default), reversible or "
        "irreversible, or one of --actuators; a bare URDF has none by default",
    )
    sub.add_argument(
        "--actuators", type=named_path, metavar="DIR", help="folder of actuator files of your own"
    )
    sub.add_argument(
        "--set",
        dest="changes",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change a number for this run, as `walk` takes it",
    )


def options_of(given: argparse.Namespace) -> Options:
    """What the command line asks for."""
    first, *rest = given.items
    # A log file that is called like a step is a log.
    step, logs = (
        (first, rest) if first in STEPS and not Path(first).is_file() else ("all", given.items)
    )
    named = {f.name: getattr(given, f.name) for f in fields(Options) if hasattr(given, f.name)}
    named |= {"step": step, "logs": tuple(Path(item) for item in logs)}
    named |= {"holdout": tuple(given.holdout), "changes": changes_of(given.changes)}
    return Options(**{**named, "decimal": decimal_of(given)})
