"""What the record of a run says: the files that were read, and options."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from actuators.loading.build import CATALOG
from pipeline.dynamics.force_rules import PAPER
from pipeline.motion.gait import gait_table
from pipeline.simulation.settings import Settings


def inputs_of(given: Settings) -> tuple[Path, ...]:
    """Every file that was read."""
    spec = given.robot.spec
    files = [*spec.sources, *([] if spec.build else [spec.urdf])]
    files += sorted((given.files.actuators or CATALOG).glob("*.toml"))
    more = (given.files.gait, given.files.model_path, given.motion_file)
    return (*files, *filter(None, more))


def said_of(given: Settings) -> dict[str, Any]:
    """What the record says of the run beside `pipeline.api.result.run_meta`: its options."""
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
