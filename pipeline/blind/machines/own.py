"""Own source: from what the links do to what the motors give, the inverse of the true machine.

    t_link = ID(q, v, a) of the true bodies, less what the ground carries
    t      = t_link - extra torques on the joint, passed by the gear
    theta  = q + t / k + (w / 2) s, with s following sgn(t) smoothly across the play
    motor  = t + C^T friction(C d theta/dt, t) + J d2 theta/dt2

Links move as planned: no controller is needed, and a trial takes a second.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from pipeline.blind.machines.chains import Machine
from pipeline.blind.machines.laws import bristles
from pipeline.blind.machines.motions import Course
from pipeline.blind.machines.plant import Happened, Plant
from pipeline.blind.machines.walk import walking_torque

#: Time a motor takes to cross its play [s].
_CROSSING = 2e-2


def run(machine: Machine, plant: Plant, course: Course) -> Happened:
    """Run the inverse along a course."""
    link, feet = link_torque(machine, plant.model, course)
    passed = link - _extra(plant, course)
    motor = course.q + plant.compliance * passed + 0.5 * plant.play * _flank(plant, passed, course)
    parted = bool(plant.parted.any())
    speed = np.gradient(motor, course.dt, axis=0) if parted else course.v
    rate = np.gradient(speed, course.dt, axis=0) if parted else course.a
    turned = speed @ plant.coupling.T
    drag = bristles(plant.friction, course.time, course.q, turned, passed)
    torque = passed + drag @ plant.coupling + plant.inertia * rate
    return Happened(course, motor, torque, feet)


def link_torque(machine: Machine, model: pin.Model, course: Course) -> tuple[Array, Array | None]:
    """Torque that bodies ask of the joints along a course (N, J) [N*m], and the feet's forces."""
    if machine.robot is not None:
        return walking_torque(machine.robot, model, course)
    data = model.createData()
    rows = zip(course.q, course.v, course.a, strict=True)
    return np.array([pin.rnea(model, data, *row).copy() for row in rows]), None


def _extra(plant: Plant, course: Course) -> Array:
    out = np.zeros_like(course.q)
    for j, begin in plant.extra:
        law = begin(course.dt)
        rows = np.stack([course.time, course.q[:, j], course.v[:, j]], axis=1).tolist()
        out[:, j] += [law(*row) for row in rows]
    return out


def _flank(plant: Plant, passed: Array, course: Course) -> Array:
    """Which flank carries, -1 to 1, shape (N, J)."""
    if not (plant.play > 0).any():
        return np.zeros_like(passed)
    width = 2 * round(0.5 * _CROSSING / course.dt) + 1
    window = np.hanning(width + 2)[1:-1]
    half = width // 2
    return np.stack(
        [
            np.convolve(np.pad(side, half, mode="edge"), window / window.sum(), mode="valid")
            for side in np.sign(passed).T
        ],
        axis=1,
    )
