"""Tables of the robot standing still (Tables III to VI of the paper, for every leg)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from actuators.chain import HoldingResult
from pipeline.dynamics.contact_forces import ContactForces
from pipeline.dynamics.demand import JointDemand
from reports.table import Table, table_from_rows

#: Time over which the paper adds up standing energy: that of one gait cycle [s].
STANDING_TIME = 3.0


def standing(demand: JointDemand, holding: Mapping[str, HoldingResult]) -> Table:
    """What every alternative needs to hold every joint."""
    rows = [
        {
            "alternative": name,
            "joint": joint,
            "joint_torque_Nm": demand.torque[0, j],
            "motor_torque_Nm": result.motor_torque[j],
            "current_A": result.current[j],
            "voltage_V": result.voltage[j],
            "power_W": result.power[j],
            "holding_low_Nm": result.low[j],
            "holding_high_Nm": result.high[j],
        }
        for name, result in holding.items()
        for j, joint in enumerate(demand.joints)
    ]
    return table_from_rows(
        "standing",
        rows,
        {
            "alternative": ("actuator alternative", ""),
            "joint": ("joint", ""),
            "joint_torque_Nm": ("torque the actuator applies to hold the joint", "N*m"),
            "motor_torque_Nm": ("motor torque of least magnitude that holds", "N*m"),
            "current_A": ("motor current", "A"),
            "voltage_V": ("motor voltage", "V"),
            "power_W": ("electrical power from supply to motor", "W"),
            "holding_low_Nm": ("smallest motor torque that holds", "N*m"),
            "holding_high_Nm": ("largest motor torque that holds", "N*m"),
        },
        "Standing still: torques are positive in the joint's positive direction.",
    )


def standing_energy(
    demand: JointDemand, holding: Mapping[str, HoldingResult], legs: Mapping[str, Sequence[str]]
) -> Table:
    """Electrical energy of each leg in three seconds of standing.

    Args:
        demand: For the order of the joints.
        holding: By alternative.
        legs: Leg to its joints.
    """
    rows = []
    for name, result in holding.items():
        for leg, joints in legs.items():
            power = sum(float(result.power[demand.joints.index(j)]) for j in joints)
            rows.append({"alternative": name, "leg": leg, "energy_J": power * STANDING_TIME})
    return table_from_rows(
        "standing_energy",
        rows,
        {
            "alternative": ("actuator alternative", ""),
            "leg": ("leg; those not among the standing feet are lifted", ""),
            "energy_J": ("electrical energy of the leg in 3 s", "J"),
        },
    )


def standing_posture(demand: JointDemand) -> Table:
    """Joint positions while standing."""
    return Table(
        "standing_posture",
        {"joint": list(demand.joints), "position_rad": demand.position[0]},
        {
            "joint": ("joint", ""),
            "position_rad": ("position from the zero pose of the robot file", "rad"),
        },
    )


def standing_contacts(contacts: ContactForces) -> Table:
    """Feet and ground forces while standing."""
    columns: dict[str, Any] = {"foot": list(contacts.legs)}
    meanings = {"foot": ("leg whose foot this is", "")}
    for k, axis in enumerate("xyz"):
        columns[f"{axis}_m"] = contacts.position[0, :, k]
        meanings[f"{axis}_m"] = (f"foot point, {axis} in the base frame", "m")
    for k, axis in enumerate("xyz"):
        columns[f"force_{axis}_N"] = contacts.force_world[0, :, k]
        meanings[f"force_{axis}_N"] = (f"force of the ground on the robot, world {axis}", "N")
    columns["friction_needed"] = contacts.friction_needed[0]
    meanings["friction_needed"] = ("tangential over normal force; empty for a lifted foot", "1")
    return Table("standing_contacts", columns, meanings, "Standing still; lifted feet carry 0 N.")
