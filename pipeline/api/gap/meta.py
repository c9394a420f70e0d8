"""What the sidecars of a run of the workflow say of it."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import Any

from pipeline.api.result import own_names
from pipeline.identification.workflow.setup import Options, Setup
from pipeline.logs.formats.convert import sha256

PACKAGES = ("legwatt", "pin", "numpy", "scipy", "pyarrow", "matplotlib")


def inputs_of(options: Options, given: Setup) -> list[Path]:
    """Every file that was read."""
    files = [*options.logs, *options.holdout, *given.sources]
    return files + [path for path in (options.mapping, options.gait, options.model) if path]


def metadata(options: Options, given: Setup) -> dict[str, Any]:
    """What every sidecar says about the run: inputs by hash, versions, options."""
    files = inputs_of(options, given)
    return {
        "inputs_sha256": {
            name: sha256(path) for name, path in zip(own_names(files), files, strict=True)
        },
        "versions": {name: version(name) for name in PACKAGES},
        "options": {
            "step": options.step,
            "set": [f"{key}={value}" for key, value in options.changes.items()],
            "base": options.base or "as the log and the robot say",
            "alternative": given.alternative or "none: the torque is the joint's",
            "effort": options.effort or "the log's most direct",
            "cutoff_Hz": options.cutoff,
            "gait_start_s": options.gait_start,
            "prove_last": options.prove_last,
        },
        "conventions": "SI units; torque, velocity, current and voltage positive in the joint's "
        "direction; gap is measured minus predicted",
        "warnings": list(given.warnings),
    }
