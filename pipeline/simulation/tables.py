"""The tables of standing and walking; their columns are declared in `pipeline/columns.csv`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.energy.energy import loss_energies, stage_energies
from actuators.energy.limits import limit_rows, standing_rows
from actuators.units import from_si
from pipeline.columns import frame, series
from pipeline.dynamics.joint_demand import MotionDemand
from pipeline.machine.drivetrains import drivetrains_of
from pipeline.motion.feet import base_in_world
from pipeline.motion.gait import gait_of
from pipeline.motion.motion import Motion
from pipeline.simulation.cycle_energy import (
    HELD,
    STANDING_TIME,
    leg_energies,
    leg_joints,
    support_energy,
)
from pipeline.simulation.machine import Machine
from pipeline.simulation.walk_stand import IDEAL, Standing, Walking

if TYPE_CHECKING:
    from pandas import DataFrame

#: Tables by the name of their file, computed when they are asked for.
Computed = Mapping[str, Callable[[], "DataFrame"]]
#: Idle power of one driver that is on, least and most of those that were measured [W]
#: (`actuators/components`); `choose` counts it, walking and standing end at the motors' terminals.
DRIVER_IDLE = (0.67, 8.8)
_AXES = "xyz"


def tables_of_standing(machine: Machine, standing: Standing) -> Computed:
    """The tables of standing still, by name."""
    demand, holding, contacts = standing.demand, standing.holding, standing.contacts
    names, legs = demand.joints, leg_joints(machine.robot.spec)

    def limits() -> DataFrame:
        rows: list[Sequence[Any]] = []
        for name, held in holding.items():
            drives = drivetrains_of(machine.chains(name)[name], names).joints
            motors = [joint.driven for joint in drives]
            rows += [(name, *r) for r in standing_rows(held, names, motors)]
        return frame("standing_limits", rows)

    def energy() -> DataFrame:
        power = [(name, dict(zip(names, h.power, strict=True))) for name, h in holding.items()]
        rows = [
            (name, leg, STANDING_TIME * sum(float(watts[j]) for j in joints))
            for name, watts in power
            for leg, joints in legs.items()
        ]
        return frame("standing_energy", rows)

    def joints() -> DataFrame:
        rows: list[Sequence[Any]] = []
        for name, h in holding.items():
            own = (h.motor_torque, h.current, h.voltage, h.power, h.low, h.high)
            rows += [(name, *row) for row in zip(names, demand.torque[0], *own, strict=True)]
        return frame("standing", rows)

    def feet() -> DataFrame:
        own = contacts.position[0], contacts.force_world[0], contacts.friction_needed[0]
        rows = zip(contacts.legs, np.column_stack(own), strict=True)
        return frame("standing_contacts", [(leg, *numbers) for leg, numbers in rows])

    return {
        "standing_limits": limits,
        "standing": joints,
        "standing_energy": energy,
        "standing_posture": lambda: frame(
            "standing_posture", zip(names, demand.position[0], strict=True)
        ),
        "standing_contacts": feet,
        "parameters": lambda: parameters(machine),
    }


def tables_of_walking(machine: Machine, walking: Walking) -> Computed:
    """The tables of one walking cycle, by name."""
    demand, floating = walking.demand, machine.robot.spec.floating
    tables: Computed = {
        "walking_joint_demand": lambda: walking_joint_demand(demand, machine.robot.sliding_joints),
        "walking_contact_forces": lambda: _contact_forces(demand),
        "walking_base": lambda: _base(walking.motion),
        "walking_stability": lambda: _stability(walking),
        "walking_stage_energy": lambda: _stages(machine, walking),
        "walking_losses": lambda: _losses(walking),
        "walking_energy": lambda: _legs(machine, walking),
        "robot_energy": lambda: _robot(machine, walking),
        "motor_limits": lambda: _limits(walking),
        "parameters": lambda: parameters(machine),
    }
    grounded = ("walking_contact_forces", "walking_base", "walking_stability")
    return {name: table for name, table in tables.items() if floating or name not in grounded}


def walking_joint_demand(demand: MotionDemand, sliding: Sequence[str] = ()) -> DataFrame:
    """Motion and torque of every joint over the cycle.

    Args:
        sliding: Joints that slide: metres and newtons, not radians and newton metres.
    """
    values = {}
    for name, turns, slides in (
        ("position", "rad", "m"),
        ("velocity", "rad_s", "m_s"),
        ("acceleration", "rad_s2", "m_s2"),
        ("torque", "Nm", "N"),
    ):
        units = (slides if joint in sliding else turns for joint in demand.joints)
        own = np.concatenate([getattr(part, name) for part in demand.segments])
        values[tuple(f"{name}_{unit}" for unit in units)] = own
    return series(*_support(demand.segments), demand.joints, values)


def _support(segments: Sequence[Any]) -> tuple[Any, dict[str, list[str]]]:
    """Time, and the column that says which feet support."""
    names = [getattr(s, "segment", None) or s.name for s in segments for _ in s.time]
    return np.concatenate([s.time for s in segments]), {"segment": names}


def _contact_forces(demand: MotionDemand) -> DataFrame:
    """Ground forces of every foot over the cycle."""
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
    for name, unit, field in (
        ("", "m", "position"),
        ("", "rad", "angles"),
        ("velocity_", "m_s", "velocity"),
        ("acceleration_", "m_s2", "acceleration"),
        ("angular_velocity_", "rad_s", "angular_velocity"),
    ):
        own = np.concatenate([part[field] for part in parts])
        axes = ("roll", "pitch", "yaw") if field == "angles" else _AXES
        values |= {f"{name}{axis}_{unit}": own[:, [k]] for k, axis in enumerate(axes)}
    return series(*_support(motion.segments), ["base"], values)


def _stability(walking: Walking) -> DataFrame:
    """Static margin, lightest foot and friction needed, per segment."""
    demand, rows = walking.demand, []
    for part, contacts, margin in zip(
        demand.segments, demand.contacts, walking.margins, strict=True
    ):
        assert contacts is not None
        normal = contacts.normal_force[:, [leg in contacts.stance for leg in contacts.legs]]
        at, needed = int(margin.argmin()), contacts.friction_needed
        foot = contacts.legs[int(np.nanargmax(needed)) % needed.shape[1]]
        least = (float(margin[at]), float(part.time[at]), float(normal.min()))
        rows.append((part.segment, *least, float(np.nanmax(needed)), foot))
    return frame("walking_stability", rows)


def _stages(machine: Machine, walking: Walking) -> DataFrame:
    """E(+) and E(-) at every stage (Fig. 14, 16, 18 and 20 of the paper)."""
    words = {name: a.stage_names for name, a in machine.catalog.alternatives.items()}
    rows = [
        (name, joint, e.stage, words[name][e.stage], e.forward[j], e.reverse[j])
        for name, result in walking.results.items()
        for e in stage_energies(result)
        for j, joint in enumerate(e.joints)
    ]
    return frame("walking_stage_energy", rows)


def _losses(walking: Walking) -> DataFrame:
    """What every element turns into heat per cycle, and what is dissipated at the supply."""
    rows: list[Sequence[Any]] = []
    for name, result in walking.results.items():
        for element, loss in loss_energies(result).items():
            own = zip(result.joint.joints, loss, strict=True)
            rows += [(name, joint, element, energy) for joint, energy in own]
        supply = walking.supplies[name]
        dissipated = zip(supply.accounts, supply.dissipated_energy, strict=True)
        rows += [(name, account, "dissipated_return", energy) for account, energy in dissipated]
    return frame("walking_losses", rows)


def _limits(walking: Walking) -> DataFrame:
    """Every motor's quantities against its limits."""
    results = walking.results.items()
    return frame("motor_limits", [(n, *row) for n, r in results for row in limit_rows(r)])


