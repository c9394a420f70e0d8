"""The tables of standing and walking, and what their sidecars say of the run."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from tqdm import tqdm

from actuators.loading.build import CATALOG
from pipeline.machine.drivetrains import Actuators
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.force_choice import RULES
from pipeline.simulation.settings import PAPER_FORCES, Settings
from pipeline.simulation.walk_stand import Standing, Walking, compare_rules, walk
from reports.table import Table
from reports.tables import parameters as parameter_tables
from reports.tables import standing as standing_tables
from reports.tables import walking as walking_tables

IDEAL = "ideal"
PACKAGES = ("legwatt", "pin", "numpy", "scipy", "pyarrow", "matplotlib")


def leg_joints(spec: RobotSpec) -> dict[str, tuple[str, ...]]:
    """Each leg's joints."""
    return {leg.name: leg.joints for leg in spec.legs}


def tables_of_standing(given: Settings, standing: Standing) -> list[Table]:
    """The four tables of standing still."""
    return [
        standing_tables.standing(standing.demand, standing.holding),
        standing_tables.standing_energy(
            standing.demand, standing.holding, leg_joints(given.robot.spec)
        ),
        standing_tables.standing_posture(standing.demand),
        standing_tables.standing_contacts(standing.contacts),
    ]


def tables_of_walking(given: Settings, walking: Walking) -> list[Table]:
    """The tables of one walking cycle."""
    legs = leg_joints(given.robot.spec)
    chains = given.chains()
    p = given.robot.spec.parameters
    tables = [
        walking_tables.walking_joint_demand(walking.demand),
        walking_tables.walking_contact_forces(walking.demand),
        walking_tables.walking_stability(walking.demand, walking.margins),
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
            p["walking_speed"],
        ),
        walking_tables.motor_limits(walking.results),
    ]
    if not given.quasi_static:
        static = walk(
            given.machine,
            chains,
            samples=given.samples,
            quasi_static=True,
            regeneration=given.regeneration,
            adjust=given.adjust,
            forces=given.ground,
        )
        tables += walking_tables.quasi_static_difference(
            walking.demand, static.demand, walking.supplies, static.supplies, legs
        )
    if given.compare_forces:
        tables.append(_force_rules(given, walking, chains))
    return tables


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
    return [*files, given.model] if given.model else files


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
            "transfer_path": spec.transfer_path,
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


def findings(walking: Walking) -> list[str]:
    """Lines for the terminal: what a reader should not overlook."""
    from actuators.energy.limits import limit_rows

    lines = []
    for name, result in walking.results.items():
        breaches = [row for row in limit_rows(result) if row.breach]
        if breaches:
            worst = max(breaches, key=lambda row: row.peak / row.limit)
            lines.append(
                f"motor limit: '{name}' asks {worst.peak:.4g} {worst.unit} ({worst.quantity}) of "
                f"{worst.joint}, the data sheet allows {worst.limit:.4g}; see motor_limits.csv"
            )
    return lines
