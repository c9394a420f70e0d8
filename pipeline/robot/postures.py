"""The posture that every leg starts from, and limits of joints.

A leg of three joints reaches a point in several postures. Which one is meant stands in the robot
file, as ``start_posture``; zero is taken where it does not.
"""

from __future__ import annotations

import numpy as np

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.robot.inverse_kinematics import ACCEPTED, solve_positions
from pipeline.robot.robot import Robot


def start_postures(robot: Robot, target: Array | None = None) -> Array:
    """Joint positions with every foot at mid-support, each leg on its branch [rad, m], (L, K).

    `target`: feet at mid-support in the base frame [m], shape (L, 3); the neutral feet by default.

    Raises:
        LegwattError: From a leg's ``start_posture`` its neutral foot is not reached, or only beyond
            a joint's limits; a foot of `target` is not reached from there.
    """
    time, neutral = np.zeros(1), np.array([leg.neutral_foot for leg in robot.spec.legs])
    remedy = (
        "state another start_posture, or move the neutral foot; `python -m pipeline init` guesses "
        "both from a URDF"
    )
    try:
        start = solve_positions(robot.chains, neutral[None], robot.start_posture, time)
        refuse_beyond_limits(robot, robot.joint_positions(start), time, remedy)
    except LegwattError as error:
        raise LegwattError(f"{robot.spec.path}: from start_posture, {error}") from None
    if target is None or np.array_equal(target, neutral):
        return np.asarray(start[0])
    return np.asarray(solve_positions(robot.chains, target[None], start[0], time)[0])


def refuse_beyond_limits(
    robot: Robot,
    q: Array,
    time: Array,
    remedy: str = "change the stroke, the neutral foot or the limits",
) -> None:
    """Refuse joint positions outside the URDF's limits.

    `q`: joint positions [rad, m], shape (N, J). `time`: for messages [s], shape (N,).

    Raises:
        LegwattError: One lies beyond; names joint, instant and limits.
    """
    lower, upper = robot.limits
    beyond = np.maximum(q - upper, lower - q)
    if beyond.max() <= ACCEPTED:
        return
    sample, joint = np.unravel_index(int(beyond.argmax()), beyond.shape)
    scale, digits, unit = (1.0, 4, "m") if robot.sliding[joint] else (180 / np.pi, 1, "deg")
    numbers = (q[sample, joint], lower[joint], upper[joint])
    reached, low, high = (f"{scale * float(x):.{digits}f}" for x in numbers)
    raise LegwattError(
        f"joint '{robot.joints[joint]}' would have to reach {reached} {unit} at "
        f"t = {time[sample]:.4g} s, its limits are {low} to {high} {unit}; {remedy}"
    )
