"""Tables of the robot standing still, and of one walking cycle."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from actuators.arrays import Array
from actuators.chain import ChainResult, HoldingResult
from actuators.energy.energy import Supply, loss_energies, stage_energies
from actuators.energy.limits import LimitRow
from pipeline.column import column
from pipeline.dynamics.contact_forces import ContactForces
from pipeline.dynamics.joint_demand import JointDemand, MotionDemand
from pipeline.motion.feet import base_in_world
from pipeline.motion.gait import Gait
from pipeline.motion.motion import Motion
from pipeline.robot.inverse.inverse_kinematics import FootTracking
from reports.table import Quantity, Table, table_of, wide_series

#: Rules of the ground's forces in words.
_FORCES = {"least_tangential": "Least tangential", "least_torque": "Least joint torque squared:"}
_STUCK = "of the direction, in the base frame at the motion's start, in which the foot is stuck"


@dataclass(frozen=True)
class LegGait:
    """When a leg stands, and how far and high its foot steps."""

    table: ClassVar = "walking_gait"
    leg: str = column("leg")
    touch_down: float = column("instant of touch-down as a share of the period", "1")
    duty_factor: float = column("share of the period for which the foot stands", "1")
    stroke_m: float = column("path of the foot relative to the body while it stands", "m")
    lift_m: float = column("height of the foot at the middle of its transfer", "m")


@dataclass(frozen=True)
class TrackingRow:
    """How well a leg follows its foot's path; a row for each direction that it lacks."""

    table: ClassVar = "foot_tracking"
    about: ClassVar = (
        "How well the legs follow their feet's paths; a leg that lacks a direction puts its foot "
        "as near to the path as it gets."
    )
    leg: str = column("leg")
    joints: int = column("joints of the leg", "1")
    directions: int = column("directions in which they move the foot", "1")
    cannot_move_x: float | None = column(f"x component {_STUCK}; empty where it moves in all", "1")
    cannot_move_y: float | None = column(f"y component {_STUCK}", "1")
    cannot_move_z: float | None = column(f"z component {_STUCK}", "1")
    deviation_m: float = column("largest distance of the foot from its path", "m")
    deviation_time_s: float = column("when it is so far off; empty where it follows", "s")
    least_singular_value_m: float = column(
        "smallest singular value of the foot's Jacobian along the motion: near zero the leg is "
        "stretched or folded",
        "m",
    )
    singular_time_s: float = column("when it is that small", "s")


@dataclass(frozen=True)
class StageRow:
    """Energy through one stage of a joint's actuator."""

    table: ClassVar = "walking_stage_energy"
    alternative: str = column("actuator alternative")
    joint: str = column("joint")
    stage: str = column("shaft, from the joint (out) to the motor (m) and the supply (el)")
    stage_name: str = column("where that is, in words")
    forward_J: float = column("E(+): energy per cycle from the supply towards the joint", "J")
    reverse_J: float = column("E(-): energy per cycle the other way, as a positive number", "J")


@dataclass(frozen=True)
class LossRow:
    """What an element of a joint's actuator turns into heat."""

    table: ClassVar = "walking_losses"
    alternative: str = column("actuator alternative")
    joint: str = column("joint; 'bus' where all joints share the supply")
    element: str = column(
        "element of the chain; dumped_return: returned electrical energy that is lost"
    )
    loss_J: float = column("energy dissipated per cycle", "J")


@dataclass(frozen=True)
class MotorLimit:
    """A peak against the motor's data sheet."""

    table: ClassVar = "motor_limits"
    alternative: str = column("actuator alternative")
    joint: str = column("joint")
    quantity: str = column("motor speed, voltage, current, or rms_current over the cycle")
    unit: str = column("unit of limit and peak")
    limit: float = column("what the data sheet allows, in the row's unit", "see unit")
    peak: float = column("largest magnitude over the cycle, in the row's unit", "see unit")
    at_time_s: float = column("instant of the peak", "s")
    share_of_time_over: float = column("share of the cycle above the limit", "1")
    breach: bool = column("whether the peak is above the limit")


def walking_gait(gait: Gait) -> Table:
    """The gait as it was walked, leg by leg."""
    rows = [
        LegGait(leg, gait.footfall.phase[leg], gait.footfall.duty[leg], float(stroke), float(lift))
        for leg, stroke, lift in zip(gait.legs, gait.strokes, gait.lift, strict=True)
    ]
    text = (
        f"{gait.title[0].upper()}{gait.title[1:]}: period {gait.period:.6g} s, speed "
        f"{gait.speed:.6g} m/s, yaw rate {gait.twist[2]:.6g} rad/s."
    )
    return table_of(LegGait, rows, about=text)


def foot_tracking(legs: Sequence[FootTracking]) -> Table:
    """One row for each leg, and one more for each further direction that it lacks."""
    rows = []
    for leg in legs:
        for x, y, z in leg.cannot_move or ((None, None, None),):
            head = (leg.leg, leg.joints, leg.directions, x, y, z)
            apart = (leg.deviation, leg.deviation_time)
            rows.append(TrackingRow(*head, *apart, leg.least_singular_value, leg.singular_time))
    return table_of(TrackingRow, rows)


