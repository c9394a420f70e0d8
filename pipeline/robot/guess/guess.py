"""From a URDF to all that a robot file says, each guess with its reason.

The walk is a slow one that the legs can do: stroke and lift within reach and limits.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import tomlkit

from actuators.arrays import Array
from actuators.errors import LegwattError, one_line
from actuators.parameters import ParameterSet
from pipeline.robot.check import check_urdf, refused
from pipeline.robot.guess.limbs import Limb, find_limbs
from pipeline.robot.guess.motors import known_motors
from pipeline.robot.guess.stance import (
    Margin,
    Pace,
    Stance,
    find_pace,
    stance_of_pose,
    stances,
)
from pipeline.robot.published import RobotSource, named_robot
from pipeline.robot.robot import Robot, root_link
from pipeline.robot.robot_file import LegSpec, RobotSpec
from pipeline.robot.urdf_source import model_of_angles, parse_elements

#: Poses of an SRDF that are meant to stand, those before others.
STANDING_POSES = ("standing", "stand", "half_sitting", "home", "default")
#: Stances that are looked at, and the stroke over the hips' height that is enough of one.
_STANCES, _STROKE = 60, 0.2
_CUT, _SHORTER = 0.7, 4  # of a stroke that the gait does not allow, and how often
_PLACES = 4  # digits of feet and postures [m, rad]
_HEAD = """# {name}, guessed by `python -m pipeline init`. [assumed] says why each
# guess was made: look at the picture beside this file, then correct what is wrong.

