"""Where a URDF comes from: a file, or a robot that the package ``example-robot-data`` ships."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

from actuators.errors import LegwattError, known

#: How a robot file writes such a URDF: ``example-robot-data:solo12``.
SCHEME: Final = "example-robot-data:"


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
