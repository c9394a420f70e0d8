"""Legs and feet in the tree of a URDF's bodies.

A foot is a frame that is called one, else a leaf that is as low as any; a leg is the chain of
joints from the base to a foot. What belongs to no leg is held.

The URDF to start from, its poses, and whether its base points x forward, y left, z up. A URDF does
not say which way its base looks. Legs that are called left and right, front and rear, do, and so do
feet that hang above their hips.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from actuators.checked import finite
from actuators.errors import LegwattError, closest, one_line, some
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.leg_chains import MOST_JOINTS
from pipeline.robot.published import RobotSource, named_robot
from pipeline.robot.robot import Robot

#: What nothing but feet is called, the plainest first; what other ends of chains are called, too.
_FEET = ("foot", "feet", "sole", "toe", "paw", "hoof")
_ENDS = ("contact", "tip", "end")
_ROOT = 1  # the free flyer's index
_FEWEST = 3
#: A leaf this share of the tree's height above the lowest one is no foot.
_LOW = 0.15


@dataclass(frozen=True)
class Limb:
    """One leg as found."""

    name: str  #: Short name.
    joints: tuple[str, ...]  #: From the base outward.
    foot: str  #: Frame at the foot point.
    reason: str  #: Why this is its foot.


def find_limbs(
    model: pin.Model, configuration: Array, feet: Sequence[str], where: str
) -> tuple[Limb, ...]:
    """The legs of a robot.

    `feet`: frames that the user named; none to look for them.

    Raises:
        LegwattError: No legs, fewer than three, or two feet on one leg; says what to name.
    """
    if model.njoints <= _ROOT + 1:
        raise LegwattError(f"{where}: no joint moves; a leg has at least one actuated joint")
    data = model.createData()
    pin.framesForwardKinematics(model, data, configuration)
    if feet:
        known = [str(model.frames[k].name) for k in _bodies(model)]
        for foot in feet:
            if foot not in known:
                raise LegwattError(
                    f"{where}: --foot {one_line(foot)}: no link of that name moves; "
                    f"{closest(foot, known)}"
                )
        chosen, reason = [int(model.getFrameId(foot)) for foot in feet], "named by --foot"
    else:
        chosen, reason = _looked_for(model, data, where)
    if len(chosen) < _FEWEST:
        found = f" ({', '.join(str(model.frames[k].name) for k in chosen)})" if chosen else ""
        how_many = {0: "no foot", 1: "one foot", 2: "two feet"}[len(chosen)]
        ends = _outermost(model, _bodies(model))
        leaves = some([str(model.frames[k].name) for k in ends], 12)
        raise LegwattError(
            f"{where}: {how_many} found{found}; a gait that is statically stable needs three feet "
            f"on the ground. If there are more, name them with --foot; chains end in {leaves}"
        )
    shared = _shared(model, chosen)
    if shared is not None:
        one, other = (model.frames[i].name for i in shared[:2])
        raise LegwattError(
            f"{where}: feet '{one}' and '{other}' both hang on joint '{model.names[shared[2]]}'; a "
            "leg has one foot and joints of its own: name the feet with --foot, one for each leg"
        )
    for k in chosen:
        if (count := len(_path(model, k))) > MOST_JOINTS:
            raise LegwattError(
                f"{where}: {count} joints lead to foot '{model.frames[k].name}'; a leg has at "
                f"most {MOST_JOINTS}: name a frame further in with --foot"
            )
    joints = [tuple(str(model.names[j]) for j in _path(model, k)) for k in chosen]
    names = _leg_names(joints, np.array([data.oMf[k].translation for k in chosen]))
    return tuple(
        Limb(name, own, str(model.frames[k].name), reason)
        for name, own, k in zip(names, joints, chosen, strict=True)
    )


def _bodies(model: pin.Model) -> list[int]:
    """Frames of links that joints move."""
    frames = enumerate(model.frames)
    return [k for k, f in frames if f.type == pin.FrameType.BODY and f.parentJoint > _ROOT]


def _path(model: pin.Model, frame: int) -> list[int]:
    """Joints from the base to a frame."""
    return [int(j) for j in model.supports[model.frames[frame].parentJoint] if j > _ROOT]


def _out(model: pin.Model, frame: int) -> float:
    """From the frame's joint [m]."""
    return float(np.linalg.norm(model.frames[frame].placement.translation))


