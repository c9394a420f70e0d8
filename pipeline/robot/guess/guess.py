"""From a URDF to all that a robot file says, each guess with its reason.

The walk is a slow one that the legs can do: stroke and lift within reach and limits.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import tomlkit

from actuators.arrays import Array
from actuators.errors import LegwattError, closest, one_line
from actuators.parameters import ParameterSet
from pipeline.robot.check import check_urdf, refused
from pipeline.robot.guess.limbs import Limb, find_limbs, refuse_turned, source_of, standing_pose
from pipeline.robot.guess.motors import known_motors
from pipeline.robot.guess.stance import Margin, Stance, Standing
from pipeline.robot.inverse.inverse_kinematics import ACCEPTED, reach
from pipeline.robot.inverse.least_motion import freedoms
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.published import RobotSource
from pipeline.robot.robot import Robot, root_link
from pipeline.robot.robot_file import LegSpec, RobotSpec
from pipeline.robot.urdf_source import model_of_angles, parse_elements

_FIRST = 0.3  # stroke over the height of the hips, if the legs allow
_SHRINK = 0.85
_TRIES = 20
_CUT, _SHORTER = 0.7, 4  # of a stroke that the gait does not allow, and how often
_LIFT = 0.4  # over the stroke
_SIDE = 0.25  # room to the sides, over the stroke: the body sways
#: Over the stroke: how far the foot of a leg that lacks a direction may leave its path.
_ASTRAY = 0.25
_PERIOD = 2.0  # [s] of a robot whose hips are at _HEIGHT
_HEIGHT = 0.3  # [m]
#: Stances that are looked at, and the stroke over the hips' height that is enough of one.
_STANCES, _STROKE = 60, 0.2


@dataclass(frozen=True)
class Guess:
    """A robot as found."""

    source: RobotSource  #: Its URDF.
    base_link: str  #: The root.
    limbs: tuple[Limb, ...]  #: Legs.
    #: Joints outside the legs, where they are held [rad, m], and why.
    held: tuple[tuple[str, float, str], ...]
    stance: Stance  #: Where it stands.
    pace: Pace | None  #: How it walks; None where no stroke was found.
    mass: float  #: Of all links [kg].
    #: ``[actuators]`` of its robot file; None where nobody knows its motors.
    motors: Mapping[str, Any] | None = None


def guess_robot(
    given: str, margin: Margin, *, feet: Sequence[str] = (), base: str | None = None
) -> Guess:
    """Find out about a robot.

    `given`: a URDF's path, or a robot's name in ``example-robot-data``. `margin`: of static
    stability: feet (1, F, 3) and a point (1, 2) to (1,) [m]. `feet`: frames at the feet; none to
    look for them. `base`: the base's link; the root by default.

    Raises:
        LegwattError: Something cannot be found; one line says which option names it. The URDF
            cannot be read. The URDF's bodies or joints cannot be.
    """
    source = source_of(given)
    where = str(source.urdf) if not source.published else source.name
    model = model_of_angles(source.text, where, floating=True)
    root = root_link(model)
    if base not in (None, root):
        links = [str(f.name) for f in model.frames if f.type == pin.FrameType.BODY]
        why = (
            f"the URDF's tree begins at '{root}', and that is the base; feet are placed in its "
            f"frame. If '{base}' moves against it, write the URDF with '{base}' as root"
            if base in links
            else f"no such link; {closest(str(base), links)}"
        )
        raise LegwattError(f"{where}: --base {one_line(base)}: {why}")
    pose_name, pose = standing_pose(source)
    names = [str(name) for name in list(model.names)[2:]]
    index = {name: int(model.joints[model.getJointId(name)].idx_q) for name in names}
    q = pin.neutral(model)
    for joint in index.keys() & pose.keys():
        q[index[joint]] = pose[joint]
    limbs = find_limbs(model, q, feet, where)
    refused(check_urdf(source.text, where), where, where)
    of_legs = [joint for limb in limbs for joint in limb.joints]
    others = [name for name in names if name not in of_legs]
    ends = model.lowerPositionLimit, model.upperPositionLimit
    bounds = {name: (float(ends[0][at]), float(ends[1][at])) for name, at in index.items()}
    held = []
    for joint in others:
        low, high = bounds[joint]
        if joint in pose and low <= pose[joint] <= high:
            held.append((joint, round(pose[joint], 6), f"the pose '{pose_name}'"))
        elif low <= 0 <= high or low >= high:
            held.append((joint, 0.0, "belongs to no leg; its zero"))
        else:
            middle = round((low + high) / 2, 6)
            held.append((joint, middle, "belongs to no leg; the middle of its limits"))
    # What a robot file would say before it is known where the robot stands and how it walks.
    legs = tuple(LegSpec(x.name, x.joints, x.foot, "", "", (0.0, 0.0, 0.0)) for x in limbs)
    none = ParameterSet((), where)
    stated = RobotSpec(Path(where), (), source.name, source.urdf, root, none, legs)
    stated = replace(stated, held=tuple((joint, at) for joint, at, _ in held))
    robot = Robot(stated, source.text, model)
    stuck = [f"'{joint}'" for joint in of_legs if bounds[joint][0] == bounds[joint][1]]
    if stuck:
        raise LegwattError(
            f"{where}: limits of {', '.join(stuck)}: lower equals upper, so that the leg cannot "
            "move there; write their range in the URDF, or make them continuous"
        )
    posture = robot.layout.by_leg(np.array([[pose.get(joint, 0.0) for joint in robot.joints]]))[0]
    refuse_turned(robot, limbs, posture)
    standing, stance = Standing(robot, margin), None
    if pose and all(joint in pose for joint in of_legs):
        srdf = source.srdf.name if source.srdf else ""
        stance = standing.of_pose(posture, f"pose '{pose_name}' of {srdf}")
    if stance is not None:
        pace = find_pace(robot, stance)
    else:
        stance, pace = _searched(standing)
    motors = known_motors(
        (source.name, parse_elements(source.text, where).get("name", "")), of_legs
    )
    return Guess(source, root, limbs, tuple(held), stance, pace, robot.mass, motors)


def _searched(standing: Standing) -> tuple[Stance, Pace | None]:
    """The first stance, from the best mark down, that leaves a stroke to walk with."""
    best: tuple[float, Stance, Pace | None] | None = None
    robot = standing.robot
    for stance in islice(standing.candidates(), _STANCES):
        pace = find_pace(robot, stance)
        height = float((robot.chains.offset[0, :, 2] - stance.feet[:, 2]).mean())
        stroke = pace.stroke / height if pace else 0.0
        if stroke >= _STROKE:
            return stance, pace
        if best is None or stroke > best[0]:
            best = (stroke, stance, pace)
    if best is None:
        raise LegwattError(
            f"{robot.spec.path}: no stance within the joints' limits puts all feet on one level "
            "around the centre of mass; name other feet with --foot, or give a pose 'standing' in "
            "an SRDF beside the URDF"
        )
    return best[1], best[2]


@dataclass(frozen=True)
class Pace:
    """Numbers of a walk."""

    stroke: float  #: Of the feet [m].
    lift: float  #: Of the feet [m].
    period: float  #: [s].


def find_pace(robot: Robot, stance: Stance) -> Pace | None:
    """The longest stroke of a row of shorter and shorter ones that every leg can do.

    Returns None where the legs cannot take even the shortest.
    """
    chains, (lower, upper) = robot.chains, robot.leg_limits
    height = float((chains.offset[0, :, 2] - stance.feet[:, 2]).mean())
    about = replace(chains, nominal=stance.posture)
    follows = np.array([not own.lacks for own in freedoms(about)])
    room = np.where(follows[:, None], 1.0, [1.0, 0.0, 1.0])  # which corners a leg is to reach

    def possible(stroke: float, lift: float) -> bool:
        """Feet reach all corners of a step, with room to the sides, within the limits."""
        x, y, z = stroke / 2, _SIDE * stroke, lift
        corners = [(a * x, b * y, c * z) for a in (-1, 0, 1) for b in (-1, 0, 1) for c in (0, 1)]
        target = stance.feet + np.array(corners)[:, None, :] * room
        q, miss = reach(about, target, stance.posture)
        inside = (q >= lower) & (q <= upper)
        off = np.linalg.norm(foot_positions(about, q) - target, axis=-1)
        return bool(miss.max() <= ACCEPTED and off.max() <= _ASTRAY * stroke and inside.all())

    # A leg that lacks a direction leaves its path when it lifts its foot: less lift, less of that.
    shares = (_LIFT,) if follows.all() else (_LIFT, _LIFT / 2, _LIFT / 4)
    strokes = [_rounded(_FIRST * height * _SHRINK**k) for k in range(_TRIES)]
    if not possible(strokes[-1], _rounded(shares[-1] * strokes[-1])):
        return None
    for stroke in strokes:
        for share in shares:
            if possible(stroke, lift := _rounded(share * stroke)):
                # Robots of one shape walk alike where the period goes with the root of height.
                return Pace(stroke, lift, _rounded(_PERIOD * (height / _HEIGHT) ** 0.5))
    return None


def shorter(pace: Pace | None) -> Iterator[Pace]:
    """Shorter and shorter strokes and lifts, for a gait that asks more than feet alone do."""
    for k in range(1, _SHORTER + 1 if pace else 0):
        assert pace is not None
        stroke = _rounded(pace.stroke * _CUT**k)
        yield Pace(stroke, _rounded(pace.lift * _CUT**k), pace.period)


def _rounded(value: float) -> float:
    """Two significant digits."""
    return float(f"{value:.2g}")


_PLACES = 4  # digits of feet and postures [m, rad]


def robot_text(guess: Guess, out: Path) -> str:
    """The robot file of a guess, every guess with its reason under ``[assumed]``.

    `out`: where the file will stand; it names the URDF from there.
    """
    assumed = {"robot.base_link": "the root of the URDF's tree of links"}
    lines = [
        f"# {guess.source.name}, guessed by `python -m pipeline init`. [assumed] says why each",
        "# guess was made: look at the picture beside this file, then correct what is wrong.",
        "",
        "[robot]",
        f"name = {_text(guess.source.name)}",
        f"urdf = {_text(guess.source.reference(out))}",
        f"base_link = {_text(guess.base_link)}",
        'base = "floating"',
    ]
    stance = guess.stance
    levelled = f", feet levelled by up to {1e3 * stance.levelled:.2g} mm"
    for limb, foot, posture in zip(guess.limbs, stance.feet, stance.posture, strict=True):
        key = f"legs.{_key(limb.name)}"
        lines += [
            "",
            f"[{key}]",
            f"joints = [{', '.join(map(_text, limb.joints))}]",
            f"foot = {_text(limb.foot)}",
            f'side = "{"left" if foot[1] >= 0 else "right"}"',
            f"neutral_foot = {_numbers(foot)}",
            f"start_posture = {_numbers(posture[: len(limb.joints)])}",
        ]
        assumed |= {
            f"{key}.joints": "the chain of joints from the base to the foot",
            f"{key}.foot": limb.reason,
            f"{key}.side": "the side of the foot in the stance",
            f"{key}.neutral_foot": stance.reason
            + (levelled if stance.levelled >= 0.5 * 10**-_PLACES else ""),
            f"{key}.start_posture": "the same",
        }
    if guess.held:
        lines += ["", "[held]  # [rad, m]"]
        lines += [f"{_key(joint)} = {value!r}" for joint, value, _ in guess.held]
        assumed |= {f"held.{_key(joint)}": reason for joint, _, reason in guess.held}
    # The slowest of the usual gaits for so many legs; six walk in two tripods.
    gait = {4: "crawl", 6: "tripod"}.get(len(guess.limbs), "wave")
    lines += ["", "[gait]", f'name = "{gait}"', 'transfer_path = "harmonic"', "", "[assumed]"]
    lines += [f"{_text(key)} = {_text(reason)}" for key, reason in assumed.items()]
    pace = guess.pace or Pace(0.02, 0.01, 2.0)
    why = (
        "the longest of a row of strokes that every leg can do within its limits"
        if guess.pace
        else "no stroke was found within reach and limits: change the stance"
    )
    mass = float(f"{guess.mass:.6g}")
    lines += _parameter("total_mass", mass, "kg", "derived", "the sum of the URDF's links")
    for name, value, unit, reason in (
        ("foot_stroke", 1e3 * pace.stroke, "mm", why),
        ("foot_lift", 1e3 * pace.lift, "mm", "a share of the stroke"),
        ("gait_period", pace.period, "s", "slow; goes with the root of the hips' height"),
    ):
        number = float(f"{value:.9g}")
        lines += _parameter(name, number, unit, "assumed", "python -m pipeline init")
        low, high = (float(f"{factor * number:.6g}") for factor in (0.5, 2.0))
        lines += [f"reason = {_text(reason)}", f"interval = [{low!r}, {high!r}]"]
    lines += _parameter("gravity", 9.81, "m/s^2", "datasheet", "usual engineering value")
    text = "\n".join(lines) + "\n"
    if guess.motors:
        text += "\n" + tomlkit.dumps({"actuators": dict(guess.motors)})
    return text


def _parameter(name: str, value: float, unit: str, basis: str, source: str) -> list[str]:
    head = ["", f"[parameters.{name}]", f"value = {value!r}", f'unit = "{unit}"']
    return [*head, f'basis = "{basis}"', f"source = {_text(source)}"]


def _numbers(values: Array) -> str:
    return "[" + ", ".join(repr(round(float(x), _PLACES) + 0.0) for x in values) + "]"


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _key(name: str) -> str:
    bare = name.isascii() and name.replace("_", "").replace("-", "").isalnum()
    return name if bare else _text(name)
