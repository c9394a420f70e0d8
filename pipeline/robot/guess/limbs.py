"""Legs and feet in the tree of a URDF's bodies.

A leg is the chain of joints from the base to a foot; a foot is the outermost link of its chain that
is called one, else the end of a chain that reaches as low as any. What belongs to no leg is held.
Arms, hands, wheels and rotors are no legs.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from actuators.errors import LegwattError, known, some
from pipeline.robot.kinematics import MOST_JOINTS

#: What nothing but feet is called, the plainest first; a name's humps count as gaps.
_FEET = ("foot", "feet", "sole", "toe", "paw", "hoof", "contact")
_ROOT = 1  # the free flyer's index
FEWEST = 3  # on which a robot stands statically
#: An end this share of the tree's height above the lowest one is no foot.
_LOW = 0.15
_AT_JOINT = 1e-6  # [m] between a link's frame and its joint, which then is no foot's place


@dataclass(frozen=True)
class Limb:
    """One leg as found."""

    name: str  #: Short name.
    joints: tuple[str, ...]  #: From the base outward.
    foot: str  #: Frame at the foot point.
    reason: str  #: Why this is its foot.


def find_limbs(
    model: pin.Model, configuration: Array, feet: Sequence[str], where: str
) -> tuple[tuple[Limb, ...], str]:
    """The legs of a robot, and why it is none that walks; empty where it is.

    `feet`: frames that the user named; none to look for them. Two legs are returned where their
    feet are called so, for a robot on two legs; an arm, a gripper, a drone has none.

    Raises:
        LegwattError: Feet are named that cannot be, two feet hang on one leg, or the URDF does not
            say where legs touch the ground.
    """
    data = model.createData()
    pin.framesForwardKinematics(model, data, configuration)
    places = {
        str(frame.name): np.array(data.oMf[k].translation)
        for k, frame in enumerate(model.frames)
        if frame.type == pin.FrameType.BODY
    }
    chains = _chains(model)
    moved = [name for chain in chains for name in chain]
    chosen, reason = [known("feet: no link moves of name", f, moved, where) for f in feet], "named"
    for word in _FEET if not feet else ():
        called = [[link for link in chain if _called(word, link)] for chain in chains]
        chosen = list(dict.fromkeys(links[-1] for links in called if links))
        if chosen:
            reason = f"the outermost link of its chain that is called {word}"
            break
    by_name = len(chosen) > 1 or bool(feet)
    if not by_name:
        reason = "the end of a chain that reaches as low as any"
        chosen = _lowest(model, chains, places)
    few = (
        f"feet found: {', '.join(chosen) or 'none'}, and a statically stable gait needs three on "
        f"the ground; name others as feet where there are: chains end in "
        f"{some([chain[-1] for chain in chains], 12) or 'none'}"
    )
    joints = [_joints(model, foot) for foot in chosen]
    tangled = _tangled(chosen, joints)
    if not by_name and (tangled or len(chosen) < FEWEST):
        return (), few if len(chosen) < FEWEST else tangled
    if wrong := tangled or ("" if by_name else _bare(model, chosen)):
        raise LegwattError(f"{where}: {wrong}")
    names = _leg_names(joints, np.array([places[foot] for foot in chosen]))
    limbs = tuple(map(Limb, names, joints, chosen, [reason] * len(chosen)))
    return limbs, "" if len(limbs) >= FEWEST else few


def _called(word: str, link: str) -> bool:
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", link)  # LeftFootLink: Left Foot Link
    return re.search(rf"(?<![a-z]){word}(?![a-z])", spaced, re.IGNORECASE) is not None


def _body(model: pin.Model, link: str) -> pin.Frame:
    return model.frames[model.getFrameId(link, pin.FrameType.BODY)]


def _joints(model: pin.Model, frame: str) -> tuple[str, ...]:
    """Joints from the base to a frame."""
    carrier = _body(model, frame).parentJoint
    return tuple(str(model.names[j]) for j in model.supports[carrier] if j > _ROOT)


def _out(model: pin.Model, frame: str) -> float:
    """From the frame's joint [m], rounded."""
    return round(float(np.linalg.norm(_body(model, frame).placement.translation)), 9)


