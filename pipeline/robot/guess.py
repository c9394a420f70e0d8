"""From a URDF to all that a robot file says, each guess with its reason.

A leg is the chain of joints from the base to a foot; a foot is the outermost link of its chain that
is called one, else the end of a chain that reaches as low as any. What belongs to no leg is held.
Arms, hands, wheels and rotors are no legs.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import tomlkit

from actuators.arrays import Array
from actuators.checked import checked
from actuators.errors import LegwattError, known, one_line, some
from actuators.parameters import ParameterSet
from pipeline.robot.check import check_urdf, refused
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.robot import Robot, root_link
from pipeline.robot.robot_file import (
    LegSpec,
    RobotSource,
    RobotSpec,
    RobotTable,
    known_motors,
    robot_source,
    usual_gait,
)
from pipeline.robot.stance import Stance, searched, stance_of_pose
from pipeline.robot.urdf import model_of_angles, parse_elements, read_urdf

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
    supports = {n: list(model.supports[f.parentJoint])[_ROOT + 1 :] for n, (f, _) in links.items()}
    outward = sorted(links, key=lambda n: (len(supports[n]), out[n]))
    ends = [k for k in range(_ROOT + 1, model.njoints) if not list(model.children[k])]
    chains = [
        [n for n in outward if supports[n] and supports[n][-1] in model.supports[end]]
        for end in ends
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
    joints = [tuple(str(model.names[j]) for j in supports[foot]) for foot in chosen]
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


#: Poses of an SRDF that are meant to stand, those before others.
STANDING_POSES = ("standing", "stand", "half_sitting", "home", "default")
#: Of the search: every so many of the best stances, and at most so many of these.
_EVERY, _STANCES = 8, 5
#: Strokes over the hips' height, from the longest; lift over the stroke.
_STROKES, _LIFT = 0.3 * 0.7 ** np.arange(6), 0.4
#: [s] of a robot whose hips are so high [m]: robots of one shape walk alike where the period goes
#: with the root of the height.
_PERIOD, _HEIGHT = 2.0, 0.3
_PLACES = 4  # digits of feet and postures [m, rad]
_HEAD = """# {name}, guessed by `python -m pipeline init`. [assumed] says why each
# guess was made: look at the picture beside this file, then correct what is wrong.

"""


@dataclass(frozen=True)
class Guess:
    """A robot as found."""

    source: RobotSource  #: Its URDF.
    base_link: str  #: The root.
    legs: tuple[LegSpec, ...]  #: None of a robot on a fixed base.
    feet: str  #: Why the feet are these.
    #: Joints outside the legs, where they are held [rad, m], and why.
    held: tuple[tuple[str, float, str], ...]
    mass: float  #: Of all links [kg].
    #: ``[actuators]`` of its robot file; None where nobody knows its motors.
    motors: Mapping[str, Any] | None = None
    gaitless: str = ""  #: Why it has no gait; empty where it has one.
    stance: Stance | None = None  #: Where it stands; None on a fixed base.
    stroke: float = 0.0  #: Of the feet [m].
    lift: float = 0.0  #: Of the feet [m].
    period: float = 0.0  #: Of the gait [s].


def guesses(given: str, *, feet: Sequence[str] = ()) -> Iterator[Guess]:
    """What a robot may be, the best guess first: stances and, at each, shorter and shorter strokes.

    A robot with fewer than three legs has no statically stable gait; one without any stands on a
    fixed base. `given`: a URDF's path, or a robot's name in ``example-robot-data``. `feet`: frames
    at the feet; none to look for them.

    Raises:
        LegwattError: Something cannot be found or read, or the URDF's bodies or joints cannot be.
    """
    source = robot_source(given)
    text, where = read_urdf(source.urdf), source.name if source.published else str(source.urdf)
    model = model_of_angles(text, where, floating=True)
    pose, q = standing_pose(model, source)
    legs, why, gaitless = find_limbs(model, q, feet, where)
    base_link = root_link(model)
    of_legs = [joint for leg in legs for joint in leg.joints]
    floating = bool(legs)
    refused(check_urdf(text, where, of_legs, floating=floating), where, tolerant=True)
    held = tuple(_held(model, q, of_legs, pose))
    # What a robot file would say before it is known where the robot stands and how it walks.
    urdf = str(source.urdf.absolute())
    spec = RobotSpec.model_construct(
        path=Path(where),
        robot=RobotTable.model_construct(name=source.name, urdf=urdf, base_link=base_link),
        legs=legs,
        held={joint: at for joint, at, _ in held},
        parameters=ParameterSet((), where),
    )
    robot = Robot(spec, text, model)
    urdf_name = parse_elements(text, where).get("name", "")
    motors = known_motors((source.name, urdf_name), robot.joints if gaitless else of_legs)
    found = Guess(source, base_link, legs, why, held, robot.mass, motors, gaitless)
    if gaitless:
        posture = robot.leg_positions(q[None])
        stands = foot_positions(robot.chains, posture)[0] if legs else None
        reason = f"the pose '{pose}'" if pose else "its zero pose"
        yield found if stands is None else replace(found, stance=Stance(stands, posture[0], reason))
        return
    for stance in _stances(robot, source, pose, q):
        height = float((robot.chains.hips[:, 2] - stance.feet[:, 2]).mean())
        period = _rounded(_PERIOD * max(height / _HEIGHT, 0.01) ** 0.5)
        for share in _STROKES:
            stroke = _rounded(share * max(height, 0.01))
            lift = _rounded(_LIFT * stroke)
            yield replace(found, stance=stance, stroke=stroke, lift=lift, period=period)


def _stances(robot: Robot, source: RobotSource, pose: str, q: Array) -> Iterator[Stance]:
    """That of the SRDF's pose where there is one, then those of the search."""
    if pose and source.srdf:
        legs = robot.leg_positions(q[None])[0]
        stated = stance_of_pose(robot, legs, f"pose '{pose}' of {source.srdf.name}")
        if stated is not None:
            yield stated
    yield from searched(robot)[: _EVERY * _STANCES : _EVERY]


