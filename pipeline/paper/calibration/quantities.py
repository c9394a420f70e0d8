"""Every quantity the paper prints, computed, by the id of `published_values.csv`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from actuators.chain import HoldingResult
from pipeline.paper.calibration.machine import PUBLISHED_LEG, ActuatorPart, RobotPart
from pipeline.simulation.break_even import break_even

STANDING_SECONDS = 3.0  # section IV.B adds up over the duration of a walking cycle
#: Between which the break-even is.
PAIR = ("reversible", "irreversible")
_ALTERNATIVES = ("ideal", "rotor", "reversible")
#: id prefix to the property of a holding result, its dimension
_STANDING = {
    "motor_torque": (lambda h: h.motor_torque, "torque"),
    "current": (lambda h: h.current, "current"),
    "voltage": (lambda h: h.voltage, "voltage"),
    "power": (lambda h: h.power, "power"),
}
_INPUTS = {
    "body_length": ("body_length", "length"),
    "robot_width": ("robot_width", "length"),
    "femur_length": ("femur_length", "length"),
    "tibia_length": ("tibia_length", "length"),
    "robot_mass": ("total_mass", "mass"),
    "foot_stroke_longitudinal": ("foot_stroke", "length"),
    "foot_stroke_vertical": ("foot_lift", "length"),
    "gait_period": ("gait_period", "time"),
}


@dataclass(frozen=True)
class Quantity:
    """One computed quantity.

    Attributes:
        dimension: Of its unit.
        compute: From both parts and the number of middle legs that stand, in SI units.
        needs: Alternatives without which there is no such quantity.
    """

    dimension: str
    compute: Callable[[RobotPart, ActuatorPart, int], float]
    needs: tuple[str, ...] = ()


def pair_break_even(
    energy: Mapping[str, Mapping[str, float]], standing_power: float, legs: int
) -> float:
    """Fraction of time standing above which the irreversible actuator uses less energy.

    Fig. 21 adds up both middle legs: walking, both take their energy per cycle; standing, `legs` of
    them take the holding power of the reversible actuator, the irreversible one takes nothing.

    Args:
        energy: Electrical energy per cycle [J], alternative to leg.
        standing_power: Of one loaded leg with the reversible actuator [W].
        legs: How many of the two middle legs stand loaded.
    """
    extra = sum(energy["irreversible"].values()) - sum(energy["reversible"].values())
    return break_even(extra, legs * standing_power * STANDING_SECONDS)


def walking_extra(energy: Mapping[str, Mapping[str, float]]) -> float:
    """Mean of both middle legs: irreversible less reversible energy per cycle [J]."""
    extra = sum(energy["irreversible"].values()) - sum(energy["reversible"].values())
    return extra / len(energy["reversible"])


def _quantities() -> dict[str, Quantity]:
    table: dict[str, Quantity] = {}
    for name, (parameter, dimension) in _INPUTS.items():
        table[name] = Quantity(
            dimension,
            lambda r, a, n, p=parameter: r.robot.spec.parameters[p],  # type: ignore[misc]
        )
    table["walking_speed"] = Quantity(
        "velocity", lambda r, a, n: r.robot.spec.parameters["walking_speed"]
    )
    table["transmission_ratio"] = Quantity(
        "ratio", lambda r, a, n: float(np.asarray(a.chains["reversible"].ratio)), ("reversible",)
    )
    table["standing_reaction_rm"] = Quantity("force", lambda r, a, n: r.reaction)
    for joint in (1, 2, 3):
        table[f"standing_torque_{joint}"] = Quantity(
            "torque",
            lambda r, a, n, j=joint: float(r.standing_torque[j - 1]),  # type: ignore[misc]
        )
    for alternative in _ALTERNATIVES:
        for what, (read, dimension) in _STANDING.items():
            for joint in (2, 3):
                table[f"{alternative}_{what}_{joint}"] = Quantity(
                    dimension, _standing_reader(alternative, read, joint), (alternative,)
                )
    for alternative in (*_ALTERNATIVES, "irreversible"):
        table[f"{alternative}_leg_energy_3s"] = Quantity(
            "energy", _standing_energy(alternative), (alternative,)
        )
    for alternative in ("rotor", "reversible", "irreversible"):
        table[f"walking_ratio_{alternative}"] = Quantity(
            "ratio", _walking_ratio(alternative), (alternative, "ideal")
        )
    table["break_even_standing_fraction"] = Quantity(
        "ratio",
        lambda r, a, n: pair_break_even(a.energy, float(a.holding["reversible"].power.sum()), n),
        PAIR,
    )
    return table


def _standing_reader(
    alternative: str, read: Callable[[HoldingResult], np.ndarray], joint: int
) -> Callable[[RobotPart, ActuatorPart, int], float]:
    return lambda r, a, n: float(read(a.holding[alternative])[joint - 1])


def _standing_energy(alternative: str) -> Callable[[RobotPart, ActuatorPart, int], float]:
    return lambda r, a, n: float(a.holding[alternative].power.sum()) * STANDING_SECONDS


def _walking_ratio(alternative: str) -> Callable[[RobotPart, ActuatorPart, int], float]:
    return lambda r, a, n: a.energy[alternative][PUBLISHED_LEG] / a.energy["ideal"][PUBLISHED_LEG]


QUANTITIES = _quantities()
IDS = tuple(QUANTITIES)
DIMENSIONS = {name: quantity.dimension for name, quantity in QUANTITIES.items()}


def computed(robot: RobotPart, actuators: ActuatorPart, standing_legs: int) -> dict[str, float]:
    """Every published quantity in SI units that these actuators have.

    Args:
        robot: The robot's part.
        actuators: The actuators' part; the paper's alternatives or some of them.
        standing_legs: How many middle legs Fig. 21 counts as loaded, 1 or 2.
    """
    return {
        name: q.compute(robot, actuators, standing_legs)
        for name, q in QUANTITIES.items()
        if all(alternative in actuators.chains for alternative in q.needs)
    }