def _chains(model: pin.Model) -> list[list[str]]:
    """Links from the base to every end of the tree, the outermost of each joint last."""
    links: dict[int, list[str]] = {}
    for frame in model.frames:
        if frame.type == pin.FrameType.BODY:
            links.setdefault(int(frame.parentJoint), []).append(str(frame.name))
    for names in links.values():
        names.sort(key=lambda name: _out(model, name))
    ends = [j for j in range(_ROOT + 1, model.njoints) if not list(model.children[j])]
    return [
        [name for j in model.supports[end] if j > _ROOT for name in links[int(j)]] for end in ends
    ]


def _lowest(model: pin.Model, chains: list[list[str]], places: Mapping[str, Array]) -> list[str]:
    """Ends of chains that are as low as any, wheels and rotors aside."""
    ends = [chain[-1] for chain in chains if not _turns(model, chain[-1])]
    span = max(float(np.ptp([place[2] for place in places.values()])), 1e-9)
    least = min((places[end][2] for end in ends), default=0.0)
    return [end for end in ends if places[end][2] <= least + _LOW * span]


def _turns(model: pin.Model, link: str) -> bool:
    """Whether a link turns on and on about its own frame, as a wheel or a rotor does."""
    at = model.joints[_body(model, link).parentJoint].idx_q
    return _out(model, link) < _AT_JOINT and not np.isfinite(model.upperPositionLimit[at])


def _tangled(feet: Sequence[str], joints: Sequence[tuple[str, ...]]) -> str:
    """Why chains of joints are no legs; empty where they are."""
    owner: dict[str, str] = {}
    for foot, path in zip(feet, joints, strict=True):
        for joint in path:
            if joint in owner:
                return (
                    f"feet '{owner[joint]}' and '{foot}' both hang on joint '{joint}'; a leg has "
                    "one foot and joints of its own: name the feet, one for each leg"
                )
            owner[joint] = foot
        if len(path) > MOST_JOINTS:
            return (
                f"{len(path)} joints lead to foot '{foot}'; a leg has at most {MOST_JOINTS}: name "
                "a frame further in as its foot"
            )
    return ""


def _bare(model: pin.Model, feet: Sequence[str]) -> str:
    """What the URDF does not say of the place of a foot; empty where it does."""
    for foot in feet:
        if _out(model, foot) < _AT_JOINT:
            return (
                f"link '{foot}' ends a chain, but its frame lies in its joint "
                f"'{_joints(model, foot)[-1]}' and not at a foot: the URDF does not say where that "
                "leg touches the ground; add a link 'foot' there, on a fixed joint with "
                f'<parent link="{foot}"/> and its <origin>, and the same to the other legs'
            )
    return ""


def _leg_names(joints: Sequence[tuple[str, ...]], places: Array) -> list[str]:
    """From what a leg's joint names share and no other leg's do; else from where its foot is."""
    words = [[re.split(r"[_\-. ]+", name) for name in path] for path in joints]
    shared = [[w for w in path[0] if all(w in other for other in path)] for path in words]
    common = set.intersection(*map(set, shared))
    names = ["_".join(w for w in path if w not in common) for path in shared]
    names = [f"leg_{name}" if name.isdigit() else name for name in names]
    plain = all(re.fullmatch(r"\w+", name, re.ASCII) for name in names)
    if plain and len({name.lower() for name in names}) == len(names):
        return names
    out = [""] * len(names)
    for side, there in (("left", places[:, 1] >= 0), ("right", places[:, 1] < 0)):
        legs = np.flatnonzero(there)
        for at, k in enumerate(legs[np.argsort(-places[legs, 0], kind="stable")], start=1):
            out[k] = f"{side}_{at}"
    return out
