"""The tables of standing and walking, and what their sidecars say of the run."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from tqdm import tqdm

from actuators.energy.limits import limit_rows, standing_rows
from actuators.loading.build import CATALOG
from pipeline.machine.drivetrains import Actuators, drivetrains_of
from pipeline.motion.gait import gait_of, gait_table
from pipeline.robot.inverse.foot_tracking import foot_tracking
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.ground_forces.force_choice import RULES
from pipeline.simulation.settings import PAPER_FORCES, Settings
from pipeline.simulation.walk_stand import Standing, Walking, compare_rules, walk
from reports.table import Table
from reports.tables import kinematics as kinematics_tables
from reports.tables import parameters as parameter_tables
from reports.tables import standing as standing_tables
from reports.tables import walking as walking_tables
from reports.tables.gait import walking_base, walking_gait
from reports.tables.walking import HELD

IDEAL = "ideal"
PACKAGES = ("legwatt", "pin", "numpy", "scipy", "pyarrow", "matplotlib")


def leg_joints(spec: RobotSpec) -> dict[str, tuple[str, ...]]:
    """Each leg's joints, and those outside the legs together."""
    legs = {leg.name: leg.joints for leg in spec.legs}
    held = tuple(joint for joint, _ in spec.held)
    return legs | {HELD: held} if held else legs


def tables_of_standing(given: Settings, standing: Standing) -> list[Table]:
    """The tables of standing still."""
    return [
        _standing_limits(given, standing),
        standing_tables.standing(standing.demand, standing.holding),
        standing_tables.standing_energy(
            standing.demand, standing.holding, leg_joints(given.robot.spec)
        ),
        standing_tables.standing_posture(standing.demand),
        standing_tables.standing_contacts(standing.contacts),
    ]


def _standing_limits(given: Settings, standing: Standing) -> Table:
    joints = standing.demand.joints
    rows = {}
    for name, chain in given.chains().items():
        motors = [joint.chain.motor for joint in drivetrains_of(chain, joints).joints]
        if name in standing.holding:
            rows[name] = standing_rows(standing.holding[name], joints, motors)
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
    )


def tables_of_walking(given: Settings, walking: Walking) -> list[Table]:
    """The tables of one walking cycle."""
    legs = leg_joints(given.robot.spec)
    chains = given.chains()
    p, gait = given.robot.spec.parameters, gait_of(given.robot.spec)
    tables = [
        walking_tables.walking_joint_demand(walking.demand, given.robot.sliding_joints),
        walking_tables.walking_contact_forces(walking.demand),
        walking_gait(gait),
        walking_base(walking.motion),
        walking_tables.walking_stability(walking.demand, walking.margins),
        *_foot_tracking(given, walking),
        walking_tables.walking_stage_energy(
            walking.results, {n: a.stage_names for n, a in given.catalog.alternatives.items()}
        ),
        walking_tables.walking_losses(walking.results, walking.supplies),
        walking_tables.walking_energy(walking.supplies, legs, IDEAL),
        walking_tables.robot_energy(
            walking.demand,
            walking.supplies,
            legs,
            given.machine.mass * p["gravity"],  # the mass that the forces rest on
            gait.speed,
        ),
        walking_tables.motor_limits({n: limit_rows(r) for n, r in walking.results.items()}),
    ]
    if not given.quasi_static:
        static = walked(given, chains, quasi_static=True)
        tables += walking_tables.quasi_static_difference(
            walking.demand, static.demand, walking.supplies, static.supplies, legs
        )
    if given.compare_forces:
        tables.append(_force_rules(given, walking, chains))
    return tables


def _foot_tracking(given: Settings, walking: Walking) -> list[Table]:
    """How well the legs follow, where the motion says where the feet should be."""
    pieces = [
        (segment.time, given.robot.leg_positions(segment.configuration), segment.foot_target)
        for segment in walking.motion.segments
        if segment.foot_target is not None
    ]
    if not pieces:
        return []
    return [kinematics_tables.foot_tracking(foot_tracking(given.robot.chains, pieces))]


def _force_rules(given: Settings, walking: Walking, chains: Mapping[str, Actuators]) -> Table:
    """What each rule of the ground's forces costs."""
    costs = compare_rules(
        given.machine,
        chains,
        walking.motion,
        quasi_static=given.quasi_static,
        regeneration=given.regeneration,
        adjust=given.adjust,
        friction_coefficient=given.forces.friction_coefficient,
    )
    count = len(chains) * len(RULES)
    shown = tqdm(costs, "rules", count, leave=False, disable=not sys.stderr.isatty())
    return walking_tables.force_rules(list(shown), given.forces.friction_coefficient)


def table_of_parameters(given: Settings) -> Table:
    """Every number that went in."""
    groups = [(given.robot.spec.name, given.robot.spec.parameters.rows())]
    groups += [(c.name, c.parameters.rows()) for c in given.catalog.components.values()]
    groups += given.own.groups
    return parameter_tables.parameters(groups)


def inputs_of(given: Settings) -> list[Path]:
    """Every file that was read."""
    spec = given.robot.spec
    files = [*spec.sources, *([] if spec.build else [spec.urdf])]
    files += sorted((given.actuators or Path(CATALOG)).glob("*.toml"))
    return [*files, *(path for path in (given.gait, given.model) if path)]


def metadata(given: Settings) -> dict[str, Any]:
    """What every sidecar says about the run: inputs by hash, versions, options."""
    spec = given.robot.spec
    files = inputs_of(given)
    return {
        "inputs_sha256": {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in files},
        "urdf_sha256": hashlib.sha256(given.robot.urdf.encode()).hexdigest(),
        "versions": {name: version(name) for name in PACKAGES},
        "options": {
            "set": list(given.changes),
            "samples_per_segment": given.samples,
            "quasi_static": given.quasi_static,
            "regeneration": given.regeneration.policy,
            "regeneration_fraction": given.regeneration.fraction,
            "transfer_path": gait_table(spec).transfer_path,
            "effects": list(given.effects.names) if given.effects else [],
            **_forces_options(given),
        },
        "conventions": "SI units; x forward, y left, z up; torque and velocity positive in the "
        "joint's direction; electrical power positive from supply to motor",
        "zero_pose": spec.zero_pose,
        "warnings": [*given.remarks, *(given.effects.remarks if given.effects else ())],
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
