"""The tables of standing and walking; their columns are declared in `pipeline/columns.csv`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.energy.energy import Supply, loss_energies, stage_energies
from actuators.energy.limits import limit_rows, standing_rows
from actuators.units import from_si
from pipeline.columns import frame, series
from pipeline.dynamics.joint_demand import MotionDemand
from pipeline.machine.joint import drivetrains_of
from pipeline.motion.feet import base_in_world
from pipeline.motion.gait import gait_of
from pipeline.motion.motion import Motion
from pipeline.robot.postures import foot_tracking
from pipeline.simulation.cycle_energy import (
    HELD,
    STANDING_TIME,
    Legs,
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
_AXES = "xyz"


def tables_of_standing(given: Machine, standing: Standing) -> Computed:
    """The tables of standing still, by name."""
    demand, holding, contacts = standing.demand, standing.holding, standing.contacts
    legs = leg_joints(given.robot.spec)

    def limits() -> DataFrame:
        rows: list[Sequence[Any]] = []
        for name, held in holding.items():
            motors = [
                j.chain.motor
                for j in drivetrains_of(given.chains(name)[name], demand.joints).joints
            ]
            rows += [(name, *vars(r).values()) for r in standing_rows(held, demand.joints, motors)]
        return frame("standing_limits", rows)

    def energy() -> DataFrame:
        at = demand.joints.index
        return frame(
            "standing_energy",
            [
                (name, leg, sum(float(held.power[at(j)]) for j in joints) * STANDING_TIME)
                for name, held in holding.items()
                for leg, joints in legs.items()
            ],
        )

    def joints() -> DataFrame:
        rows: list[Sequence[Any]] = []
        for name, h in holding.items():
            own = (h.motor_torque, h.current, h.voltage, h.power, h.low, h.high)
            each = zip(demand.joints, demand.torque[0], *own, strict=True)
            rows += [(name, *row) for row in each]
        return frame("standing", rows)

    def feet() -> DataFrame:
        numbers = np.column_stack(
            [contacts.position[0], contacts.force_world[0], contacts.friction_needed[0]]
        )
        rows = zip(contacts.legs, numbers, strict=True)
        return frame("standing_contacts", [(leg, *own) for leg, own in rows])

    posture = zip(demand.joints, demand.position[0], strict=True)
    return {
        "standing_limits": limits,
        "standing": joints,
        "standing_energy": energy,
        "standing_posture": lambda: frame("standing_posture", posture),
        "standing_contacts": feet,
        "parameters": lambda: parameters(given),
    }


def tables_of_walking(given: Machine, walking: Walking) -> Computed:
    """The tables of one walking cycle, by name."""
    demand, supplies, results = walking.demand, walking.supplies, walking.results
    spec, legs = given.robot.spec, leg_joints(given.robot.spec)
    base = leg_energies(supplies[IDEAL], legs) if IDEAL in supplies else {}

    @cache
    def static() -> Walking:
        own = given.options.model_dump() | {"quasi_static": True}
        return given.walking(**own).walk(given.chains(*results))

    def legs_energy() -> DataFrame:
        rows = [
            (name, leg, energy, energy / base[leg] if base.get(leg, 0.0) > 0 else None)
            for name, supply in supplies.items()
            for leg, energy in leg_energies(supply, legs).items()
        ]
        return frame("walking_energy", rows)

    def limits() -> DataFrame:
        rows = [(n, *vars(row).values()) for n, r in results.items() for row in limit_rows(r)]
        return frame("motor_limits", rows)

    def static_torque() -> DataFrame:
        """What the links' inertial terms change at each joint."""
        one, two = (
            np.concatenate([part.torque for part in d.segments]) for d in (demand, static().demand)
        )
        peaks = (np.abs(torque).max(axis=0) for torque in (one, two, one - two))
        return frame("quasi_static_torque", zip(demand.joints, *peaks, strict=True))

    def static_energy() -> DataFrame:
        """What the links' inertial terms change in each leg."""
        rows = []
        for name, supply in supplies.items():
            other = leg_energies(static().supplies[name], legs)
            for leg, energy in leg_energies(supply, legs).items():
                change = (other[leg] - energy) / energy if energy else None
                rows.append((name, leg, energy, other[leg], change))
        return frame("quasi_static_energy", rows)

    tables: Computed = {
        "walking_joint_demand": lambda: walking_joint_demand(demand, given.robot.sliding_joints),
        "walking_contact_forces": lambda: _contact_forces(demand),
        "walking_gait": lambda: _gait(given),
        "walking_base": lambda: _base(walking.motion),
        "walking_stability": lambda: _stability(walking),
        "foot_tracking": lambda: _foot_tracking(given, walking),
        "walking_stage_energy": lambda: _stages(given, walking),
        "walking_losses": lambda: _losses(walking),
        "walking_energy": legs_energy,
        "robot_energy": lambda: _robot_energy(given, walking, legs),
        "motor_limits": limits,
        "quasi_static_torque": static_torque,
        "quasi_static_energy": static_energy,
        "parameters": lambda: parameters(given),
    }
    grounded = ("walking_contact_forces", "walking_base", "walking_stability")
    absent = {
        **dict.fromkeys(grounded, not spec.floating),
        "walking_gait": given.motion is not None,
        "foot_tracking": all(part.foot_target is None for part in walking.motion.segments),
        "quasi_static_torque": given.options.quasi_static,
        "quasi_static_energy": given.options.quasi_static,
    }
    return {name: table for name, table in tables.items() if not absent.get(name)}


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