"""


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
        raise LegwattError(
            f"{where}: --base {one_line(base)}: the URDF's tree begins at '{root}', and that is "
            "the base; feet are placed in its frame. Write the URDF with another link as its root"
        )
    pose_name, q = standing_pose(model, source)
    limbs = find_limbs(model, q, feet, where)
    refused(check_urdf(source.text, where), where, where)
    of_legs = [joint for limb in limbs for joint in limb.joints]
    held, stuck = [], []
    for index, name in enumerate(map(str, model.names)):
        at = model.joints[index].idx_q
        low, high = (
            float(ends[at]) for ends in (model.lowerPositionLimit, model.upperPositionLimit)
        )
        if index < 2:
            continue
        if name in of_legs:
            stuck += [f"'{name}'"] * (low == high)
        elif low <= q[at] <= high or low >= high:
            why = f"the pose '{pose_name}'" if pose_name else "belongs to no leg; its zero"
            held.append((name, round(float(q[at]), 6), why))
        else:
            why = "belongs to no leg; the middle of its limits"
            held.append((name, round((low + high) / 2, 6), why))
    if stuck:
        raise LegwattError(
            f"{where}: limits of {', '.join(stuck)}: lower equals upper, so that the leg cannot "
            "move there; write their range in the URDF, or make them continuous"
        )
    # What a robot file would say before it is known where the robot stands and how it walks.
    legs = tuple(LegSpec(x.name, x.joints, x.foot, "", "", (0.0, 0.0, 0.0)) for x in limbs)
    none = ParameterSet((), where)
    stated = RobotSpec(Path(where), (), source.name, source.urdf, root, none, legs)
    stated = replace(stated, held=tuple((joint, at) for joint, at, _ in held))
    robot = Robot(stated, source.text, model)
    stance, pace = None, None
    if pose_name:
        srdf = source.srdf.name if source.srdf else ""
        reason = f"pose '{pose_name}' of {srdf}"
        stance = stance_of_pose(robot, margin, robot.leg_positions(q[None])[0], reason)
        pace = find_pace(robot, stance) if stance else None
    if stance is None:
        stance, pace = _searched(robot, margin)
    own_name = parse_elements(source.text, where).get("name", "")
    motors = known_motors((source.name, own_name), of_legs)
    return Guess(source, root, limbs, tuple(held), stance, pace, robot.mass, motors)


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


def standing_pose(model: pin.Model, source: RobotSource) -> tuple[str, Array]:
    """The SRDF's pose for standing: its name, and the configuration, shape (nq,).

    The neutral one and no name without an SRDF, or a pose in it that is called as poses for
    standing are.

    Raises:
        LegwattError: The SRDF is malformed.
    """
    neutral = np.asarray(pin.neutral(model))
    if source.srdf is None:
        return "", neutral
    try:
        pin.loadReferenceConfigurations(model, str(source.srdf), False)
    except RuntimeError as error:
        raise LegwattError(
            f"{source.srdf}: malformed XML: {one_line(error)}; correct it, or move it away and "
            "the stance is sought"
        ) from None
    poses = {str(pose.key()): np.asarray(pose.data()) for pose in model.referenceConfigurations}
    names = [name for name in (source.pose, *STANDING_POSES) if name in poses]
    return (names[0], poses[names[0]]) if names else ("", neutral)


def _searched(robot: Robot, margin: Margin) -> tuple[Stance, Pace | None]:
    """The first stance, from the best mark down, that leaves a stroke to walk with."""
    best: tuple[float, Stance, Pace | None] | None = None
    for stance in islice(stances(robot, margin), _STANCES):
        pace = find_pace(robot, stance)
        height = float((robot.chains.hips[:, 2] - stance.feet[:, 2]).mean())
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


def shorter(pace: Pace | None) -> Iterator[Pace]:
    """Shorter and shorter strokes and lifts, for a gait that asks more than feet alone do."""
    for k in range(1, _SHORTER + 1 if pace else 0):
        assert pace is not None
        stroke, lift = (float(f"{x * _CUT**k:.2g}") for x in (pace.stroke, pace.lift))
        yield Pace(stroke, lift, pace.period)


def robot_text(guess: Guess, out: Path) -> str:
    """The robot file of a guess, every guess with its reason under ``[assumed]``.

    `out`: where the file will stand; it names the URDF from there.
    """
    assumed = {"robot.base_link": "the root of the URDF's tree of links"}
    stance, legs = guess.stance, {}
    levelled = f", feet levelled by up to {1e3 * stance.levelled:.2g} mm"
    for limb, foot, posture in zip(guess.limbs, stance.feet, stance.posture, strict=True):
        legs[limb.name] = {
            "joints": list(limb.joints),
            "foot": limb.foot,
            "side": "left" if foot[1] >= 0 else "right",
            "neutral_foot": _rounded(foot),
            "start_posture": _rounded(posture[: len(limb.joints)]),
        }
        lifted = levelled if stance.levelled >= 0.5 * 10**-_PLACES else ""
        reasons = {
            "joints": "the chain of joints from the base to the foot",
            "foot": limb.reason,
            "side": "the side of the foot in the stance",
            "neutral_foot": stance.reason + lifted,
            "start_posture": "the same",
        }
        assumed |= {f"legs.{limb.name}.{key}": reason for key, reason in reasons.items()}
    assumed |= {f"held.{joint}": reason for joint, _, reason in guess.held}
    pace = guess.pace or Pace(0.02, 0.01, 2.0)
    why = (
        "the longest of a row of strokes that every leg can do within its limits"
        if guess.pace
        else "no stroke was found within reach and limits: change the stance"
    )
    weight = {"unit": "kg", "basis": "derived", "source": "the sum of the URDF's links"}
    parameters = {"total_mass": {"value": float(f"{guess.mass:.6g}"), **weight}}
    for name, value, unit, reason in (
        ("foot_stroke", 1e3 * pace.stroke, "mm", why),
        ("foot_lift", 1e3 * pace.lift, "mm", "a share of the stroke"),
        ("gait_period", pace.period, "s", "slow; goes with the root of the hips' height"),
    ):
        number = float(f"{value:.9g}")
        parameters[name] = {
            "value": number,
            "unit": unit,
            "basis": "assumed",
            "source": "python -m pipeline init",
            "reason": reason,
            "interval": [float(f"{factor * number:.6g}") for factor in (0.5, 2.0)],
        }
    pull = {"unit": "m/s^2", "basis": "datasheet", "source": "usual engineering value"}
    # The slowest of the usual gaits for so many legs; six walk in two tripods.
    gait = {4: "crawl", 6: "tripod"}.get(len(guess.limbs), "wave")
    table = {
        "robot": {
            "name": guess.source.name,
            "urdf": guess.source.reference(out),
            "base_link": guess.base_link,
            "base": "floating",
        },
        "legs": legs,
        "held": {joint: value for joint, value, _ in guess.held},  # [rad, m]
        "gait": {"name": gait, "transfer_path": "harmonic"},
        "assumed": assumed,
        "parameters": parameters | {"gravity": {"value": 9.81, **pull}},
        "actuators": dict(guess.motors or {}),
    }
    written = {key: value for key, value in table.items() if value}
    return _HEAD.format(name=guess.source.name) + tomlkit.dumps(written)


def _rounded(values: Array) -> list[float]:
    return [round(float(x), _PLACES) + 0.0 for x in values]
