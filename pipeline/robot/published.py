"""Robots by name: the URDFs that ``example-robot-data`` ships, and motors that are known."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any, Final

from actuators.checked import read_toml
from actuators.errors import LegwattError, known

#: How a robot file writes such a URDF: ``example-robot-data:solo12``.
SCHEME: Final = "example-robot-data:"
#: Folders of actuator files of robots, and the table that says whose they are.
KNOWN: Final = Path(__file__).resolve().parents[2] / "urdf" / "actuators"
TABLE: Final = KNOWN / "known.toml"
#: How a robot file names such a folder: ``known:solo12``.
KNOWN_SCHEME: Final = "known:"


@dataclass(frozen=True)
class RobotSource:
    """A URDF and what lies beside it."""

    name: str  #: Of the robot; by which the package calls it where it is published.
    urdf: Path
    srdf: Path | None = None  #: Poses with names; None without.
    pose: str = ""  #: Name of the pose that the publisher refers to; empty where there is none.
    published: bool = False  #: Whether it is known by name and not by its place.

    def reference(self, out: Path) -> str:
        """How a robot file at `out` names the URDF."""
        if self.published:
            return SCHEME + self.name
        return Path(os.path.relpath(self.urdf.absolute(), out.absolute().parent)).as_posix()


@cache
def loaders() -> dict[str, Any]:
    """Every robot that the package knows, by name."""
    from example_robot_data.robots_loader import ROBOTS

    return dict(ROBOTS)


def robot_source(given: str) -> RobotSource:
    """A URDF by its path, or by its robot's name in the package, with or without `SCHEME`.

    An SRDF is looked for beside a file, and in a folder ``srdf`` beside its folder.

    Raises:
        LegwattError: It is neither, or a robot without a URDF.
    """
    path, name = Path(given), given.removeprefix(SCHEME)
    if name == given and (path.is_file() or path.suffix or len(path.parts) > 1):
        beside = (path.with_suffix(".srdf"), path.parent.parent / "srdf" / f"{path.stem}.srdf")
        return RobotSource(path.stem, path, next((p for p in beside if p.is_file()), None))
    loader = loaders()[known("no file, and no robot of example-robot-data, is", name, loaders())]
    from example_robot_data.robots_loader import getModelPath

    if not loader.urdf_filename:
        raise LegwattError(f"{name}: example-robot-data has no URDF of it")
    folder = Path(getModelPath(loader.path)) / loader.path
    urdf = folder / loader.urdf_subpath / loader.urdf_filename
    srdf = folder / loader.srdf_subpath / (loader.srdf_filename or "none")
    poses = srdf if srdf.is_file() else None
    return RobotSource(name, urdf, poses, loader.ref_posture or "", published=True)


def urdf_path(text: str, robot_file: Path) -> Path:
    """Where ``robot.urdf`` lies: a path beside the robot file, or ``example-robot-data:NAME``."""
    if not text.startswith(SCHEME):
        return robot_file.parent / text
    try:
        return robot_source(text).urdf
    except LegwattError as error:
        raise LegwattError(f"{robot_file}: robot.urdf: {error}") from None


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
