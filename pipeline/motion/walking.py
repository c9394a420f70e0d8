"""One period of a gait as a motion: body over the ground, legs by inverse kinematics, segments.

A segment ends at every lift-off and touch-down of any leg, so that the same feet stand all along.
"""

from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.motion.feet import base_motion, foot_course, surge
from pipeline.motion.footfall import LEAST_FEET
from pipeline.motion.gait import Gait, gait_of
from pipeline.motion.motion import Motion, Segment
from pipeline.motion.support import Sway, least_sway
from pipeline.robot.inverse_kinematics import (
    refuse_beyond_limits,
    solve_positions,
    solve_rates,
    start_postures,
)
from pipeline.robot.robot import Robot

DEFAULT_SAMPLES: Final = 751  # per half period: one every 2 ms at the paper's period
#: However short a segment is, its energy needs that many.
FEWEST_SAMPLES: Final = 25
#: In half a period, while the sway is sought.
SWAY_SAMPLES: Final = 121


def walking_motion(robot: Robot, *, samples: int = DEFAULT_SAMPLES, swayed: bool = True) -> Motion:
    """One period of the robot file's gait.

    `samples`: in half a period, ends included, 2 at least; a segment has its share of them, and
    `FEWEST_SAMPLES` where there are as many. `swayed`: False for a body that does not sway to keep
    the margin, which takes a fraction of the time. Returns closed segments, one for every set of
    legs that stand, from t = 0.

    Raises:
        LegwattError: The numbers contradict each other, too few feet stand, or no sway keeps the
            margin. A foot target lies outside a leg's reach.
    """
    gait = gait_of(robot.spec)
    start = start_postures(robot, gait.neutral @ gait.table.body)
    if gait.margin is None or not swayed:
        return _motion(robot, gait, start, samples, None)
    sway = least_sway(robot, gait, start, lambda s: _motion(robot, gait, start, SWAY_SAMPLES, s))
    return _motion(robot, gait, start, samples, sway)


def _motion(robot: Robot, gait: Gait, start: Array, samples: int, sway: Sway | None) -> Motion:
    segments, body, normal = [], gait.table.body, gait.table.ground[:, 2].copy()
    for begin, end, stance in gait.footfall.stances():
        n = max(round(2 * (end - begin) * (samples - 1)) + 1, min(samples, FEWEST_SAMPLES))
        passed = np.linspace(0.0, 1.0, n)
        time = gait.period * begin + gait.period * (end - begin) * passed
        time[-1] = gait.period * end  # the instant at which the next one starts, to the last bit
        share = begin + (end - begin) * passed
        shift = surge(gait, share)
        if sway is not None:
            shift = shift + sway.course(share)
        courses = []
        for leg, name in enumerate(gait.legs):
            stands = name in stance
            length = gait.footfall.duty if stands else 1 - gait.footfall.duty
            since = gait.footfall.since(name, begin, stood=stands)
            local = (since + (end - begin) * passed) / length
            courses.append(foot_course(gait, leg, local, stands=stands))
        # From the unswayed body, axes along the ground, to the base and its axes: (3, N, L, 3).
        feet, rate, rate_2 = (np.stack(courses, axis=2) - shift[:, :, None]) @ body
        q = solve_positions(robot.chains, feet, start, time)
        refuse_beyond_limits(robot, robot.joint_positions(q), time)
        q_dot, q_ddot = solve_rates(robot.chains, q, rate, rate_2, time)
        place, velocity, acceleration = base_motion(gait, time, shift)
        segments.append(
            Segment(
                name="support of " + ", ".join(stance),
                time=time,
                configuration=robot.configuration(robot.joint_positions(q), place),
                velocity=robot.tangent(robot.chains.by_joint(q_dot), velocity),
                acceleration=robot.tangent(robot.chains.by_joint(q_ddot), acceleration),
                stance=stance,
                ground_normal=normal,
                foot_target=feet,
                rocks=len(stance) < LEAST_FEET,
            )
        )
    return Motion(tuple(segments))
