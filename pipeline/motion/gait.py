"""Alternating tripod gait at constant body velocity on horizontal ground.

Each set of legs supports for half a period while the other set swings. Relative to the body a
supporting foot moves backwards at walking speed; a swinging foot comes back along a named shape
(`pipeline.motion.transfer_path`) whose velocity relative to the ground vanishes at lift-off and
touch-down. Section II.B and Table II of the paper.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import GaitError
from pipeline.motion.motion import Motion, Segment
from pipeline.motion.transfer_path import transfer_path
from pipeline.robot.inverse_kinematics import solve_positions, solve_rates
from pipeline.robot.robot import Robot
from pipeline.robot.start_posture import neutral_postures

Array = NDArray[np.float64]
DEFAULT_SAMPLES = 751  # per segment: one every 2 ms at the paper's period


def tripod_gait(robot: Robot, *, samples: int = DEFAULT_SAMPLES) -> Motion:
    """One period of the robot file's gait.

    Args:
        robot: A robot whose file names two sets of legs.
        samples: Per segment, ends included.

    Returns:
        Two closed segments; in the first, from t = 0, the first set supports.

    Raises:
        GaitError: The numbers contradict each other, or the sets do not part the legs in two.
        OutOfReachError: A foot target lies outside a leg's reach.
        InvalidMotionError: No samples.
    """
    spec = robot.spec
    p = spec.parameters
    period, stroke, lift, speed = (
        p["gait_period"],
        p["foot_stroke"],
        p["foot_lift"],
        p["walking_speed"],
    )
    if samples < 2:
        raise GaitError(f"{samples} samples per segment; at least 2 are needed")
    if len(spec.tripods) != 2 or sorted([*spec.tripods[0], *spec.tripods[-1]]) != sorted(
        robot.leg_names
    ):
        raise GaitError(
            f"{spec.path}: gait.tripods must part the legs {', '.join(robot.leg_names)} in two sets"
        )
    if abs(speed * period / 2 - stroke) > 1e-6 * stroke:
        raise GaitError(
            f"{spec.path}: at {speed:.4g} m/s a foot on the ground moves "
            f"{speed * period / 2:.4g} m in half a period of {period:.4g} s, "
            f"but foot_stroke is {stroke:.4g} m; change one"
        )
    path = transfer_path(spec.transfer_path)
    half = period / 2
    phase = np.linspace(0.0, 1.0, samples)
    neutral = np.array([leg.neutral_foot for leg in spec.legs])  # (L, 3)
    start = neutral_postures(robot)
    segments = []
    for k, stance in enumerate(spec.tripods):
        position = np.repeat(neutral[None], samples, axis=0)
        velocity = np.zeros_like(position)
        acceleration = np.zeros_like(position)
        advance, advance_1, advance_2 = path.advance(phase)
        height, height_1, height_2 = path.lift(phase)
        # Over ground a swinging foot covers the stroke of its own and that of the body.
        over_ground = 2 * stroke
        for i, leg in enumerate(robot.leg_names):
            if leg in stance:
                position[:, i, 0] += stroke * (0.5 - phase)
                velocity[:, i, 0] = -speed
            else:
                position[:, i, 0] += -stroke / 2 + over_ground * advance - stroke * phase
                velocity[:, i, 0] = over_ground * advance_1 / half - speed
                acceleration[:, i, 0] = over_ground * advance_2 / half**2
                position[:, i, 2] += lift * height
                velocity[:, i, 2] = lift * height_1 / half
                acceleration[:, i, 2] = lift * height_2 / half**2
        time = k * half + half * phase
        q = solve_positions(robot.chains, position, start, time)
        _within_limits(robot, q, time)
        q_dot, q_ddot = solve_rates(robot.chains, q, velocity, acceleration, time, position)
        base = np.zeros((samples, 3))
        base[:, 0] = speed * time
        base_velocity = np.zeros((samples, 3))
        base_velocity[:, 0] = speed
        segments.append(
            Segment(
                name="support of " + ", ".join(stance),
                time=time,
                configuration=robot.configuration(robot.joint_positions(q), base),
                velocity=robot.tangent(robot.joint_rates(q_dot), base_velocity),
                acceleration=robot.tangent(robot.joint_rates(q_ddot)),
                stance=stance,
                foot_target=position,
            )
        )
    return Motion(tuple(segments), period)


def standing_posture(robot: Robot, feet: tuple[str, ...] | None = None) -> Segment:
    """Standing still with every foot at mid-stroke; legs that do not stand are lifted.

    The lifted ones hold the middle of their transfer, as if the gait had stopped at mid-support
    (section II.C of the paper).

    Args:
        robot: The robot.
        feet: Legs that stand; the robot file's by default.

    Raises:
        OutOfReachError: A foot target lies outside a leg's reach.
        GaitError: Fewer than three feet stand, or a joint's limits forbid it.
    """
    spec = robot.spec
    stance = spec.standing_feet if feet is None else feet
    if len(stance) < 3:
        raise GaitError(
            f"{spec.path}: standing.feet: the robot stands on {len(stance)} feet; a statically "
            "stable stance needs at least 3"
        )
    target = np.array([leg.neutral_foot for leg in spec.legs])[None]
    for i, leg in enumerate(robot.leg_names):
        if leg not in stance:
            target[:, i, 2] += spec.parameters["foot_lift"]
    time = np.zeros(1)
    q = solve_positions(robot.chains, target, neutral_postures(robot), time)
    _within_limits(robot, q, time)
    still = robot.tangent(np.zeros((1, len(robot.joints))))
    return Segment(
        name="standing on " + ", ".join(stance),
        time=time,
        configuration=robot.configuration(robot.joint_positions(q), np.zeros((1, 3))),
        velocity=still,
        acceleration=still,
        stance=stance,
    )


def _within_limits(robot: Robot, q: Array, time: Array) -> None:
    flat = robot.joint_positions(q)
    lower, upper = robot.limits
    beyond = np.maximum(flat - upper, lower - flat)
    if beyond.max() > 1e-9:
        sample, joint = np.unravel_index(int(beyond.argmax()), beyond.shape)
        raise GaitError(
            f"joint '{robot.joints[joint]}' would have to reach "
            f"{np.degrees(flat[sample, joint]):.1f} deg at t = {time[sample]:.4g} s, its "
            f"limits are {np.degrees(lower[joint]):.1f} to {np.degrees(upper[joint]):.1f} deg; "
            "change the stroke, the neutral foot or the limits"
        )
