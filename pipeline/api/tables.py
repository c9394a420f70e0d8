"""The tables of standing and walking, and what their sidecars say of the run."""

from __future__ import annotations

import hashlib
from importlib.metadata import version
from pathlib import Path
from typing import Any

from actuators.loading.build import CATALOG
from pipeline.motion.gait import gait_of, gait_table
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.settings import Settings
from pipeline.simulation.walk_stand import Standing, Walking, walk
from reports.table import Table
from reports.tables import parameters as parameter_tables
from reports.tables import standing as standing_tables
from reports.tables import walking as walking_tables
from reports.tables.gait import walking_base, walking_gait
from reports.tables.walking import OUTSIDE

IDEAL = "ideal"
PACKAGES = ("legwatt", "pin", "numpy", "scipy", "pyarrow", "matplotlib")


def leg_joints(spec: RobotSpec) -> dict[str, tuple[str, ...]]:
    """Each leg's joints, and under `OUTSIDE` those outside the legs where there are any."""
    legs = {leg.name: leg.joints for leg in spec.legs}
    placed = {joint for own in legs.values() for joint in own}
    outside = tuple(joint for joint in spec.joints if joint not in placed)
    return legs | ({OUTSIDE: outside} if outside else {})


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
    p, gait = given.robot.spec.parameters, gait_of(given.robot.spec)
    tables = [
        walking_tables.walking_joint_demand(walking.demand),
        walking_tables.walking_contact_forces(walking.demand),
        walking_gait(gait),
        walking_base(walking.motion),
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
            gait.speed,
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
        )
        tables += walking_tables.quasi_static_difference(
            walking.demand, static.demand, walking.supplies, static.supplies, legs
        )
    return tables


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
        },
        "conventions": "SI units; x forward, y left, z up; torque and velocity positive in the "
        "joint's direction; electrical power positive from supply to motor",
        "zero_pose": spec.zero_pose,
        "warnings": [*given.remarks, *(given.effects.remarks if given.effects else ())],
    }


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
