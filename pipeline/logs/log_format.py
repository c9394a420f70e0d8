"""Column names of the wide log format: `<owner>__<quantity>_<unit>`.

`Expected` is what a log of one robot must look like: joint and foot names, ranges, gear ratios.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from pipeline.robot.robot import Robot

TIME: Final = "time_s"
#: Channels in which measurement and simulation are compared, the most direct first, with unit.
EFFORTS: Final = {"torque": "N*m", "current": "A", "voltage": "V", "power": "W"}
#: Suffix of a joint's column -> (attribute of `Log`, unit as `actuators.units` writes it).
JOINT_COLUMNS: Final = {
    "position_rad": ("position", "rad"),
    "motor_position_rad": ("motor_position", "rad"),
    "velocity_rad_s": ("velocity", "rad/s"),
    "torque_Nm": ("torque", "N*m"),
    "current_A": ("current", "A"),
    "voltage_V": ("voltage", "V"),
    "power_W": ("power", "W"),
    "goal_position_rad": ("goal_position", "rad"),
    "goal_velocity_rad_s": ("goal_velocity", "rad/s"),
    "goal_torque_Nm": ("goal_torque", "N*m"),
    "temperature_degC": ("temperature", "degC"),
}
FOOT_COLUMNS: Final = {
    "force_x_N": ("force_x", "N"),
    "force_y_N": ("force_y", "N"),
    "force_z_N": ("force_z", "N"),
    "contact": ("contact", "1"),
}
BASE_COLUMNS: Final = {
    **{f"{angle}_rad": (f"base_{angle}", "rad") for angle in ("roll", "pitch", "yaw")},
    **{f"angular_velocity_{x}_rad_s": (f"base_angular_velocity_{x}", "rad/s") for x in "xyz"},
    "temperature_degC": ("base_temperature", "degC"),
}
#: What the supply of all drives gives; positive out of it.
SUPPLY_COLUMNS: Final = {
    "voltage_V": ("supply", "V"),
    "current_A": ("supply_current", "A"),
    "power_W": ("supply_power", "W"),
}
_SUFFIX: Final = {
    quantity: suffix
    for table in (JOINT_COLUMNS, SUPPLY_COLUMNS, BASE_COLUMNS)
    for suffix, (quantity, _) in table.items()
}


class Target(NamedTuple):
    """What a column means."""

    name: str  #: In the log format, a foot by its leg.
    quantity: str  #: Of the joint, foot, base or supply.
    unit: str  #: In which the log keeps it.


def column_name(owner: str, quantity: str) -> str:
    """Header in the log format of a channel of a joint, or of the owner ``supply``."""
    return f"{owner}__{_SUFFIX[quantity]}"


@dataclass(frozen=True)
class Expected:
    """Names and limits against which a log is read."""

    robot: str  #: The robot's name, for messages.
    joints: tuple[str, ...]  #: In the order of the columns.
    lower: Array  #: Position limits, -inf where there is none, shape (J,) [rad].
    upper: Array  #: Position limits, inf where there is none, shape (J,) [rad].
    effort_limit: Array  #: Joint torque, inf where there is none, shape (J,) [N*m].
    feet: tuple[str, ...] = ()  #: Names of legs in order.
    #: Other names of the same feet (their frames) to the leg's name.
    foot_alias: Mapping[str, str] = field(default_factory=dict)
    #: Motor angle per joint angle, signed, shape (J,); None where it is not known.
    ratio: Array | None = None
    #: What the feet carry [N]; None for a robot that does not stand on its feet.
    weight: float | None = None
    #: Channel to the largest magnitude that the drives can give, shape (J,), where it is known.
    largest: Mapping[str, Array] = field(default_factory=dict)

    @cached_property
    def columns(self) -> dict[str, Target]:
        """Every column that a log of this robot may have, and what it means."""
        feet = {name: name for name in self.feet} | {**self.foot_alias}
        owners = [
            *((joint, joint, JOINT_COLUMNS) for joint in self.joints),
            *((name, foot, FOOT_COLUMNS) for name, foot in feet.items()),
            ("base", "base", BASE_COLUMNS),
            ("supply", "supply", SUPPLY_COLUMNS),
        ]
        out = {TIME: Target(TIME, "time", "s")}
        for called, owner, table in owners:
            for suffix, (quantity, unit) in table.items():
                out.setdefault(f"{called}__{suffix}", Target(f"{owner}__{suffix}", quantity, unit))
        return out


def _limits(values: Array) -> Array:
    # Pinocchio writes "no limit" as the largest double, and URDFs often as zero.
    return np.where((np.abs(values) > 1e100) | (values == 0.0), np.inf, values)


def expected_of_robot(robot: Robot, *, ratio: Array | None = None) -> Expected:
    """Names and limits of a robot; a foot goes by its leg's or its frame's name.

    `ratio`: motor angle per joint angle, shape (J,).
    """
    model, own = robot.model, robot.velocity_index
    lower, upper = robot.limits
    gravity = float(np.linalg.norm(model.gravity.linear))
    return Expected(
        robot=robot.spec.name,
        joints=robot.joints,
        lower=lower,
        upper=upper,
        effort_limit=_limits(model.effortLimit[own]),
        ratio=None if ratio is None else np.asarray(ratio, dtype=np.float64),
        feet=robot.leg_names,
        foot_alias={leg.foot: leg.name for leg in robot.spec.legs},
        weight=gravity * float(pin.computeTotalMass(model)) if robot.floating else None,
    )
