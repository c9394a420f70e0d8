"""Tables of the robot standing still (Tables III to VI of the paper)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from actuators.chain import HoldingResult
from pipeline.column import column
from pipeline.dynamics.contact_forces import ContactForces
from pipeline.dynamics.joint_demand import JointDemand
from reports.table import Table, table_of


@dataclass(frozen=True)
class HeldJoint:
    """What an alternative needs to hold a joint."""

    table: ClassVar = "standing"
    about: ClassVar = "Standing still: torques are positive in the joint's positive direction."
    alternative: str = column("actuator alternative")
    joint: str = column("joint")
    joint_torque_Nm: float = column("torque the actuator applies to hold the joint", "N*m")
    motor_torque_Nm: float = column("motor torque of least magnitude that holds", "N*m")
    current_A: float = column("motor current", "A")
    voltage_V: float = column("motor voltage", "V")
    power_W: float = column("electrical power from supply to motor", "W")
    holding_low_Nm: float = column("smallest motor torque that holds", "N*m")
    holding_high_Nm: float = column("largest motor torque that holds", "N*m")


@dataclass(frozen=True)
class JointPosition:
    """Where a joint stands."""

    table: ClassVar = "standing_posture"
    joint: str = column("joint")
    position_rad: float = column("position from the zero pose of the robot file", "rad")


@dataclass(frozen=True)
class Foot:
    """Place of a foot and force on it."""

    table: ClassVar = "standing_contacts"
    about: ClassVar = "Standing still; lifted feet carry 0 N."
    foot: str = column("leg whose foot this is")
    x_m: float = column("foot point, x in the base frame", "m")
    y_m: float = column("foot point, y in the base frame", "m")
    z_m: float = column("foot point, z in the base frame", "m")
    force_x_N: float = column("force of the ground on the robot, world x", "N")
    force_y_N: float = column("force of the ground on the robot, world y", "N")
    force_z_N: float = column("force of the ground on the robot, world z", "N")
    friction_needed: float = column("tangential over normal force; empty for a lifted foot", "1")


def standing(demand: JointDemand, holding: Mapping[str, HoldingResult]) -> Table:
    """What every alternative needs to hold every joint."""
    rows = []
    for name, h in holding.items():
        values = (demand.torque[0], h.motor_torque, h.current, h.voltage, h.power, h.low, h.high)
        own = zip(demand.joints, *values, strict=True)
        rows += [HeldJoint(name, *row) for row in own]
    return table_of(HeldJoint, rows)


def standing_posture(demand: JointDemand) -> Table:
    """Joint positions while standing."""
    rows = [JointPosition(*row) for row in zip(demand.joints, demand.position[0], strict=True)]
    return table_of(JointPosition, rows)


def standing_contacts(contacts: ContactForces) -> Table:
    """Feet and ground forces while standing."""
    places = zip(
        contacts.legs,
        contacts.position[0],
        contacts.force_world[0],
        contacts.friction_needed[0],
        strict=True,
    )
    rows = [
        Foot(leg, *(float(x) for x in (*point, *force, needed)))
        for leg, point, force, needed in places
    ]
    return table_of(Foot, rows)