def _looked_for(model: pin.Model, data: pin.Data, where: str) -> tuple[list[int], str]:
    """Frames that are called feet, else ends of legs, else the lowest leaves."""
    for word in (*_FEET, *_ENDS):
        # As a word of its own: 'pendulum' ends nowhere.
        pattern = re.compile(rf"(?<![a-z]){word}(?![a-z])", re.IGNORECASE)
        found = _outermost(
            model, [k for k in _bodies(model) if pattern.search(spaced(model.frames[k].name))]
        )
        apart = _shared(model, found) is None and len(found) >= _FEWEST
        if found and (word in _FEET or apart):
            return found, f"the outermost link of its chain that is called {word}"
    leaves = [j for j in range(_ROOT + 1, model.njoints) if not list(model.children[j])]
    ends = _outermost(model, [k for k in _bodies(model) if model.frames[k].parentJoint in leaves])
    height = {k: float(data.oMf[k].translation[2]) for k in ends}
    low = min(height.values())
    levels = [*height.values(), *(float(place.translation[2]) for place in data.oMi[_ROOT:])]
    lowest = [k for k in ends if height[k] <= low + _LOW * max(np.ptp(levels), 1e-9)]
    bare = [k for k in lowest if _out(model, k) < 1e-6]
    if len(lowest) >= _FEWEST and bare:
        end = model.frames[bare[0]].name
        raise LegwattError(
            f"{where}: link '{end}' ends a chain, but its frame lies in its joint "
            f"'{model.names[model.frames[bare[0]].parentJoint]}' and not at a foot: the URDF does "
            "not say where that leg touches the ground; add a link 'foot' there, on a fixed joint "
            f'with <parent link="{end}"/> and its <origin>, and the same to the other legs'
        )
    return lowest, "the end of a chain that reaches as low as any"


def _outermost(model: pin.Model, frames: list[int]) -> list[int]:
    """Of frames along one chain the one furthest out, and on one joint the furthest from it."""
    best: dict[int, int] = {}
    for k in frames:
        joint = model.frames[k].parentJoint
        if joint not in best or _out(model, k) > _out(model, best[joint]) + 1e-9:
            best[joint] = k
    above = {j for k in best.values() for j in _path(model, k)[:-1]}
    return [k for joint, k in best.items() if joint not in above]


def spaced(name: str) -> str:
    """A name with its humps parted: LeftFootLink to Left Foot Link."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)


def _shared(model: pin.Model, chosen: Sequence[int]) -> tuple[int, int, int] | None:
    """Two feet that hang on one joint, and that joint; None where every leg has its own."""
    owner: dict[int, int] = {}
    for k in chosen:
        for joint in _path(model, k):
            if joint in owner:
                return owner[joint], k, joint
            owner[joint] = k
    return None


def _leg_names(joints: Sequence[tuple[str, ...]], places: Array) -> list[str]:
    """From what a leg's joint names share and no other leg's do; else from where its foot is."""
    words = [[re.split(r"[_\-. ]+", name) for name in own] for own in joints]
    shared = [[w for w in own[0] if all(w in other for other in own)] for own in words]
    common = set.intersection(*(set(own) for own in shared)) if shared else set()
    names = ["_".join(w for w in own if w not in common) for own in shared]
    names = [f"leg_{name}" if name.isdigit() else name for name in names]
    plain = all(re.fullmatch(r"\w+", name, re.ASCII) for name in names)
    if plain and len({name.lower() for name in names}) == len(names):
        return names
    out = [""] * len(names)
    for side, own in (("left", places[:, 1] >= 0), ("right", places[:, 1] < 0)):
        legs = np.flatnonzero(own)
        for at, k in enumerate(legs[np.argsort(-places[legs, 0], kind="stable")], start=1):
            out[k] = f"{side}_{at}"
    return out


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
        LegwattError: They do; says how to turn the root.
    """
    chains, where, root = robot.chains, robot.spec.path, robot.spec.base_link
    hips = chains.offset[0]
    feet = foot_positions(chains, posture[None])[0]
    if (feet[:, 2] - hips[:, 2] > _ABOVE * chains.reach).all():
        raise LegwattError(
            f"{where}: all feet lie above their hips, so that z of '{root}' seems to point down; "
            + _remedy(root, f"{np.pi:.6f} 0 0")
            + ", or give a pose 'standing' in an SRDF beside the URDF if it is right"
        )
    turns = quarter_turns(limbs, hips)
    if turns:
        raise LegwattError(
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
        LegwattError: It is a robot file. It is neither, or the file cannot be read.
    """
    path = Path(given)
    if path.suffix.lower() == ".toml":
        raise LegwattError(f"{given}: a robot file; init starts from a URDF or a robot's name")
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
        LegwattError: The SRDF is malformed. A position is no number.
    """
    if source.srdf is None:
        return "", {}
    try:
        root = ET.fromstring(source.srdf.read_bytes())
    except ET.ParseError as error:
        raise LegwattError(
            f"{source.srdf}: line {error.position[0]}: malformed XML; correct it, or move it away "
            "and the stance is sought"
        ) from None
    poses: dict[str, dict[str, float]] = {}
    for state in root.findall("group_state"):
        own = poses.setdefault(state.get("name", ""), {})
        for joint in state.findall("joint"):
            if len(joint.get("value", "").split()) == 1:  # a floating base has seven
                own[joint.get("name", "")] = _number(joint, source.srdf)
    names = (source.pose, *STANDING_POSES)
    return next(((name, poses[name]) for name in names if poses.get(name)), ("", {}))


def _number(joint: ET.Element, srdf: Path) -> float:
    value = joint.get("value", "")
    try:
        return finite(float(value))
    except ValueError:
        raise LegwattError(
            f"{srdf}: <joint name='{joint.get('name')}'>: value = '{one_line(value)}', expected a "
            "finite number"
        ) from None
