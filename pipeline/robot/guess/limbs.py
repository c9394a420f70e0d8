"""Legs and feet in the tree of a URDF's bodies.

A leg is the chain of joints from the base to a foot; a foot is the outermost link of its chain that
is called one, else the end of a chain that reaches as low as any. What belongs to no leg is held.
Arms, hands, wheels and rotors are no legs.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from actuators.checked import checked
from actuators.errors import LegwattError, known, some
from pipeline.robot.robot_tables import LegSpec

#: What nothing but feet is called, the plainest first; a name's humps count as gaps.
_FEET = ("foot", "feet", "sole", "toe", "paw", "hoof", "contact")
_ROOT = 1  # the free flyer's index
MOST_JOINTS = 7  # of a leg, as robot files have them
FEWEST = 3  # on which a robot stands statically
#: An end this share of the tree's height above the lowest one is no foot.
_LOW = 0.15
_AT_JOINT = 1e-6  # [m] between a link's frame and its joint, which then is no foot's place


def find_limbs(
    model: pin.Model, configuration: Array, feet: Sequence[str], where: str
) -> tuple[tuple[LegSpec, ...], str, str]:
    """The legs of a robot, why these are their feet, and why it is none that walks, or nothing.

    `feet`: frames that the user named; none to look for them. Two legs are returned where their
    feet are called so, for a robot on two legs; an arm, a gripper, a drone has none.

    Raises:
        LegwattError: Feet are named that cannot be, two feet hang on one leg, or the URDF does not
            say where legs touch the ground.
    """
    data = model.createData()
    pin.framesForwardKinematics(model, data, configuration)
    links = {
        str(frame.name): (frame, data.oMf[k].translation.copy())
        for k, frame in enumerate(model.frames)
        if frame.type == pin.FrameType.BODY
    }
    # From its joint [m], rounded: 0 for a link whose frame lies there.
    out = {
        n: round(float(np.linalg.norm(f.placement.translation)), 9) for n, (f, _) in links.items()
    }
    chains = [
        [
            name
            for joint in list(model.supports[end])[_ROOT + 1 :]
            for name in sorted(
                (n for n, (f, _) in links.items() if f.parentJoint == joint), key=lambda n: out[n]
            )
        ]
        for end in range(_ROOT + 1, model.njoints)
        if not list(model.children[end])
    ]
    moved = [name for chain in chains for name in chain]
    chosen, reason = [known("feet: no link moves of name", f, moved, where) for f in feet], "named"
    for word in _FEET if not feet else ():
        called = [[link for link in chain if _called(word, link)] for chain in chains]
        chosen = list(dict.fromkeys(found[-1] for found in called if found))
        if chosen:
            reason = f"the outermost link of its chain that is called {word}"
            break
    by_name = len(chosen) > 1 or bool(feet)
    if not by_name:
        reason = "the end of a chain that reaches as low as any"
        chosen = [
            c[-1]
            for c in chains
            if not (_endless(model, links[c[-1]][0]) and out[c[-1]] < _AT_JOINT)
        ]
        heights = [float(links[name][1][2]) for name in (*chosen, *links)]
        low = min(heights[: len(chosen)], default=0.0) + _LOW * max(float(np.ptp(heights)), 1e-9)
        chosen = [name for name, height in zip(chosen, heights, strict=False) if height <= low]
    joints = [
        tuple(
            str(model.names[j])
            for j in list(model.supports[links[foot][0].parentJoint])[_ROOT + 1 :]
        )
        for foot in chosen
    ]
    tangled = _tangled(chosen, joints)
    few = (
        f"feet found: {', '.join(chosen) or 'none'}, and a statically stable gait needs three on "
        f"the ground; name others as feet where there are: chains end in "
        f"{some([chain[-1] for chain in chains], 12) or 'none'}"
    )
    if not by_name and (tangled or len(chosen) < FEWEST):
        return (), "", few if len(chosen) < FEWEST else tangled
    bare = [foot for foot in chosen if not by_name and out[foot] < _AT_JOINT]
    if bare and not tangled:
        tangled = (
            f"link '{bare[0]}' ends a chain, but its frame lies in its joint: the URDF says not "
            "where that leg touches the ground; add a link 'foot' there, and to the other legs"
        )
    if tangled:
        raise LegwattError(f"{where}: {tangled}")
    places = np.array([links[foot][1] for foot in chosen])
    legs = []
    for k, name in enumerate(_leg_names(joints, places)):
        side = "left" if places[k, 1] >= 0 else "right"
        leg = {"name": name, "joints": joints[k], "foot": chosen[k], "side": side}
        legs.append(checked(LegSpec, leg, f"{where}: leg '{name}'"))
    return tuple(legs), reason, "" if len(legs) >= FEWEST else few


def _called(word: str, link: str) -> bool:
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", link)  # LeftFootLink: Left Foot Link
    return re.search(rf"(?<![a-z]){word}(?![a-z])", spaced, re.IGNORECASE) is not None


def _endless(model: pin.Model, link: pin.Frame) -> bool:
    """Whether a link turns on and on, as a wheel or a rotor does."""
    return not np.isfinite(model.upperPositionLimit[model.joints[link.parentJoint].idx_q])


def _tangled(feet: Sequence[str], joints: Sequence[tuple[str, ...]]) -> str:
    """Why chains of joints are no legs; empty where they are."""
    owner: dict[str, str] = {}
    for foot, path in zip(feet, joints, strict=True):
        for joint in path:
            other = owner.setdefault(joint, foot)
            if other != foot:
                return (
                    f"feet '{other}' and '{foot}' both hang on joint '{joint}'; a leg has one foot "
                    "and joints of its own: name the feet, one for each leg"
                )
        if len(path) > MOST_JOINTS:
            return (
                f"{len(path)} joints lead to foot '{foot}'; a leg has at most {MOST_JOINTS}: name "
                "a frame further in as its foot"
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
