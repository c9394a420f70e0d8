"""The URDF to start from, its poses, and whether its base points x forward, y left, z up.

A URDF does not say which way its base looks. Legs that are called left and right, front and rear,
do, and so do feet that hang above their hips.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from actuators.arrays import Array
from pipeline.errors import RobotFileError
from pipeline.robot.guess.limbs import Limb, spaced
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.published import RobotSource, named_robot
from pipeline.robot.robot import Robot
from pipeline.robot.urdf_source import number

#: Poses of an SRDF that are meant to stand, those before others.
STANDING_POSES = ("standing", "stand", "half_sitting", "home", "default")
_AHEAD = {"front": 1, "fore": 1, "rear": -1, "hind": -1, "back": -1}
_ASIDE = {"left": 1, "right": -1}
#: Letters of two that name a corner; which of "rl" is the right and which the rear is usage.
_CORNERS = {
    **dict.fromkeys(("lf", "fl"), (1, 1)),
    **dict.fromkeys(("rf", "fr"), (1, -1)),
    **dict.fromkeys(("lh", "hl", "lr", "rl", "lb", "bl"), (-1, 1)),
    **dict.fromkeys(("rh", "hr", "rr", "rb", "br"), (-1, -1)),
    **dict.fromkeys(("lm", "ml"), (0, 1)),
    **dict.fromkeys(("rm", "mr"), (0, -1)),
}
_AXES = {0: "x", 1: "-y", 2: "-x", 3: "y"}
#: Of the reach, by which every foot is above its hip where z points down.
_ABOVE = 0.5


def refuse_turned(robot: Robot, limbs: Sequence[Limb], posture: Array) -> None:
    """Stop where names or feet say that the base's axes point elsewhere.

    `posture`: a pose that stands if any is known, else zero, shape (L, K) [rad, m].

    Raises:
        RobotFileError: They do; says how to turn the root.
    """
    chains, where, root = robot.chains, robot.spec.path, robot.spec.base_link
    hips = chains.offset[0]
    feet = foot_positions(chains, posture[None])[0]
    if (feet[:, 2] - hips[:, 2] > _ABOVE * chains.reach).all():
        raise RobotFileError(
            f"{where}: all feet lie above their hips, so that z of '{root}' seems to point down; "
            + _remedy(root, f"{np.pi:.6f} 0 0")
            + ", or give a pose 'standing' in an SRDF beside the URDF if it is right"
        )
    turns = quarter_turns(limbs, hips)
    if turns:
        raise RobotFileError(
            f"{where}: by their names legs are left and right, front and rear, as if "
            f"{_AXES[turns]} of '{root}' pointed forward; x must: "
            + _remedy(root, f"0 0 {(turns if turns < 3 else -1) * np.pi / 2:.6f}")
        )


def quarter_turns(limbs: Sequence[Limb], hips: Array) -> int:
    """Quarter turns about z after which all legs stand where their names say.

    `hips`: in the base frame [m], shape (L, 3). Returns 0 where they do so already, where names say
    too little, or where no turn helps.
    """
    said: list[tuple[int, int] | None] = []  # signs of x and y that a name means; 0 for neither
    for limb in limbs:
        ahead = aside = 0
        parts = spaced(f"{limb.name} {limb.joints[0]} {limb.foot}")
        for word in re.findall(r"[a-z]+", parts.lower()):
            along, across = _CORNERS.get(word, (_AHEAD.get(word, 0), _ASIDE.get(word, 0)))
            ahead, aside = ahead or along, aside or across
        said.append((ahead, aside) if ahead or aside else None)
    if len({one for one in said if one is not None and all(one)}) < 3:
        return 0  # fewer than three corners do not distinguish a turn from a mirror image
    place = hips[:, :2] - hips[:, :2].mean(axis=0)

    def agrees(turns: int) -> bool:
        s, c = (round(f(turns * np.pi / 2)) for f in (np.sin, np.cos))
        turned = place @ np.array([[c, s], [-s, c]])
        return all(
            wanted * there > 0 or wanted == 0
            for one, at in zip(said, turned, strict=True)
            if one is not None
            for wanted, there in zip(one, at, strict=True)
        )

    return next((turns for turns in range(4) if agrees(turns)), 0)


def _remedy(root: str, rpy: str) -> str:
    return (
        f"make a new root link and hang '{root}' on it with a fixed joint of "
        f'<origin rpy="{rpy}"/>'
    )


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


def standing_pose(source: RobotSource) -> tuple[str, dict[str, float]]:
    """The SRDF's pose for standing: its name, and joint positions [rad, m].

    Both are empty without an SRDF, or a pose in it that is called as poses for standing are.

    Raises:
        RobotFileError: The SRDF is malformed.
        UrdfError: A position is no number.
    """
    if source.srdf is None:
        return "", {}
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
    names = (source.pose, *STANDING_POSES)
    return next(((name, poses[name]) for name in names if poses.get(name)), ("", {}))
