"""Standing still on any set of feet, on any ground, in the posture that ``[gait]`` states."""

from __future__ import annotations

import numpy as np

from pipeline.errors import GaitError
from pipeline.motion.base_motion import base_quaternions
from pipeline.motion.footfall import LEAST_FEET
from pipeline.motion.gait import body_rotation, gait_table, lifts, neutral_feet
from pipeline.motion.ground import Ground
from pipeline.motion.motion import Segment
from pipeline.robot.inverse.start_posture import refuse_beyond_limits, start_postures
from pipeline.robot.inverse_kinematics import solve_positions
from pipeline.robot.robot import Robot


def standing_posture(robot: Robot, feet: tuple[str, ...] | None = None) -> Segment:
    """Standing still with every foot at mid-stroke; legs that do not stand are lifted.

    The lifted ones hold the middle of their transfer, as if the gait had stopped at mid-support
    (section II.C of the paper). Height, shift and tilt of the body and the slope of the ground are
    those of ``[gait]``.

    `feet`: legs that stand; the robot file's by default.

    Raises:
        OutOfReachError: A foot target lies outside a leg's reach.
        GaitError: Fewer than three feet stand, or a joint's limits forbid it.
    """
    spec = robot.spec
    stance = spec.standing_feet if feet is None else feet
    if len(stance) < LEAST_FEET:
        raise GaitError(
            f"{spec.path}: standing.feet: the robot stands on {len(stance)} feet; a statically "
            f"stable stance needs at least {LEAST_FEET}"
        )
    table = gait_table(spec)
    ground, body = Ground(table.slope_forward, table.slope_left), body_rotation(table)
    target = neutral_feet(table, spec)
    start = start_postures(robot, target @ body)
    lifted = [i for i, leg in enumerate(robot.leg_names) if leg not in stance]
    if lifted:
        target[lifted, 2] += lifts(table, spec)[lifted]
    time = np.zeros(1)
    in_base = (target @ body)[None]
    q = solve_positions(robot.chains, in_base, start, time)
    refuse_beyond_limits(robot, robot.joint_positions(q), time)
    still = robot.tangent(np.zeros((1, len(robot.joints))))
    base = np.hstack([np.zeros((1, 3)), base_quaternions(ground, body, time)])
    return Segment(
        name="standing on " + ", ".join(stance),
        time=time,
        configuration=robot.configuration(robot.joint_positions(q), base),
        velocity=still,
        acceleration=still,
        stance=stance,
        ground_normal=ground.normal,
        foot_target=in_base,
    )
