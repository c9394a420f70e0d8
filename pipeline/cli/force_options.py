"""Options of the ground's forces."""

from __future__ import annotations

import argparse


def add_force_options(sub: argparse.ArgumentParser) -> None:
    """Rule, friction, and whether the rules are to be compared."""
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
        help="greatest tangential over normal force of a foot; no limit by default",
    )
    sub.add_argument(
        "--compare-forces",
        action="store_true",
        help="write walking_force_rules.csv: what each rule costs in energy",
    )
