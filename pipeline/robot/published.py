"""Robots that the package ``example-robot-data`` ships, by name."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any, Final

from actuators.errors import LegwattError, closest, one_line
from pipeline.robot.urdf_source import read_urdf

#: How a robot file writes such a URDF: ``example-robot-data:solo12``.
SCHEME: Final = "example-robot-data:"
_SHOWN: Final = 12  # names in one line


@dataclass(frozen=True)
class RobotSource:
    """A URDF and what lies beside it."""

    name: str  #: Of the robot; by which the package calls it where it is published.
    urdf: Path
    srdf: Path | None = None  #: Poses with names; None without.
    pose: str = ""  #: Name of the pose that the publisher refers to; empty where there is none.
    published: bool = True  #: Whether it is known by name and not by its place.

    @cached_property
    def text(self) -> str:
        """The URDF."""
        return read_urdf(self.urdf)

    def reference(self, out: Path) -> str:
        """How a robot file at `out` names the URDF."""
        if self.published:
            return SCHEME + self.name
        return Path(os.path.relpath(self.urdf.absolute(), out.absolute().parent)).as_posix()


@cache
def _loaders() -> dict[str, Any]:
    from example_robot_data.robots_loader import ROBOTS

    return dict(ROBOTS)


def published_names() -> list[str]:
    """Every name that the package knows."""
    return sorted(_loaders())


def published_robot(name: str) -> RobotSource:
    """Look a robot of the package up.

    Raises:
        LegwattError: No robot has that name, or it is not described by a URDF.
    """
    from example_robot_data.robots_loader import getModelPath

    loaders = _loaders()
    if name not in loaders:
        known = published_names()
        hint = closest(name, known)
        if not hint.startswith("did"):
            hint = f"known: {', '.join(known[:_SHOWN])} and {len(known) - _SHOWN} more"
        raise LegwattError(
            f"'{one_line(name)}' is no file and no robot of example-robot-data; {hint}"
        )
    loader = loaders[name]
    if not loader.urdf_filename:
        raise LegwattError(
            f"{name}: example-robot-data describes it in {loader.sdf_filename or 'no file'}, not "
            "in a URDF; its closed chains have none"
        )
    folder = Path(getModelPath(loader.path)) / loader.path
    urdf = folder / loader.urdf_subpath / loader.urdf_filename
    srdf = folder / loader.srdf_subpath / loader.srdf_filename
    has_srdf = bool(loader.srdf_filename) and srdf.is_file()
    return RobotSource(name, urdf, srdf if has_srdf else None, loader.ref_posture or "")


def named_robot(given: str) -> RobotSource | None:
    """The robot of the package that a command names, with or without `SCHEME`.

    Returns None where a file is meant: one that is there, or that is written like one.

    Raises:
        LegwattError: Neither a file nor a robot, or a robot without a URDF.
    """
    path, name = Path(given), given.removeprefix(SCHEME)
    like_a_file = path.is_file() or path.suffix or len(path.parts) > 1
    if name == given and (like_a_file or (path.exists() and name not in _loaders())):
        return None
    return published_robot(name)


def urdf_path(text: str, robot_file: Path) -> Path:
    """Where the URDF that a robot file names lies.

    `text`: ``robot.urdf``: a path beside the robot file, or ``example-robot-data:NAME``.

    Raises:
        LegwattError: The package has no such robot.
    """
    if not text.startswith(SCHEME):
        return robot_file.parent / text
    try:
        return published_robot(text.removeprefix(SCHEME)).urdf
    except LegwattError as error:
        raise LegwattError(f"{robot_file}: robot.urdf: {error}") from None
