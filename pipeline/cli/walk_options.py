"""Options of everything that walks: the machine, its gait, the ground's forces."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from typing import TYPE_CHECKING

from actuators.errors import one_line
from pipeline.cli.named_path import named_path
from pipeline.errors import RobotFileError

if TYPE_CHECKING:
    from pipeline.simulation.ground_forces.force_choice import ForceChoice


def changes_of(texts: Iterable[str]) -> dict[str, str]:
    """Keys and values of ``--set KEY=VALUE``; the last counts where a key comes twice.

    Raises:
        RobotFileError: One is something else.
    """
    changes = {}
    for text in texts:
        key, _, value = (part.strip() for part in text.partition("="))
        if not key or not value:
            raise RobotFileError(f"--set {one_line(text)}: expected KEY=VALUE")
        changes[key] = value
    return changes


def add_machine_options(sub: argparse.ArgumentParser) -> None:
    """Robot, gait, effects, actuators, and numbers that differ."""
    sub.add_argument(
        "--robot", type=named_path, help="robot file; the model file's or the hexapod by default"
    )
    add_gait_option(sub)
    sub.add_argument(
        "--model", type=named_path, help="model file: include the effects that `gap` found"
    )
    sub.add_argument(
        "--actuators",
        type=named_path,
        metavar="DIR",
        help="folder of actuator files of your own; actuators/catalog by default",
    )
    sub.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change a number for this run: NAME=VALUE in the unit the robot file writes, "
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


def add_gait_option(sub: argparse.ArgumentParser) -> None:
    """A gait of its own file."""
    sub.add_argument(
        "--gait",
        type=named_path,
        metavar="FILE",
        help="TOML with a table [gait] to walk instead of the robot file's",
    )


def add_force_options(sub: argparse.ArgumentParser) -> None:
    """Rule and friction."""
    sub.add_argument(
        "--forces",
        default="least_tangential",
        metavar="RULE",
        help="how the ground's forces are chosen: least_tangential (the paper's rule), "
        "least_torque (joint torques squared), least_power (of the actuator in --power-of)",
    )
    sub.add_argument("--power-of", metavar="ALTERNATIVE", help="actuator of --forces least_power")
    sub.add_argument(
        "--friction-coefficient",
        type=float,
        metavar="MU",
        help="greatest tangential over normal force of a foot; gait.friction_coefficient, else no "
        "limit, by default",
    )


def force_choice(options: argparse.Namespace) -> ForceChoice:
    """What the command line says of the ground's forces."""
    from pipeline.simulation.ground_forces.force_choice import ForceChoice

    return ForceChoice(options.forces, options.power_of, options.friction_coefficient)
