"""Robots whose motors are known: a folder of actuator files for each, found by the robot's name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Final

from actuators.checked import read_toml
from actuators.errors import known

#: Folders of actuator files of robots, and the table that says whose they are.
KNOWN: Final = Path(__file__).resolve().parents[3] / "urdf" / "actuators"
TABLE: Final = KNOWN / "known.toml"
#: How a robot file names such a folder: ``known:solo12``.
KNOWN_SCHEME: Final = "known:"


def known_motors(names: Sequence[str], joints: Sequence[str]) -> Mapping[str, Any] | None:
    """``[actuators]`` of a robot's file; None where nobody knows its motors.

    `names`: by which it was asked for, and the URDF's own. `joints`: of its legs; they and those
    whose motors are known must be the same.
    """
    for name, robot in read_toml(TABLE).items():
        each = [[fnmatchcase(joint, pattern) for joint in joints] for pattern in robot["joints"]]
        whole = all(map(any, each)) and all(map(any, zip(*each, strict=True)))
        if whole and not set(names).isdisjoint(robot["robots"]):
            table = {key: robot[key] for key in ("alternative", "source", "joint") if key in robot}
            return {"folder": KNOWN_SCHEME + name, **table}
    return None


def known_folder(folder: str, where: str) -> Path:
    """The folder of actuator files that ``known:NAME`` means; refused where there is none."""
    name = folder.removeprefix(KNOWN_SCHEME)
    robots = sorted(path.name for path in KNOWN.iterdir() if path.is_dir())
    return KNOWN / known("no known robot", name, robots, where)
