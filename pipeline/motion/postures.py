"""Where every inverse kinematics starts, and the limits that every posture keeps."""

from __future__ import annotations

import numpy as np

from actuators.arrays import Array
from pipeline.errors import GaitError
from pipeline.robot.inverse.start_posture import neutral_postures
from pipeline.robot.inverse_kinematics import solve_positions
from pipeline.robot.robot import Robot


def start_postures(robot: Robot, target: Array) -> Array:
    """Joint positions with every foot at mid-support, each leg on its own branch [rad], (L, 3).

    `target`: feet at mid-support in the base frame [m], shape (L, 3).

    Raises:
        OutOfReachError: A foot is not reached.
        GaitError: Only on another branch than the robot file names.
    """
    start = neutral_postures(robot)
    if np.array_equal(target, [leg.neutral_foot for leg in robot.spec.legs]):
        return start
    q: Array = solve_positions(robot.chains, target[None], start, np.zeros(1))[0]
    return q


def refuse_beyond_limits(
    robot: Robot,
    q: Array,
    time: Array,
    remedy: str = "change the stroke, the neutral foot or the limits",
) -> None:
    """Refuse joint positions outside the URDF's limits.

    `q`: joint positions [rad, m], shape (N, J). `time`: for messages [s], shape (N,).

    Raises:
        GaitError: One lies beyond; names joint, instant and limits.
    """
    lower, upper = robot.limits
    beyond = np.maximum(q - upper, lower - q)
    if beyond.max() <= 1e-9:
        return
    sample, joint = np.unravel_index(int(beyond.argmax()), beyond.shape)
    scale, digits, unit = (1.0, 4, "m") if robot.sliding[joint] else (180 / np.pi, 1, "deg")
    there, low, high = (
        f"{scale * float(x):.{digits}f}" for x in (q[sample, joint], lower[joint], upper[joint])
    )
    raise GaitError(
        f"joint '{robot.joints[joint]}' would have to reach {there} {unit} at "
        f"t = {time[sample]:.4g} s, its limits are {low} to {high} {unit}; {remedy}"
    )
