"""Robots that the package ``example-robot-data`` ships, by name."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

from actuators.errors import closest, one_line
from pipeline.errors import UrdfError

#: How a robot file writes such a URDF: ``example-robot-data:solo12``.
SCHEME: Final = "example-robot-data:"
_SHOWN: Final = 12  # names in one line


@dataclass(frozen=True)
class PublishedRobot:
    """One robot of the package."""

    name: str  #: By which the package calls it.
    urdf: Path  #: Its file.
    srdf: Path | None  #: Poses with names; None where the package has none.
    pose: str  #: Name of its reference pose; empty where it names none.


@cache
def _loaders() -> dict[str, Any]:
    from example_robot_data.robots_loader import ROBOTS

    return dict(ROBOTS)


def published_names() -> list[str]:
    """Every name that the package knows."""
    return sorted(_loaders())


def published_robot(name: str) -> PublishedRobot:
    """Look a robot of the package up.

    Raises:
        UrdfError: No robot has that name, or it is not described by a URDF.
    """
    from example_robot_data.robots_loader import getModelPath

    loaders = _loaders()
    if name not in loaders:
        known = published_names()
        hint = closest(name, known)
        if not hint.startswith("did"):
            hint = f"known: {', '.join(known[:_SHOWN])} and {len(known) - _SHOWN} more"
        raise UrdfError(f"'{one_line(name)}' is no file and no robot of example-robot-data; {hint}")
    loader = loaders[name]
    if not loader.urdf_filename:
        raise UrdfError(
            f"{name}: example-robot-data describes it in {loader.sdf_filename or 'no file'}, not "
            "in a URDF; its closed chains have none"
        )
    folder = Path(getModelPath(loader.path)) / loader.path
    urdf = folder / loader.urdf_subpath / loader.urdf_filename
    srdf = folder / loader.srdf_subpath / loader.srdf_filename
    has_srdf = bool(loader.srdf_filename) and srdf.is_file()
    return PublishedRobot(name, urdf, srdf if has_srdf else None, loader.ref_posture or "")


def named_robot(given: str) -> PublishedRobot | None:
    """The robot of the package that a command names, with or without `SCHEME`.

    Returns None where a file is meant: one that is there, or that is written like one.

    Raises:
        UrdfError: Neither a file nor a robot, or a robot without a URDF.
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
        UrdfError: The package has no such robot.
    """
    if not text.startswith(SCHEME):
        return robot_file.parent / text
    try:
        return published_robot(text.removeprefix(SCHEME)).urdf
    except UrdfError as error:
        raise UrdfError(f"{robot_file}: robot.urdf: {error}") from None
