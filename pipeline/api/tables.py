"""The tables of standing and walking, and what their sidecars say of the run."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from tqdm import tqdm

from actuators.energy.limits import limit_rows, standing_rows
from actuators.loading.build import CATALOG
from pipeline.api.result import Computed, own_names
from pipeline.machine.joint import Actuators, drivetrains_of
from pipeline.motion.gait import gait_of, gait_table
from pipeline.robot.inverse.foot_tracking import foot_tracking
from pipeline.simulation import cycle_energy
from pipeline.simulation.cycle_energy import leg_joints
from pipeline.simulation.edited import IDEAL
from pipeline.simulation.force_choice import RULES
from pipeline.simulation.settings import PAPER_FORCES, Settings
from pipeline.simulation.walk_stand import Standing, Walking, compare_rules, walk
from reports.table import Table, table_of
from reports.tables import parameters as parameter_tables
from reports.tables import standing as standing_tables
from reports.tables import walking as walking_tables

PACKAGES = ("legwatt", "pin", "numpy", "scipy", "pyarrow", "matplotlib")


def tables_of_standing(given: Settings, standing: Standing) -> Computed:
    """The tables of standing still, by name."""
    demand, holding = standing.demand, standing.holding
    legs = leg_joints(given.robot.spec)
    return {
        "standing_limits": lambda: _standing_limits(given, standing),
        "standing": lambda: standing_tables.standing(demand, holding),
        "standing_energy": lambda: table_of(
            cycle_energy.StandingEnergy, cycle_energy.standing_energies(demand, holding, legs)
        ),
        "standing_posture": lambda: standing_tables.standing_posture(demand),
        "standing_contacts": lambda: standing_tables.standing_contacts(standing.contacts),
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


def walked(
    given: Settings, chains: Mapping[str, Actuators], *, quasi_static: bool | None = None
) -> Walking:
    """One gait cycle as the settings say.

    Args:
        given: Robot, samples, ground and regeneration.
        chains: By alternative.
        quasi_static: Leave out the links' inertial terms; as the settings say by default.
    """
    return walk(
        given.machine,
        chains,
        samples=given.samples,
        quasi_static=given.quasi_static if quasi_static is None else quasi_static,
        regeneration=given.regeneration,
        adjust=given.adjust,
        forces=given.ground,
        motion=given.motion,
    )


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
        return walked(given, given.chains(*results), quasi_static=True)

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
        "walking_force_rules": lambda: _force_rules(given, walking),
        "parameters": lambda: _parameters(given),
    }
    grounded = ("walking_contact_forces", "walking_base", "walking_stability")
    absent = {
        **dict.fromkeys(grounded, not spec.floating),
        "walking_gait": given.motion is not None,
        "foot_tracking": all(part.foot_target is None for part in walking.motion.segments),
        "quasi_static_torque": given.quasi_static,
        "quasi_static_energy": given.quasi_static,
        "walking_force_rules": not given.compare_forces,
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


def _force_rules(given: Settings, walking: Walking) -> Table:
    """What each rule of the ground's forces costs."""
    costs = compare_rules(
        given.machine,
        given.chains(*walking.results),
        walking.motion,
        quasi_static=given.quasi_static,
        regeneration=given.regeneration,
        adjust=given.adjust,
        friction_coefficient=given.forces.friction_coefficient,
    )
    count = len(walking.results) * len(RULES)
    shown = tqdm(costs, "rules", count, leave=False, disable=not sys.stderr.isatty())
    return walking_tables.force_rules(list(shown), given.forces.friction_coefficient)


def _parameters(given: Settings) -> Table:
    """Every number that went in."""
    groups = [(given.robot.spec.name, given.robot.spec.parameters.rows())]
    groups += [(c.name, c.parameters.rows()) for c in given.catalog.components.values()]
    groups += given.own.groups
    return parameter_tables.parameters(groups)


def inputs_of(given: Settings) -> list[Path]:
    """Every file that was read."""
    spec = given.robot.spec
    files = [*spec.sources, *([] if spec.build else [spec.urdf])]
    files += sorted((given.files.actuators or CATALOG).glob("*.toml"))
    more = (given.files.gait, given.files.model_path, given.motion_file)
    return [*files, *(path for path in more if path)]


def metadata(given: Settings) -> dict[str, Any]:
    """What every sidecar says about the run: inputs by hash, versions, options."""
    spec = given.robot.spec
    files = inputs_of(given)
    return {
        "inputs_sha256": {
            name: hashlib.sha256(path.read_bytes()).hexdigest()
            for name, path in zip(own_names(files), files, strict=True)
        },
        "urdf_sha256": hashlib.sha256(given.robot.urdf.encode()).hexdigest(),
        "versions": {name: version(name) for name in PACKAGES},
        "options": {
            "set": [f"{key}={value}" for key, value in given.changes.items()],
            "samples_per_segment": given.samples,
            "quasi_static": given.quasi_static,
            "regeneration": given.regeneration.policy,
            "regeneration_fraction": given.regeneration.fraction,
            "transfer_path": gait_table(spec).transfer_path,
            "effects": list(given.effects.names) if given.effects else [],
            **_forces_options(given),
            **({"motion": str(given.motion_file or "a table")} if given.motion else {}),
        },
        "conventions": "SI units; x forward, y left, z up; torque and velocity positive in the "
        "joint's direction; electrical power positive from supply to motor",
        "zero_pose": spec.zero_pose,
        "warnings": list(given.remarks),
    }


def _forces_options(given: Settings) -> dict[str, Any]:
    """What differs from the paper's rule on ground that holds."""
    choice = given.forces
    options = {
        "forces": choice.rule if choice.rule != PAPER_FORCES.rule else None,
        "power_of": choice.power_of,
        "friction_coefficient": choice.friction_coefficient,
    }
    return {name: value for name, value in options.items() if value is not None}
