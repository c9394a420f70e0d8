"""The URDF to start from, and the poses that come with it."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

from pipeline.errors import RobotFileError
from pipeline.robot.published import RobotSource, named_robot
from pipeline.robot.urdf_source import number

#: Poses of an SRDF that are meant to stand, those before others.
STANDING_POSES = ("standing", "stand", "half_sitting", "home", "default")


def source_of(given: str) -> RobotSource:
    """A URDF by path, or by its name in ``example-robot-data``.

    Raises:
        RobotFileError: It is a robot file.
        UrdfError: It is neither, or the file cannot be read.
    """
    path = Path(given)
    if path.suffix.lower() == ".toml":
        raise RobotFileError(f"{given}: a robot file; init starts from a URDF or a robot's name")
    known = named_robot(given)
    if known is not None:
        return known
    name = f"{path.stem}.srdf"
    beside = (path.parent / name, path.parent.parent / "srdf" / name)
    srdf = next((p for p in beside if p.is_file()), None)
    return RobotSource(path.stem, path, srdf, published=False)


def standing_pose(source: RobotSource) -> tuple[str, dict[str, float]] | None:
    """The SRDF's pose for standing: its name, and joint positions [rad, m].

    Returns None where there is no SRDF, or no pose in it that is called as poses for standing are.

    Raises:
        RobotFileError: The SRDF is malformed.
        UrdfError: A position is no number.
    """
    if source.srdf is None:
        return None
    try:
        root = ET.fromstring(source.srdf.read_bytes())
    except ET.ParseError as error:
        raise RobotFileError(
            f"{source.srdf}: line {error.position[0]}: malformed XML; correct it, or move it away "
            "and the stance is sought"
        ) from None
    poses: dict[str, dict[str, float]] = {}
    for state in root.findall("group_state"):
        own = poses.setdefault(state.get("name", ""), {})
        for joint in state.findall("joint"):
            if len(joint.get("value", "").split()) == 1:  # a floating base has seven
                own[joint.get("name", "")] = number(joint, "value", str(source.srdf))
    return next(
        ((name, poses[name]) for name in (source.pose, *STANDING_POSES) if poses.get(name)), None
    )
