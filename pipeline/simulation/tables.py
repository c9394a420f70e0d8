"""The tables of standing and walking; their columns are declared in `pipeline/columns.csv`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.energy import limit_rows, loss_energies, stage_energies, standing_rows
from actuators.units import from_si
from pipeline.columns import frame, series
from pipeline.motion.feet import base_in_world
from pipeline.motion.gait import gait_of
from pipeline.motion.motion import Motion
from pipeline.simulation.machine import Machine
from pipeline.simulation.walk_stand import (
    HELD,
    IDEAL,
    STANDING_TIME,
    Demand,
    Standing,
    Walking,
    leg_energies,
    leg_joints,
    support_energy,
)

if TYPE_CHECKING:
    from pandas import DataFrame

#: Tables by the name of their file, computed when they are asked for.
Computed = Mapping[str, Callable[[], "DataFrame"]]
Rows = Iterator[Sequence[Any]]
#: Idle power of one driver that is on, least and most of those that were measured [W]
#: (`actuators/components`); `choose` counts it, walking and standing end at the motors' terminals.
DRIVER_IDLE = (0.67, 8.8)
_AXES = "xyz"


def tables_of_standing(machine: Machine, standing: Standing) -> Computed:
    """The tables of standing still, by name."""
    demand, contacts, held = standing.demand, standing.contacts, standing.holding.items()
    names, legs = demand.joints, leg_joints(machine.robot.spec)

    def limits() -> Rows:
        for name, h in held:
            drives = machine.chains(name)[name].joints
            for row in standing_rows(h, names, [drive.driven for drive in drives]):
                yield name, *row

    def energy() -> Rows:
        for name, h in held:
            power = dict(zip(names, h.power.tolist(), strict=True))
            for leg, joints in legs.items():
                yield name, leg, STANDING_TIME * sum(power[j] for j in joints)

    def joints() -> Rows:
        for name, h in held:
            own = (h.motor_torque, h.current, h.voltage, h.power, h.low, h.high)
            for row in zip(names, demand.torque[0], *own, strict=True):
                yield name, *row

    def feet() -> Rows:
        own = contacts.position[0], contacts.force_world[0], contacts.friction_needed[0]
        for leg, numbers in zip(contacts.legs, np.column_stack(own), strict=True):
            yield leg, *numbers

    rows: dict[str, Callable[[], Rows]] = {
        "standing_limits": limits,
        "standing": joints,
        "standing_energy": energy,
        "standing_posture": lambda: zip(names, demand.position[0], strict=True),
        "standing_contacts": feet,
        "parameters": partial(_parameters, machine),
    }
    return {name: partial(_framed, name, each) for name, each in rows.items()}


def _framed(name: str, rows: Callable[[], Rows]) -> DataFrame:
    return frame(name, rows())


def tables_of_walking(machine: Machine, walking: Walking) -> Computed:
    """The tables of one walking cycle, by name."""
    demand = walking.demand
    rows: dict[str, Callable[[], Rows]] = {
        "walking_stability": partial(_stability, walking),
        "walking_stage_energy": partial(_stages, machine, walking),
        "walking_losses": partial(_losses, walking),
        "walking_energy": partial(_legs, machine, walking),
        "robot_energy": partial(_robot, machine, walking),
        "motor_limits": lambda: (
            (name, *row) for name, r in walking.results.items() for row in limit_rows(r)
        ),
        "parameters": partial(_parameters, machine),
    }
    tables: Computed = {
        "walking_joint_demand": demand.frame,
        "walking_contact_forces": lambda: _contact_forces(demand),
        "walking_base": lambda: _base(demand.motion),
        **{name: partial(_framed, name, each) for name, each in rows.items()},
    }
    grounded = ("walking_contact_forces", "walking_base", "walking_stability")
    floating = machine.robot.spec.floating
    return {name: table for name, table in tables.items() if floating or name not in grounded}


def walking_joint_demand(demand: Demand) -> DataFrame:
    """Motion and torque of every joint over the cycle."""
    units = {"position": ("rad", "m"), "velocity": ("rad_s", "m_s")}
    units |= {"acceleration": ("rad_s2", "m_s2"), "torque": ("Nm", "N")}
    values = {
        tuple(f"{name}_{pair[joint in demand.sliding]}" for joint in demand.joints): np.concatenate(
            [getattr(part, name) for part in demand.segments]
        )
        for name, pair in units.items()
    }
    return series(*_support(demand.segments), demand.joints, values)


def _support(segments: Sequence[Any]) -> tuple[Any, dict[str, list[str]]]:
    """Time, and the column that says which feet support."""
    names = [s.name for s in segments for _ in s.time]
    return np.concatenate([s.time for s in segments]), {"segment": names}


def _contact_forces(demand: Demand) -> DataFrame:
    parts = [contacts for contacts in demand.contacts if contacts is not None]
    force = np.concatenate([part.force_world for part in parts])
    stands = [[[float(leg in part.stance) for leg in part.legs]] * part.time.size for part in parts]
    values = {f"force_{axis}_N": force[..., k] for k, axis in enumerate(_AXES)} | {
        "contact": np.concatenate(stands),
        "friction_needed": np.concatenate([part.friction_needed for part in parts]),
    }
    return series(*_support(demand.segments), parts[0].legs, values)


def _base(motion: Motion) -> DataFrame:
    """Place, attitude and motion of the base link in the world."""
    parts = [base_in_world(segment) for segment in motion.segments]
    values: dict[str, Any] = {}
    for name, unit, field, axes in (
        ("", "m", "position", _AXES),
        ("", "rad", "angles", ("roll", "pitch", "yaw")),
        ("velocity_", "m_s", "velocity", _AXES),
        ("acceleration_", "m_s2", "acceleration", _AXES),
        ("angular_velocity_", "rad_s", "angular_velocity", _AXES),
    ):
        own = np.concatenate([part[field] for part in parts])
        values |= {f"{name}{axis}_{unit}": own[:, [k]] for k, axis in enumerate(axes)}
    return series(*_support(motion.segments), ["base"], values)


def _stability(walking: Walking) -> Rows:
    """Static margin, lightest foot and friction needed, per segment."""
    demand = walking.demand
    parts = zip(demand.segments, demand.contacts, walking.margins, strict=True)
    for part, contacts, margin in parts:
        assert contacts is not None
        normal = contacts.normal_force[:, [leg in contacts.stance for leg in contacts.legs]]
        at, needed = int(margin.argmin()), contacts.friction_needed
        foot = contacts.legs[int(np.nanargmax(needed)) % needed.shape[1]]
        least = (float(margin[at]), float(part.time[at]), float(normal.min()))
        yield part.name, *least, float(np.nanmax(needed)), foot


def _stages(machine: Machine, walking: Walking) -> Rows:
    """E(+) and E(-) at every stage (Fig. 14, 16, 18 and 20 of the paper)."""
    for name, result in walking.results.items():
        words = machine.catalog.alternatives[name].stage_names
        for stage, energies in stage_energies(result).items():
            for joint, *own in zip(result.joint.joints, *energies, strict=True):
                yield name, joint, stage, words[stage], *own


def _losses(walking: Walking) -> Rows:
    """What every element turns into heat per cycle, and what is dissipated at the supply."""
    for name, result in walking.results.items():
        for element, loss in loss_energies(result).items():
            for joint, energy in zip(result.joint.joints, loss, strict=True):
                yield name, joint, element, energy
        supply = walking.supplies[name]
        for account, energy in zip(supply.accounts, supply.dissipated_energy, strict=True):
            yield name, account, "dissipated_return", energy


def _legs(machine: Machine, walking: Walking) -> Rows:
    """Electrical energy of a cycle by leg, and over that of the ideal drivetrain."""
    supplies, legs = walking.supplies, leg_joints(machine.robot.spec)
    base = leg_energies(supplies[IDEAL], legs) if IDEAL in supplies else {}
    for name, supply in supplies.items():
        for leg, energy in leg_energies(supply, legs).items():
            yield name, leg, energy, energy / base[leg] if base.get(leg, 0.0) > 0 else None


def _robot(machine: Machine, walking: Walking) -> Rows:
    """Average power, cost of transport, and how support and transfer share the energy."""
    spec, demand, legs = machine.robot.spec, walking.demand, leg_joints(machine.robot.spec)
    weight = machine.edited.mass * spec.parameters["gravity"]  # that the forces rest on [N]
    speed = 0.0  # of a robot on a stand
    if spec.floating:
        speed = demand.motion.mean_speed if machine.motion else gait_of(spec).speed
    idle = [watts * len(demand.joints) for watts in DRIVER_IDLE]
    for name, supply in walking.supplies.items():
        energy = float(supply.supplied_energy.sum())
        power = energy / demand.duration  # [W]
        support = transfer = None
        stood = support_energy(demand, supply, legs)
        if stood is not None:
            support = stood / energy
            transfer = 1 - support - leg_energies(supply, legs).get(HELD, 0.0) / energy
        transport = power / (weight * speed) if speed else None
        dissipated = float(supply.dissipated_energy.sum())
        yield name, energy, power, transport, support, transfer, dissipated, *idle


def _parameters(machine: Machine) -> Rows:
    """Every number that went in, in the unit of its file."""
    groups = [(machine.robot.spec.name, machine.robot.spec.parameters.rows())]
    groups += [(c.name, c.parameters.rows()) for c in machine.catalog.components.values()]
    for owner, numbers in (*groups, *machine.own.groups):
        for p in numbers:
            ends = (from_si(x, p.unit) for x in p.interval) if p.interval else (None, None)
            said = (p.name, p.value_as_written, p.unit, p.basis, p.source, *ends, p.reason)
            yield owner, *said
