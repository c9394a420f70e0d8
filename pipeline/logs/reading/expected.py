"""What a log of this robot must look like: joint and foot names, ranges, gear ratios."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

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
    **more: Any,
) -> Expected:
    """Names and limits of a Pinocchio model.

    Args:
        model: With fixed or floating base.
        name: The robot's name, for messages.
        joints: Columns wanted, in order; all actuated joints of the model by default.
        ratio: Motor angle per joint angle, shape (J,).
        **more: Further attributes.

    Raises:
        WrongRobotError: A joint is not in the model.
    """
    # The free flyer has six.
    actuated = [str(n) for i, n in enumerate(model.names) if i > 0 and model.joints[i].nv == 1]
    wanted = tuple(joints) if joints is not None else tuple(actuated)
    for joint in wanted:
        if joint not in actuated:
            raise WrongRobotError(
                f"{name}: joint '{joint}' is not in the URDF; {closest(joint, actuated)}"
            )
    found = [model.joints[model.getJointId(joint)] for joint in wanted]
    bounded = np.array([joint.nq == 1 for joint in found])  # a continuous one is cosine and sine
    place, speed = [joint.idx_q for joint in found], [joint.idx_v for joint in found]
    lower = np.where(bounded, model.lowerPositionLimit[place], -np.inf)
    upper = np.where(bounded, model.upperPositionLimit[place], np.inf)
    none = lower >= upper
    return Expected(
        robot=name,
        joints=wanted,
        lower=np.where(none, -np.inf, _limits(lower, missing_at_zero=False)),
        upper=np.where(none, np.inf, _limits(upper, missing_at_zero=False)),
        velocity_limit=_limits(model.velocityLimit[speed], missing_at_zero=True),
        effort_limit=_limits(model.effortLimit[speed], missing_at_zero=True),
        ratio=None if ratio is None else np.asarray(ratio, dtype=np.float64),
        **more,
    )


def expected_of_robot(robot: Robot, *, ratio: Array | None = None) -> Expected:
    """Names and limits of a robot file; a foot goes by its leg's or its frame's name."""
    gravity = float(np.linalg.norm(robot.model.gravity.linear))
    return expected_of_model(
        robot.model,
        robot.spec.name,
        joints=robot.joints,
        ratio=ratio,
        feet=robot.leg_names,
        foot_alias={leg.foot: leg.name for leg in robot.spec.legs},
        weight=gravity * float(pin.computeTotalMass(robot.model)) if robot.floating else None,
    )
