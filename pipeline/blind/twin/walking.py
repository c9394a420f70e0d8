"""What the twin's hexapod is told to do: stand, walk its tripod gait, stop."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.blind.twin.controller import Plan
from pipeline.blind.twin.errors import TwinError
from pipeline.blind.twin.trajectories import CONTROL_PERIOD, at_phase, smooth_step
from pipeline.dynamics.joint_demand import motion_demand, segment_demand
from pipeline.motion.motion import Segment
from pipeline.motion.standing import standing_posture
from pipeline.motion.walking import walking_motion
from pipeline.robot.kinematics import foot_force_torques
from pipeline.robot.robot import Robot

Array = NDArray[np.float64]
#: Share of a half period over which the prepared torques pass from one set of legs to the other.
_HANDOVER = 0.12
_SAMPLES = 751


def walking_plan(
    robot: Robot,
    *,
    periods: tuple[float, ...] = (3.0, 4.5),
    settle: float = 0.6,
    squeeze: float = 0.0,
) -> Plan:
    """Settle on all feet, then one cycle per entry of `periods`, then stop.

    Args:
        robot: Floating base, two sets of legs.
        periods: Duration of each cycle [s].
        settle: Time to come to rest before the first step [s].
        squeeze: Lateral force with which the standing feet of either side push inward [N], on top
            of the least tangential forces; negative outward.

    Returns:
        The plan; its feed-forward torques carry the weight (quasi-static inverse dynamics of the
        nominal robot).

    Raises:
        TwinError: A fixed base.
    """
    if not robot.floating:
        raise TwinError(f"robot '{robot.spec.name}' has a fixed base and cannot walk")
    dt = CONTROL_PERIOD
    motion = walking_motion(robot, samples=_SAMPLES)
    demand = motion_demand(robot, motion, quasi_static=True)
    table = np.concatenate([demand.segments[0].position, demand.segments[1].position[1:]])
    first, second = (d.torque.copy() for d in demand.segments)
    if squeeze:
        for torque, segment in zip((first, second), motion.segments, strict=True):
            torque += squeeze_torque(robot, segment.configuration, segment.stance, squeeze)
    phase = _phase(periods, dt)
    torque = _handed_over(first, second, phase)
    rest = np.repeat(table[:1], round(settle / dt), axis=0)
    # All six feet stand while the robot settles.
    start = motion.segments[0]
    standing = Segment(
        name="standing before the first step",
        time=start.time[:1],
        configuration=start.configuration[:1],
        velocity=np.zeros_like(start.velocity[:1]),
        acceleration=np.zeros_like(start.acceleration[:1]),
        stance=robot.leg_names,
    )
    rest_torque = segment_demand(robot, standing, quasi_static=True)[0].torque
    rest_torque = np.repeat(rest_torque, rest.shape[0], axis=0)
    position = np.concatenate([rest, at_phase(table, phase)])
    return Plan(
        period=dt,
        position=position,
        velocity=np.gradient(position, dt, axis=0),
        feedforward=np.concatenate([rest_torque, torque]),
        log_from=0.7 * settle,
        base_position=np.array([0.0, 0.0, robot.spec.parameters["body_height"]]),
        cycles=periods,
    )


def standing_plan(robot: Robot, feet: tuple[str, ...] | None = None, duration: float = 2.0) -> Plan:
    """Stand on some feet, the others lifted, with torques that carry the weight.

    Args:
        robot: Floating base.
        feet: Legs that stand; the robot file's by default.
        duration: [s].
    """
    demand = segment_demand(robot, standing_posture(robot, feet), quasi_static=True)[0]
    n = round(duration / CONTROL_PERIOD) + 1
    position = np.repeat(demand.position, n, axis=0)
    return Plan(
        period=CONTROL_PERIOD,
        position=position,
        velocity=np.zeros_like(position),
        feedforward=np.repeat(demand.torque, n, axis=0),
        log_from=0.0,
        base_position=np.array([0.0, 0.0, robot.spec.parameters["body_height"]]),
    )


def _phase(periods: tuple[float, ...], dt: float) -> Array:
    # One cycle per entry; the rate passes smoothly from one cycle to the next and to rest.
    ramp = 0.4
    total = sum(periods) + ramp
    t = np.arange(round(total / dt)) * dt
    rate = np.zeros(t.size)
    start = 0.0
    for period in periods:
        end = start + period
        rise, fall = smooth_step((t - start) / ramp), smooth_step((t - end) / ramp)
        rate += (rise - fall) / period
        start = end
    phase = np.cumsum(rate) * dt
    result: Array = phase * (len(periods) / phase[-1])
    return result


def _handed_over(first: Array, second: Array, phase: Array) -> Array:
    """Prepared torques along the phase, blended where the support changes."""
    # Each table is read at its own half of the cycle and held at its ends.
    s = np.mod(phase, 1.0) * 2
    n = first.shape[0] - 1
    a = first[np.rint(np.clip(s, 0, 1) * n).astype(np.intp)]
    b = second[np.rint(np.clip(s - 1, 0, 1) * n).astype(np.intp)]
    b_before = second[-1]  # the end of the cycle before, while the first set takes over
    weight_b = smooth_step((s - 1) / _HANDOVER + 0.5)
    weight_back = smooth_step(s / _HANDOVER + 0.5)  # start of a cycle
    weight_end = smooth_step((s - 2) / _HANDOVER + 0.5)  # end of a cycle
    torque = (1 - weight_b)[:, None] * a + weight_b[:, None] * b
    torque = weight_back[:, None] * torque + (1 - weight_back)[:, None] * b_before
    result: Array = (1 - weight_end)[:, None] * torque + weight_end[:, None] * first[0]
    return result


def squeeze_torque(
    robot: Robot, configuration: Array, stance: tuple[str, ...], force: float
) -> Array:
    """Joint torques with which the standing feet push inward, so that the ground pushes outward.

    The lateral forces sum to nothing over the stance and are zero for legs in the air.
    """
    q = robot.leg_positions(configuration)
    push = np.zeros((q.shape[0], len(robot.leg_names), 3))
    sides = [1.0 if leg.side == "left" else -1.0 for leg in robot.spec.legs]
    members = [i for i, name in enumerate(robot.leg_names) if name in stance]
    for side in (1.0, -1.0):
        same = [i for i in members if sides[i] == side]
        for i in same:
            push[:, i, 1] = side * force / len(same)
    torque = -foot_force_torques(robot.chains, q, push)
    return robot.layout.by_joint(torque)