def walking_base(motion: Motion) -> Table:
    """Place, attitude and motion of the base link in the world.

    Args:
        motion: Of a robot with a floating base.
    """
    series = [base_in_world(segment) for segment in motion.segments]
    quantities = []
    for name, unit, meaning, field in (
        ("{}", "m", "origin of the base link in the world, {}", "position"),
        ("{}", "rad", "attitude: yaw after pitch after roll, {}", "angles"),
        ("velocity_{}", "m/s", "velocity of that origin, world {}", "velocity"),
        ("acceleration_{}", "m/s^2", "acceleration of that origin, world {}", "acceleration"),
        (
            "angular_velocity_{}",
            "rad/s",
            "angular velocity, world {}; steady, so that its derivative is zero",
            "angular_velocity",
        ),
    ):
        values = np.concatenate([getattr(part, field) for part in series])
        axes = ("roll", "pitch", "yaw") if field == "angles" else "xyz"
        quantities += [
            Quantity(name.format(axis), unit, meaning.format(axis), values[:, [k]])
            for k, axis in enumerate(axes)
        ]
    return wide_series(
        "walking_base",
        np.concatenate([segment.time for segment in motion.segments]),
        ["base"],
        quantities,
        labels=_support([(segment.name, segment.time) for segment in motion.segments]),
        description="The base link in the world (x ahead at t = 0, z against gravity) over "
        + ("one gait cycle." if motion.period else "the motion as given."),
    )


def _support(segments: Sequence[tuple[str, Array]]) -> dict[str, tuple[list[str], str]]:
    """The column that says which feet support."""
    names = [name for name, time in segments for _ in time]
    return {"segment": (names, "which feet support")}


def walking_joint_demand(demand: MotionDemand, sliding: Collection[str] = ()) -> Table:
    """Motion and torque of every joint over the cycle.

    Args:
        sliding: Joints that slide: metres and newtons, not radians and newton metres.
    """
    parts, quantities = demand.segments, []
    for name, turns, slides in (
        ("position", "rad", "m"),
        ("velocity", "rad/s", "m/s"),
        ("acceleration", "rad/s^2", "m/s^2"),
        ("torque", "N*m", "N"),
    ):
        units = tuple(slides if joint in sliding else turns for joint in demand.joints)
        meaning = name
        if name == "torque":
            force = ", a force where it slides" if sliding else ""
            meaning = f"torque the actuator applies to the joint{force}"
        values = np.concatenate([getattr(part, name) for part in parts])
        quantities.append(Quantity(name, units, meaning, values))
    return wide_series(
        "walking_joint_demand",
        np.concatenate([part.time for part in parts]),
        demand.joints,
        quantities,
        labels=_support([(part.segment, part.time) for part in parts]),
        description=f"{'One gait cycle' if demand.period else 'The motion as given'}; torque and "
        "velocity positive in the joint's direction.",
    )


def walking_contact_forces(demand: MotionDemand) -> Table:
    """Ground forces of every foot over the cycle."""
    parts = [contacts for contacts in demand.contacts if contacts is not None]
    force = np.concatenate([part.force_world for part in parts])
    needed = np.concatenate([part.friction_needed for part in parts])
    stands = [[[float(leg in part.stance) for leg in part.legs]] * part.time.size for part in parts]
    meaning = "force of the ground on the robot, world "
    return wide_series(
        "walking_contact_forces",
        np.concatenate([part.time for part in parts]),
        parts[0].legs,
        [
            *(
                Quantity(f"force_{axis}", "N", meaning + axis, force[..., k])
                for k, axis in enumerate("xyz")
            ),
            Quantity("contact", "1", "1 on the ground, 0 in the air", np.concatenate(stands)),
            Quantity("friction_needed", "1", "tangential over normal force", needed),
        ],
        labels=_support([(part.segment, part.time) for part in demand.segments]),
        description=f"{_FORCES[demand.forces.rule]} foot forces; world frame, z up.",
    )


def walking_stage_energy(
    results: Mapping[str, ChainResult], stage_names: Mapping[str, Mapping[str, str]]
) -> Table:
    """E(+) and E(-) at every stage (Fig. 14, 16, 18 and 20)."""
    rows = [
        StageRow(name, joint, e.stage, stage_names[name][e.stage], e.forward[j], e.reverse[j])
        for name, result in results.items()
        for e in stage_energies(result)
        for j, joint in enumerate(e.joints)
    ]
    return table_of(StageRow, rows)


def walking_losses(results: Mapping[str, ChainResult], supplies: Mapping[str, Supply]) -> Table:
    """What every element turns into heat per cycle, and what is dumped at the supply."""
    rows = []
    for name, result in results.items():
        for element, loss in loss_energies(result).items():
            own = zip(result.joint.joints, loss, strict=True)
            rows += [LossRow(name, joint, element, energy) for joint, energy in own]
        dumped = zip(supplies[name].accounts, supplies[name].dumped_energy, strict=True)
        rows += [LossRow(name, account, "dumped_return", energy) for account, energy in dumped]
    return table_of(LossRow, rows)


def motor_limits(limits: Mapping[str, Sequence[LimitRow]], name: str = "motor_limits") -> Table:
    """Peaks over the cycle, or at standstill, against the motor's data sheet."""
    rows = [MotorLimit(n, *vars(row).values()) for n, own in limits.items() for row in own]
    return table_of(MotorLimit, rows, name=name)


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
