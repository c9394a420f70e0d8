"""One period of a gait as a motion: body over the ground, legs by inverse kinematics, segments.

A segment ends at every lift-off and touch-down of any leg, so that the same feet stand all along.
"""

from __future__ import annotations

import numpy as np

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.motion.feet import Course, base_motion, support_course, surge, transfer_course
from pipeline.motion.footfall import LEAST_FEET
from pipeline.motion.gait import Gait, gait_of
from pipeline.motion.motion import Motion, Segment
from pipeline.motion.support import Sway, burdens, least_sway
from pipeline.robot.inverse.inverse_kinematics import (
    refuse_beyond_limits,
    solve_positions,
    solve_rates,
    start_postures,
)
from pipeline.robot.robot import Robot

DEFAULT_SAMPLES = 751  # per half period: one every 2 ms at the paper's period
#: However short a segment is, its energy needs that many.
FEWEST_SAMPLES = 25


def walking_motion(robot: Robot, *, samples: int = DEFAULT_SAMPLES) -> Motion:
    """One period of the robot file's gait.

    `samples`: in half a period, ends included; a segment has its share of them, at least
    `FEWEST_SAMPLES` where there are as many. Returns closed segments, one for every set of legs
    that stand, from t = 0.

    Raises:
        LegwattError: The numbers contradict each other, too few feet stand, or no sway keeps the
            margin. A foot target lies outside a leg's reach.
    """
    if samples < 2:
        raise LegwattError(f"{samples} samples per half period; at least 2 are needed")
    gait = gait_of(robot.spec)
    start = start_postures(robot, gait.neutral @ gait.body)
    if gait.margin is None:
        return _motion(robot, gait, start, samples, None)
    sway = least_sway(robot, gait, start, lambda s: _swayed(robot, gait, start, SWAY_SAMPLES, s))
    return _swayed(robot, gait, start, samples, sway)


#: In half a period, while the sway is sought.
SWAY_SAMPLES = 121


def _swayed(robot: Robot, gait: Gait, start: Array, samples: int, sway: Sway) -> Motion:
    """The motion with a sway; an error that legs cannot follow states how far the body sways."""
    try:
        return _motion(robot, gait, start, samples, sway)
    except LegwattError as error:
        path = sway.course(np.linspace(0.0, 1.0, samples)).position
        far = 1e3 * float(np.hypot(path[:, 0], path[:, 1]).max())
        if far < 1:
            raise
        burden = burdens(robot)
        raise type(error)(
            f"{error}; the body sways by {far:.0f} mm to keep its margin"
            + (f": lessen {burden}" if burden else "")
        ) from None


def _motion(robot: Robot, gait: Gait, start: Array, samples: int, sway: Sway | None) -> Motion:
    segments = []
    for begin, end, stance in gait.footfall.stances():
        n = max(round(2 * (end - begin) * (samples - 1)) + 1, min(samples, FEWEST_SAMPLES))
        passed = np.linspace(0.0, 1.0, n)
        time = gait.period * begin + gait.period * (end - begin) * passed
        time[-1] = gait.period * end  # the instant at which the next one starts, to the last bit
        share = begin + (end - begin) * passed
        shift = None if sway is None else sway.course(share)
        if gait.surge:
            along = surge(gait, share)
            shift = along if shift is None else shift + along
        courses = []
        for leg, name in enumerate(gait.legs):
            stood = gait.footfall.stands(name, (begin + end) / 2)
            length = gait.footfall.duty[name] if stood else 1 - gait.footfall.duty[name]
            since = gait.footfall.since(name, begin, stood=stood)
            local = since / length + (end - begin) / length * passed
            courses.append((support_course if stood else transfer_course)(gait, leg, local))
        parts = []
        for field in ("position", "velocity", "acceleration"):
            value = np.stack([getattr(course, field) for course in courses], axis=1)
            if shift is not None:
                value -= getattr(shift, field)[:, None]
            parts.append(value @ gait.body if not np.array_equal(gait.body, np.eye(3)) else value)
        feet = Course(*parts)
        q = solve_positions(robot.chains, feet.position, start, time)
        refuse_beyond_limits(robot, robot.joint_positions(q), time)
        path = feet.velocity, feet.acceleration, time, feet.position
        q_dot, q_ddot = solve_rates(robot.chains, q, *path)
        place, rate, faster = base_motion(gait, time, shift)
        segments.append(
            Segment(
                name="support of " + ", ".join(stance),
                time=time,
                configuration=robot.configuration(robot.joint_positions(q), place),
                velocity=robot.tangent(robot.joint_rates(q_dot), rate),
                acceleration=robot.tangent(robot.joint_rates(q_ddot), faster),
                stance=stance,
                ground_normal=gait.ground.normal,
                foot_target=feet.position,
                rocks=len(stance) < LEAST_FEET,
            )
        )
    return Motion(tuple(segments), gait.period)