def _legs(machine: Machine, walking: Walking) -> DataFrame:
    """Electrical energy of a cycle by leg, and over that of the ideal drivetrain."""
    supplies, legs = walking.supplies, leg_joints(machine.robot.spec)
    base = leg_energies(supplies[IDEAL], legs) if IDEAL in supplies else {}
    rows = [
        (name, leg, energy, energy / base[leg] if base.get(leg, 0.0) > 0 else None)
        for name, supply in supplies.items()
        for leg, energy in leg_energies(supply, legs).items()
    ]
    return frame("walking_energy", rows)


def _robot(machine: Machine, walking: Walking) -> DataFrame:
    """Average power, cost of transport, and how support and transfer share the energy."""
    spec, demand, legs = machine.robot.spec, walking.demand, leg_joints(machine.robot.spec)
    weight = machine.edited.mass * spec.parameters["gravity"]  # that the forces rest on [N]
    speed = 0.0  # of a robot on a stand
    if spec.floating:
        speed = walking.motion.mean_speed if machine.motion else gait_of(spec).speed
    rows = []
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
        idle = (watts * len(demand.joints) for watts in DRIVER_IDLE)
        rows.append((name, energy, power, transport, support, transfer, dissipated, *idle))
    return frame("robot_energy", rows)


def parameters(machine: Machine) -> DataFrame:
    """Every number that went in, in the unit of its file."""
    groups = [(machine.robot.spec.name, machine.robot.spec.parameters.rows())]
    groups += [(c.name, c.parameters.rows()) for c in machine.catalog.components.values()]
    rows = []
    for owner, numbers in (*groups, *machine.own.groups):
        for p in numbers:
            ends = (from_si(x, p.unit) for x in p.interval) if p.interval else (None, None)
            said = (p.name, p.value_as_written, p.unit, p.basis, p.source, *ends, p.reason)
            rows.append((owner, *said))
    return frame("parameters", rows)