def _gait(given: Machine) -> DataFrame:
    """The gait as it was walked, leg by leg."""
    gait = gait_of(given.robot.spec)
    phase, duty = gait.footfall.phase, gait.footfall.duty
    each = zip(gait.legs, gait.strokes, gait.lift, strict=True)
    rows = [(leg, phase[leg], duty[leg], float(s), float(h)) for leg, s, h in each]
    return frame("walking_gait", rows)


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
        own = np.concatenate([getattr(part, field) for part in parts])
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


def _foot_tracking(given: Machine, walking: Walking) -> DataFrame:
    """How well the legs follow their feet's paths."""
    pieces = [
        (segment.time, given.robot.leg_positions(segment.configuration), segment.foot_target)
        for segment in walking.motion.segments
        if segment.foot_target is not None
    ]
    return frame("foot_tracking", list(foot_tracking(given.robot.chains, pieces)))


def _stages(given: Machine, walking: Walking) -> DataFrame:
    """E(+) and E(-) at every stage (Fig. 14, 16, 18 and 20 of the paper)."""
    words = {name: a.stage_names for name, a in given.catalog.alternatives.items()}
    rows = [
        (name, joint, e.stage, words[name][e.stage], e.forward[j], e.reverse[j])
        for name, result in walking.results.items()
        for e in stage_energies(result)
        for j, joint in enumerate(e.joints)
    ]
    return frame("walking_stage_energy", rows)


def _losses(walking: Walking) -> DataFrame:
    """What every element turns into heat per cycle, and what is dumped at the supply."""
    rows: list[Sequence[Any]] = []
    for name, result in walking.results.items():
        for element, loss in loss_energies(result).items():
            own = zip(result.joint.joints, loss, strict=True)
            rows += [(name, joint, element, energy) for joint, energy in own]
        supply = walking.supplies[name]
        dumped = zip(supply.accounts, supply.dumped_energy, strict=True)
        rows += [(name, account, "dumped_return", energy) for account, energy in dumped]
    return frame("walking_losses", rows)


def _robot_energy(given: Machine, walking: Walking, legs: Legs) -> DataFrame:
    """Average power, cost of transport, and how support and transfer share the energy."""
    spec, demand = given.robot.spec, walking.demand
    weight = given.edited.mass * spec.parameters["gravity"]  # that the forces rest on [N]
    if given.motion:
        speed = walking.motion.mean_speed if spec.floating else 0.0
    else:
        speed = gait_of(spec).speed

    def row(name: str, supply: Supply) -> Sequence[Any]:
        energy = float(supply.supplied_energy.sum())
        power = energy / demand.duration  # [W]
        transport = power / (weight * speed) if speed else None
        support = transfer = None
        stood = support_energy(demand, supply, legs)
        if stood is not None:
            support = stood / energy
            transfer = 1 - support - leg_energies(supply, legs).get(HELD, 0.0) / energy
        dumped = float(supply.dumped_energy.sum())
        return name, energy, power, transport, support, transfer, dumped

    return frame("robot_energy", [row(*each) for each in walking.supplies.items()])


def parameters(given: Machine) -> DataFrame:
    """Every number that went in, in the unit of its file."""
    groups = [(given.robot.spec.name, given.robot.spec.parameters.rows())]
    groups += [(c.name, c.parameters.rows()) for c in given.catalog.components.values()]
    rows = []
    for owner, numbers in (*groups, *given.own.groups):
        for p in numbers:
            ends = (from_si(x, p.unit) for x in p.interval) if p.interval else (None, None)
            said = (p.name, p.value_as_written, p.unit, p.basis, p.source, *ends, p.reason)
            rows.append((owner, *said))
    return frame("parameters", rows)
