"""What a log of this robot must look like: joint and foot names, ranges, gear ratios."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from actuators.errors import closest
from pipeline.logs.errors import WrongRobotError
from pipeline.robot.robot import Robot


@dataclass(frozen=True)
class Expected:
    """Names and limits against which a log is read."""

    robot: str  #: The robot's name, for messages.
    joints: tuple[str, ...]  #: In the order of the columns.
    lower: Array  #: Position limits, -inf where there is none, shape (J,) [rad].
    upper: Array  #: Position limits, inf where there is none, shape (J,) [rad].
    velocity_limit: Array  #: inf where there is none, shape (J,) [rad/s].
    effort_limit: Array  #: Joint torque, inf where there is none, shape (J,) [N*m].
    feet: tuple[str, ...] = ()  #: Names of legs in order.
    #: Other names of the same feet (their frames) to the leg's name.
    foot_alias: Mapping[str, str] = field(default_factory=dict)
    #: Motor angle per joint angle, signed, shape (J,); None where it is not known.
    ratio: Array | None = None
    #: What the feet carry [N]; None for a robot that does not stand on its feet.
    weight: float | None = None


def _limits(values: Array, *, missing_at_zero: bool) -> Array:
    # Pinocchio writes "no limit" as the largest double, and URDFs often as zero.
    out = np.where(np.abs(values) > 1e100, np.copysign(np.inf, values), values)
    return np.where(out == 0, np.inf, out) if missing_at_zero else out


def expected_of_model(
    model: pin.Model,
    name: str,
    *,
    joints: Sequence[str] | None = None,
    ratio: Array | None = None,
    feet: Sequence[str] = (),
    foot_alias: Mapping[str, str] | None = None,
) -> Expected:
    """Names and limits of a Pinocchio model.

    Args:
        model: With fixed or floating base.
        name: The robot's name, for messages.
        joints: Columns wanted, in order; all actuated joints of the model by default.
        ratio: Motor angle per joint angle, shape (J,).
        feet: Names of legs.
        foot_alias: Further names of feet.

    Raises:
        WrongRobotError: A joint is not in the model.
    """
    actuated = [
        str(n) for i, n in enumerate(model.names) if i > 0 and model.joints[i].nv == 1
    ]  # the free flyer has six
    wanted = tuple(joints) if joints is not None else tuple(actuated)
    for joint in wanted:
        if joint not in actuated:
            raise WrongRobotError(
                f"{name}: joint '{joint}' is not in the URDF; {closest(joint, actuated)}"
            )
    indexes = [model.getJointId(joint) for joint in wanted]
    lower, upper = np.full(len(wanted), -np.inf), np.full(len(wanted), np.inf)
    for k, i in enumerate(indexes):
        joint = model.joints[i]
        if joint.nq == 1:  # a continuous joint is written as cosine and sine
            lower[k] = model.lowerPositionLimit[joint.idx_q]
            upper[k] = model.upperPositionLimit[joint.idx_q]
    none = lower >= upper
    velocity = np.array([model.velocityLimit[model.joints[i].idx_v] for i in indexes])
    effort = np.array([model.effortLimit[model.joints[i].idx_v] for i in indexes])
    return Expected(
        robot=name,
        joints=wanted,
        lower=np.where(none, -np.inf, _limits(lower, missing_at_zero=False)),
        upper=np.where(none, np.inf, _limits(upper, missing_at_zero=False)),
        velocity_limit=_limits(velocity, missing_at_zero=True),
        effort_limit=_limits(effort, missing_at_zero=True),
        feet=tuple(feet),
        foot_alias=dict(foot_alias or {}),
        ratio=None if ratio is None else np.asarray(ratio, dtype=np.float64),
    )


def expected_of_robot(robot: Robot, *, ratio: Array | None = None) -> Expected:
    """Names and limits of a robot file; a foot goes by its leg's or its frame's name."""
    expected = expected_of_model(
        robot.model,
        robot.spec.name,
        joints=robot.joints,
        ratio=ratio,
        feet=robot.leg_names,
        foot_alias={leg.foot: leg.name for leg in robot.spec.legs},
    )
    if not robot.floating:
        return expected
    gravity = float(np.linalg.norm(robot.model.gravity.linear))
    return replace(expected, weight=gravity * float(pin.computeTotalMass(robot.model)))
