"""Own source: from what the links do to what the motors give, the inverse of the true machine.

    t_link = ID(q, v, a) of the true bodies, less what the ground carries
    t      = t_link - extra torques on the joint, passed by the gear
    theta  = q + t / k + (w / 2) s, with s following sgn(t) smoothly across the play
    motor  = t + C^T friction(C d theta/dt, t) + J d2 theta/dt2

Links move as planned: no controller is needed, and a trial takes a second. The walking machine is
the hexapod of the robot file on its gait.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Final

import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicHermiteSpline
from scipy.ndimage import convolve1d

from pipeline.dynamics.joint_demand import segment_demand
from pipeline.motion.motion import Segment
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from tests.blind.machines.machine import Course, Machine
from tests.blind.machines.plant import Array, Plant, bristles

FOLDER: Final = Path(__file__).parents[3] / "urdf"
#: Time a motor takes to cross its play [s].
_CROSSING = 2e-2


def run(machine: Machine, plant: Plant, course: Course) -> Course:
    """Run the inverse along a course."""
    link, feet = link_torque(machine, plant.model, course)
    passed = link.copy()
    for j, begin in plant.extra:
        law = begin(course.dt)
        rows = np.stack([course.time, course.q[:, j], course.v[:, j]], axis=1).tolist()
        passed[:, j] -= [law(*row) for row in rows]
    motor, speed, rate = course.q + plant.compliance * passed, course.v, course.a
    if (plant.play > 0).any():
        window = np.hanning(2 * round(0.5 * _CROSSING / course.dt) + 3)[1:-1]
        flank = convolve1d(np.sign(passed), window / window.sum(), axis=0, mode="nearest")
        motor = motor + 0.5 * plant.play * flank
    if plant.parted.any():
        speed = np.gradient(motor, course.dt, axis=0)
        rate = np.gradient(speed, course.dt, axis=0)
    drag = bristles(plant, course.time, course.q, speed @ plant.coupling.T, passed)
    torque = passed + drag @ plant.coupling + plant.inertia * rate
    return replace(course, motor=motor, torque=torque, feet=feet)


def link_torque(machine: Machine, model: pin.Model, course: Course) -> tuple[Array, Array | None]:
    """Torque that bodies ask of the joints along a course (N, J) [N*m], and the feet's forces."""
    if machine.robot is not None:
        return _walking_torque(machine.robot, model, course)
    data = model.createData()
    rows = zip(course.q, course.v, course.a, strict=True)
    return np.array([pin.rnea(model, data, *row).copy() for row in rows]), None


def draw_walker() -> Machine:
    """The hexapod of the robot file; what is drawn of it are its true bodies and its pace."""
    robot = load_robot(load_robot_file(FOLDER / "hexapod.toml"))
    n = len(robot.joints)
    return Machine("walk", "", robot.model, robot.joints, np.ones(n), np.full(n, 0.3), robot)


def gait_course(robot: Robot, periods: tuple[float, ...], dt: float) -> Course:
    """Cycles of the robot file's gait, each at a period of its own [s].

    Within a cycle time runs evenly, so that rows between two supports are whole segments of the
    motion; from one cycle to the next the pace jumps, as where a log is stopped and begun anew.
    """
    cycle = walking_motion(robot)
    at, rate = (np.append([0, 1, 2], x) for x in (robot.position_index, robot.velocity_index))
    total = float(cycle.segments[-1].time[-1])
    parts: list[tuple[Array, ...]] = []
    stances: list[tuple[str, ...]] = []
    begin = 0.0
    for period in periods:
        pace = total / period
        t = np.arange(round(period / dt)) * dt * pace
        for s in cycle.segments:
            own = t[(t >= s.time[0]) & (t < s.time[-1])]
            spline = CubicHermiteSpline(s.time, s.configuration[:, at], s.velocity[:, rate])
            a = np.stack([np.interp(own, s.time, x) for x in s.acceleration[:, rate].T], axis=1)
            parts.append((begin + own / pace, spline(own), spline(own, 1) * pace, a * pace**2))
            stances += [s.stance] * own.size
        begin += round(period / dt) * dt
    time, q, v, a = (np.concatenate(x) for x in zip(*parts, strict=True))
    body = (q[:, :3], v[:, :3], a[:, :3])
    return Course(time, q[:, 3:], v[:, 3:], a[:, 3:], body=body, stances=tuple(stances))


def _walking_torque(robot: Robot, model: pin.Model, course: Course) -> tuple[Array, Array]:
    """Torque of the joints and normal forces of the feet, (N, J) [N*m] and (N, L) [N].

    The ground carries the true bodies with the least tangential forces.
    """
    assert course.body is not None
    other = replace(robot, model=model)
    index, rate = robot.position_index, robot.velocity_index
    q = np.tile(pin.neutral(model), (course.time.size, 1))
    v, a = (np.zeros((course.time.size, model.nv)) for _ in range(2))
    q[:, :3], v[:, :3], a[:, :3] = course.body
    q[:, index], v[:, rate], a[:, rate] = course.q, course.v, course.a
    torque = np.empty_like(course.q)
    feet = np.zeros((course.time.size, len(robot.leg_names)))
    begin = 0
    for stance, rows in groupby(course.stances):
        own = slice(begin, begin + len(list(rows)))
        segment = Segment("walk", course.time[own], q[own], v[own], a[own], stance)
        demand, contacts = segment_demand(other, segment)
        assert contacts is not None
        torque[own], feet[own] = demand.torque, contacts.normal_force
        begin = own.stop
    return torque, feet
