"""From a URDF to all that a robot file says, each guess with its reason."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
import pinocchio as pin

from actuators.errors import closest, one_line
from pipeline.errors import RobotFileError
from pipeline.robot.check import refused
from pipeline.robot.guess.frame import refuse_turned, source_of, standing_pose
from pipeline.robot.guess.limbs import Limb, find_limbs
from pipeline.robot.guess.motors import KnownMotors, known_motors, names_of
from pipeline.robot.guess.pace import Pace, find_pace
from pipeline.robot.guess.stance import Margin, Stance, Standing
from pipeline.robot.kinematics import leg_columns
from pipeline.robot.leg_chains import leg_chains
from pipeline.robot.published import RobotSource
from pipeline.robot.robot import model_of_angles
from pipeline.robot.urdf_check import check_urdf
from pipeline.robot.urdf_source import read_elements

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
    motors: KnownMotors | None = None  #: Of the joints; None where nobody knows them.


def guess_robot(
    given: str, margin: Margin, *, feet: Sequence[str] = (), base: str | None = None
) -> Guess:
    """Find out about a robot.

    `given`: a URDF's path, or a robot's name in ``example-robot-data``. `margin`: of static
    stability: feet (1, F, 3) and a point (1, 2) to (1,) [m]. `feet`: frames at the feet; none to
    look for them. `base`: the base's link; the root by default.

    Raises:
        RobotFileError: Something cannot be found; one line says which option names it.
        UrdfError: The URDF cannot be read.
        UnphysicalModelError: The URDF's bodies or joints cannot be.
    """
    source = source_of(given)
    where = str(source.urdf) if not source.published else source.name
    read_elements(source.text, where)
    model = model_of_angles(source.text, where, floating=True)
    root = next(str(f.name) for f in model.frames if f.type == pin.FrameType.BODY)
    _refuse_base(model, root, base, where)
    pose_name, pose = standing_pose(source) or ("", {})
    names = [str(name) for name in list(model.names)[2:]]
    index = {name: int(model.joints[model.getJointId(name)].idx_q) for name in names}
    q = pin.neutral(model)
    for joint in index.keys() & pose.keys():
        q[index[joint]] = pose[joint]
    limbs = find_limbs(model, q, feet, where)
    refused(check_urdf(source.text, where), where, where)
    limits = model.lowerPositionLimit, model.upperPositionLimit
    of_legs = [joint for limb in limbs for joint in limb.joints]
    others = [name for name in names if name not in of_legs]
    bounds = {name: (float(limits[0][at]), float(limits[1][at])) for name, at in index.items()}
    held = tuple((joint, *_held(bounds[joint], joint, pose, pose_name)) for joint in others)
    joints = [*of_legs, *others]
    layout = leg_columns(joints, [limb.joints for limb in limbs])
    chains = leg_chains(model, [(limb.name, limb.joints, limb.foot) for limb in limbs], 1)
    stuck = [f"'{joint}'" for joint in of_legs if bounds[joint][0] == bounds[joint][1]]
    if stuck:
        raise RobotFileError(
            f"{where}: limits of {', '.join(stuck)}: lower equals upper, so that the leg cannot "
            "move there; write their range in the URDF, or make them continuous"
        )
    posture = layout.by_leg(np.array([[pose.get(joint, 0.0) for joint in joints]]))[0]
    refuse_turned(root, limbs, chains, posture, where)
    columns = np.array([index[joint] for joint in joints], dtype=np.intp)
    position = np.array([*[0.0] * len(of_legs), *[value for _, value, _ in held]])
    standing = Standing(model, chains, layout, columns, position, margin, where)
    stance = None
    if pose and all(joint in pose for joint in of_legs):
        srdf = source.srdf.name if source.srdf else ""
        stance = standing.of_pose(posture, f"pose '{pose_name}' of {srdf}")
    if stance is not None:
        pace = find_pace(chains, stance, standing.limits)
    else:
        stance, pace = _searched(standing)
    motors = known_motors(names_of(source.name, source.text), of_legs)
    mass = float(sum(inertia.mass for inertia in model.inertias))
    return Guess(source, root, limbs, held, stance, pace, mass, motors)


def _searched(standing: Standing) -> tuple[Stance, Pace | None]:
    """The first stance, from the best mark down, that leaves a stroke to walk with."""
    best: tuple[float, Stance, Pace | None] | None = None
    for stance in islice(standing.candidates(), _STANCES):
        pace = find_pace(standing.chains, stance, standing.limits)
        height = float((standing.chains.offset[0, :, 2] - stance.feet[:, 2]).mean())
        stroke = pace.stroke / height if pace else 0.0
        if stroke >= _STROKE:
            return stance, pace
        if best is None or stroke > best[0]:
            best = (stroke, stance, pace)
    if best is None:
        raise RobotFileError(
            f"{standing.where}: no stance within the joints' limits puts all feet on one level "
            "around the centre of mass; name other feet with --foot, or give a pose 'standing' in "
            "an SRDF beside the URDF"
        )
    return best[1], best[2]


def _refuse_base(model: pin.Model, root: str, base: str | None, where: str) -> None:
    if base is None or base == root:
        return
    links = [str(f.name) for f in model.frames if f.type == pin.FrameType.BODY]
    if base not in links:
        raise RobotFileError(
            f"{where}: --base {one_line(base)}: no such link; {closest(base, links)}"
        )
    raise RobotFileError(
        f"{where}: --base {one_line(base)}: the URDF's tree begins at '{root}', and that is the "
        f"base; feet are placed in its frame. If '{base}' moves against it, write the URDF with "
        f"'{base}' as root"
    )


def _held(
    limits: tuple[float, float], joint: str, pose: dict[str, float], pose_name: str
) -> tuple[float, str]:
    """Where a joint outside the legs is held, and why."""
    low, high = limits
    if joint in pose and low <= pose[joint] <= high:
        return round(pose[joint], 6), f"the pose '{pose_name}'"
    if low <= 0 <= high or low >= high:
        return 0.0, "belongs to no leg; its zero"
    return round((low + high) / 2, 6), "belongs to no leg; the middle of its limits"
