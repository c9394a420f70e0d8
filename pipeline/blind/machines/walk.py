"""The walking hexapod of the own source: its planned gait at two paces, and torque along it."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Final

import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicHermiteSpline

from actuators.arrays import Array
from pipeline.blind.machines.chains import Machine
from pipeline.blind.machines.motions import Course
from pipeline.dynamics.joint_demand import segment_demand
from pipeline.motion.motion import Segment
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file

FOLDER: Final = Path(__file__).parents[3] / "urdf"


def draw_walker() -> Machine:
    """The hexapod of the robot file; what is drawn of it are its true bodies and its pace."""
    robot = load_robot(load_robot_file(FOLDER / "hexapod.toml"))
    model = robot.model
    links = []
    for joint in robot.joints:
        index = model.getJointId(joint)
        own = (f for f in model.frames if f.parentJoint == index and f.type == pin.BODY)
        links.append(str(next(own).name))
    n = len(robot.joints)
    length = np.full(n, 0.3)
    return Machine("walk", "", model, tuple(robot.joints), tuple(links), np.ones(n), length, robot)


def gait_course(robot: Robot, periods: tuple[float, ...], dt: float) -> Course:
    """Cycles of the robot file's gait, each at a period of its own [s].

    Within a cycle time runs evenly, so that rows between two supports are whole segments of the
    motion; from one cycle to the next the pace jumps, as where a log is stopped and begun anew.
    """
    cycle = walking_motion(robot)
    index, rate = robot.position_index, robot.velocity_index
    total = float(cycle.segments[-1].time[-1])
    parts: list[tuple[Array, ...]] = []
    stances: list[tuple[str, ...]] = []
    begin = 0.0
    for period in periods:
        pace = total / period
        t = np.arange(round(period / dt)) * dt * pace
        for segment in cycle.segments:
            own = t[(t >= segment.time[0]) & (t < segment.time[-1])]
            spline = CubicHermiteSpline(
                segment.time, segment.configuration[:, index], segment.velocity[:, rate]
            )
            base = CubicHermiteSpline(
                segment.time, segment.configuration[:, :3], segment.velocity[:, :3]
            )
            turn = np.repeat(segment.configuration[:1, 3:7], own.size, axis=0)
            spin = np.zeros((own.size, 3))
            parts.append(
                (
                    begin + own / pace,
                    spline(own),
                    spline(own, 1) * pace,
                    _between(segment.time, segment.acceleration[:, rate], own) * pace**2,
                    np.hstack([base(own), turn]),
                    np.hstack([base(own, 1) * pace, spin]),
                    np.hstack(
                        [_between(segment.time, segment.acceleration[:, :3], own) * pace**2, spin]
                    ),
                )
            )
            stances += [segment.stance] * own.size
        begin += round(period / dt) * dt
    time, q, v, a, *body = (np.concatenate(p) for p in zip(*parts, strict=True))
    return Course(time, q, v, a, (body[0], body[1], body[2]), tuple(stances))


def _between(time: Array, values: Array, at: Array) -> Array:
    return np.stack([np.interp(at, time, column) for column in values.T], axis=1)


def walking_torque(robot: Robot, model: pin.Model, course: Course) -> tuple[Array, Array]:
    """Torque of the joints and normal forces of the feet, (N, J) [N*m] and (N, L) [N].

    The ground carries the true bodies with the least tangential forces.
    """
    assert course.body is not None
    other = replace(robot, model=model)
    index, rate = robot.position_index, robot.velocity_index
    q = np.zeros((course.time.size, model.nq))
    v, a = (np.zeros((course.time.size, model.nv)) for _ in range(2))
    q[:, :7], v[:, :6], a[:, :6] = course.body
    q[:, index], v[:, rate], a[:, rate] = course.q, course.v, course.a
    torque = np.empty_like(course.q)
    feet = np.zeros((course.time.size, len(robot.leg_names)))
    begin = 0
    for stance, rows in groupby(course.stances):
        end = begin + len(list(rows))
        own = slice(begin, end)
        segment = Segment("walk", course.time[own], q[own], v[own], a[own], stance)
        demand, contacts = segment_demand(other, segment)
        assert contacts is not None
        torque[own], feet[own] = demand.torque, contacts.normal_force
        begin = end
    return torque, feet
