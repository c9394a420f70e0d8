"""The tables of standing and walking, and what their sidecars say of the run."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

from actuators.energy.limits import limit_rows, standing_rows
from actuators.loading.build import CATALOG
from actuators.units import from_si
from pipeline.api.result import Computed
from pipeline.column import column
from pipeline.dynamics.force_rules import PAPER
from pipeline.machine.joint import drivetrains_of
from pipeline.motion.gait import gait_of, gait_table
from pipeline.robot.inverse.inverse_kinematics import foot_tracking
from pipeline.simulation import cycle_energy
from pipeline.simulation.cycle_energy import leg_joints
from pipeline.simulation.settings import Settings
from pipeline.simulation.walk_stand import IDEAL, Standing, Walking
from reports.table import Table, table_of
from reports.tables import walking as walking_tables


def tables_of_standing(given: Settings, standing: Standing) -> Computed:
    """The tables of standing still, by name."""
    demand, holding = standing.demand, standing.holding
    legs = leg_joints(given.robot.spec)
    return {
        "standing_limits": lambda: _standing_limits(given, standing),
        "standing": lambda: walking_tables.standing(demand, holding),
        "standing_energy": lambda: table_of(
            cycle_energy.StandingEnergy, cycle_energy.standing_energies(demand, holding, legs)
        ),
        "standing_posture": lambda: walking_tables.standing_posture(demand),
        "standing_contacts": lambda: walking_tables.standing_contacts(standing.contacts),
        "parameters": lambda: _parameters(given),
    }


def _standing_limits(given: Settings, standing: Standing) -> Table:
    joints = standing.demand.joints
    rows = {}
    for name, holding in standing.holding.items():
        drivetrains = drivetrains_of(given.chain(name), joints)
        motors = [joint.chain.motor for joint in drivetrains.joints]
        rows[name] = standing_rows(holding, joints, motors)
    return walking_tables.motor_limits(rows, "standing_limits")


def tables_of_walking(given: Settings, walking: Walking) -> Computed:
    """The tables of one walking cycle, by name."""
    demand, supplies, results = walking.demand, walking.supplies, walking.results
    spec, legs = given.robot.spec, leg_joints(given.robot.spec)
    gait = None if given.motion else gait_of(spec)
    speed = gait.speed if gait else walking.motion.mean_speed if spec.floating else 0.0
    stages = {name: a.stage_names for name, a in given.catalog.alternatives.items()}
    weight = given.machine.mass * spec.parameters["gravity"]  # that the forces rest on [N]

    @cache
    def static() -> Walking:
        return replace(given, quasi_static=True).walk(given.chains(*results))

    tables: Computed = {
        "walking_joint_demand": lambda: walking_tables.walking_joint_demand(
            demand, given.robot.sliding_joints
        ),
        "walking_contact_forces": lambda: walking_tables.walking_contact_forces(demand),
        "walking_gait": lambda: walking_tables.walking_gait(gait_of(spec)),
        "walking_base": lambda: walking_tables.walking_base(walking.motion),
        "walking_stability": lambda: table_of(
            cycle_energy.Stability, cycle_energy.stability(demand, walking.margins)
        ),
        "foot_tracking": lambda: _foot_tracking(given, walking),
        "walking_stage_energy": lambda: walking_tables.walking_stage_energy(results, stages),
        "walking_losses": lambda: walking_tables.walking_losses(results, supplies),
        "walking_energy": lambda: table_of(
            cycle_energy.LegEnergy, cycle_energy.walking_energies(supplies, legs, IDEAL)
        ),
        "robot_energy": lambda: table_of(
            cycle_energy.RobotEnergy,
            cycle_energy.robot_energies(demand, supplies, legs, weight, speed),
        ),
        "motor_limits": lambda: walking_tables.motor_limits(
            {name: limit_rows(result) for name, result in results.items()}
        ),
        "quasi_static_torque": lambda: table_of(
            cycle_energy.QuasiStaticTorque,
            cycle_energy.quasi_static_torques(demand, static().demand),
        ),
        "quasi_static_energy": lambda: table_of(
            cycle_energy.QuasiStaticEnergy,
            cycle_energy.quasi_static_energies(supplies, static().supplies, legs),
        ),
        "parameters": lambda: _parameters(given),
    }
    grounded = ("walking_contact_forces", "walking_base", "walking_stability")
    absent = {
        **dict.fromkeys(grounded, not spec.floating),
        "walking_gait": given.motion is not None,
        "foot_tracking": all(part.foot_target is None for part in walking.motion.segments),
        "quasi_static_torque": given.quasi_static,
        "quasi_static_energy": given.quasi_static,
    }
    return {name: table for name, table in tables.items() if not absent.get(name)}


def _foot_tracking(given: Settings, walking: Walking) -> Table:
    """How well the legs follow, where the motion says where the feet should be."""
    pieces = [
        (segment.time, given.robot.leg_positions(segment.configuration), segment.foot_target)
        for segment in walking.motion.segments
        if segment.foot_target is not None
    ]
    return walking_tables.foot_tracking(foot_tracking(given.robot.chains, pieces))


@dataclass(frozen=True)
class InputRow:
    """One number that went in, in the unit of its file."""

    table: ClassVar = "parameters"
    group: str = column("robot file or component")
    parameter: str = column("name in its file")
    value: float | str = column("in the row's unit", "see unit")
    unit: str = column("unit as the file writes it; 1 is a pure number")
    basis: str = column(
        "published, datasheet, derived, calibrated, identified (from a log) or assumed"
    )
    source: str = column("where the number comes from")
    interval_low: float | None = column(
        "lower end of where the true value is thought to lie", "see unit"
    )
    interval_high: float | None = column("upper end", "see unit")
    reason: str = column("why this value, for an assumption")


def _parameters(given: Settings) -> Table:
    """Every number that went in."""
    groups = [(given.robot.spec.name, given.robot.spec.parameters.rows())]
    groups += [(c.name, c.parameters.rows()) for c in given.catalog.components.values()]
    groups += given.own.groups
    rows = []
    for owner, numbers in groups:
        for p in numbers:
            ends = (from_si(x, p.unit) for x in p.interval) if p.interval else (None, None)
            said = (p.name, p.value_as_written, p.unit, p.basis, p.source, *ends, p.reason)
            rows.append(InputRow(owner, *said))
    return table_of(InputRow, rows, exact=True)


def inputs_of(given: Settings) -> tuple[Path, ...]:
    """Every file that was read."""
    spec = given.robot.spec
    files = [*spec.sources, *([] if spec.build else [spec.urdf])]
    files += sorted((given.files.actuators or CATALOG).glob("*.toml"))
    more = (given.files.gait, given.files.model_path, given.motion_file)
    return (*files, *filter(None, more))


def said_of(given: Settings) -> dict[str, Any]:
    """What every sidecar says of the run beside `pipeline.api.result.run_meta`: its options."""
    spec, choice = given.robot.spec, given.forces
    forces = {  # what differs from the paper's rule on ground that holds
        "forces": choice.rule if choice.rule != PAPER.rule else None,
        "friction_coefficient": choice.friction_coefficient,
    }
    return {
        "urdf_sha256": hashlib.sha256(given.robot.urdf.encode()).hexdigest(),
        "options": {
            "set": [f"{key}={value}" for key, value in given.changes.items()],
            "samples_per_segment": given.samples,
            "quasi_static": given.quasi_static,
            "regeneration": given.regeneration.policy,
            "regeneration_fraction": given.regeneration.fraction,
            "transfer_path": gait_table(spec).transfer_path,
            "effects": list(given.effects.names) if given.effects else [],
            **{name: value for name, value in forces.items() if value is not None},
            **({"motion": str(given.motion_file or "a table")} if given.motion else {}),
        },
        "conventions": "SI units; x forward, y left, z up; torque and velocity positive in the "
        "joint's direction; electrical power positive from supply to motor",
        "zero_pose": spec.zero_pose,
        "warnings": list(given.remarks),
    }