def _held(
    model: pin.Model, q: Array, of_legs: Sequence[str], pose: str
) -> Iterator[tuple[str, float, str]]:
    """Joints outside the legs: in the pose where it keeps their limits, else in the middle."""
    why = (
        f"the pose '{pose}'" if pose else "belongs to no leg; its zero, or the middle of its limits"
    )
    for name, joint in zip(model.names[2:], model.joints[2:], strict=True):  # after the free flyer
        low, high = model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]
        inside = low <= q[joint.idx_q] <= high or low >= high
        if name not in of_legs:
            yield name, round(float(q[joint.idx_q] if inside else (low + high) / 2), 6), why


def standing_pose(model: pin.Model, source: RobotSource) -> tuple[str, Array]:
    """The SRDF's pose for standing: its name, and the configuration, shape (nq,).

    The neutral one and no name without an SRDF or a pose called so; refused where it is malformed.
    """
    neutral = np.asarray(pin.neutral(model))
    if source.srdf is None:
        return "", neutral
    try:
        pin.loadReferenceConfigurations(model, str(source.srdf), False)
    except RuntimeError as error:
        raise LegwattError(f"{source.srdf}: malformed XML: {one_line(error)}") from None
    poses = {str(pose.key()): np.asarray(pose.data()) for pose in model.referenceConfigurations}
    names = [name for name in (source.pose, *STANDING_POSES) if name in poses]
    return (names[0], poses[names[0]]) if names else ("", neutral)


def robot_text(guess: Guess, out: Path) -> str:
    """The robot file of a guess, every guess with its reason under ``[assumed]``.

    `out`: where the file will stand; it names the URDF from there.
    """
    assumed = {"robot.base_link": "the root of the URDF's tree of links"}
    assumed |= {} if guess.legs else {"robot.base": guess.gaitless}
    legs = {}
    for k, leg in enumerate(guess.legs):
        assert guess.stance is not None
        foot, posture = (
            [round(float(x), _PLACES) + 0.0 for x in row[k]]
            for row in (guess.stance.feet, guess.stance.posture)
        )
        legs[leg.name] = {
            "joints": list(leg.joints),
            "foot": leg.foot,
            "side": leg.side,
            "neutral_foot": foot,
            "start_posture": posture[: len(leg.joints)],
        }
        reasons = {"foot": guess.feet, "neutral_foot": guess.stance.reason}
        assumed |= {f"legs.{leg.name}.{key}": reason for key, reason in reasons.items()}
    assumed |= {f"held.{joint}": reason for joint, _, reason in guess.held}
    table = {
        "robot": {
            "name": guess.source.name,
            "urdf": guess.source.reference(out),
            "base_link": guess.base_link,
            "base": "floating" if guess.legs else "fixed",
        },
        "legs": legs,
        "held": {joint: value for joint, value, _ in guess.held},  # [rad, m]
        "gait": {}
        if guess.gaitless
        else {"name": usual_gait(len(guess.legs)), "transfer_path": "harmonic"},
        "assumed": assumed,
        "parameters": _parameters(guess),
        "actuators": dict(guess.motors or {}),
    }
    written = {key: value for key, value in table.items() if value}
    return _HEAD.format(name=guess.source.name) + tomlkit.dumps(written)


def _parameters(guess: Guess) -> dict[str, dict[str, object]]:
    """``[parameters]``: mass and gravity, and the numbers of a gait where there is one."""
    weight = {"unit": "kg", "basis": "derived", "source": "the sum of the URDF's links"}
    pull = {"unit": "m/s^2", "basis": "datasheet", "source": "usual engineering value"}
    parameters: dict[str, dict[str, object]] = {
        "total_mass": {"value": float(f"{guess.mass:.6g}"), **weight},
        "gravity": {"value": 9.81, **pull},
    }
    longest = "the longest tried with which `check` can walk; if it cannot, none was"
    numbers = (
        ("foot_stroke", 1e3 * guess.stroke, "mm", longest),
        ("foot_lift", 1e3 * guess.lift, "mm", "a share of the stroke"),
        ("gait_period", guess.period, "s", "slow; goes with the root of the hips' height"),
    )
    for name, value, unit, reason in () if guess.gaitless else numbers:
        parameters[name] = {
            "value": float(f"{value:.9g}"),
            "unit": unit,
            "basis": "assumed",
            "source": "python -m pipeline init",
            "reason": reason,
            "interval": [float(f"{factor * value:.6g}") for factor in (0.5, 2.0)],
        }
    return parameters


def _rounded(value: float) -> float:
    """Two significant digits."""
    return float(f"{value:.2g}")
