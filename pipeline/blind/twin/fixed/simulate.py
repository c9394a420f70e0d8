"""From what the links do to what the motors give: the inverse of the machine as it truly is.

    t_link = ID(q, v, a) of the true bodies
    t      = t_link - extra torques on the joint, passed by the gear
    theta  = q + t / k + (w / 2) s, with s following sgn(t) across the play
    motor  = t + friction(d theta/dt, t) + J d2 theta/dt2

Friction may feel another joint's speed, too, where one motor turns with both.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.blind.twin.fixed.motions import Course
from pipeline.blind.twin.laws.bristle import BristleFriction, BristleLaw
from pipeline.blind.twin.laws.extra import ExtraTorque

Array = NDArray[np.float64]
#: Time a motor takes to cross its play [s].
_CROSSING = 4e-3


@dataclass(frozen=True)
class Truth:
    """The machine as it is; arrays of shape (J,), referred to the joint.

    Attributes:
        model: Bodies and gravity.
        friction: At every joint.
        compliance: Of the gears [rad/(N*m)].
        play: Whole width [rad].
        inertia: Of the rotors, as far as the URDF lacks it [kg*m^2].
        coupling: Motor speeds over joint speeds, shape (J, J); its friction acts on both.
        extra: Further torques on joints.
        rings: Joint to amplitude [N*m] and frequency [Hz] of a knock at every change of flanks.
    """

    model: pin.Model
    friction: BristleLaw
    compliance: Array
    play: Array
    inertia: Array
    coupling: Array
    extra: tuple[ExtraTorque, ...] = ()
    rings: dict[int, tuple[float, float]] = field(default_factory=dict)

    def with_friction(self, joint: int, **values: float) -> Truth:
        """The same with numbers of one joint's friction replaced."""
        changed = {}
        for name, value in values.items():
            array = getattr(self.friction, name).copy()
            array[joint] = value
            changed[name] = array
        return replace(self, friction=replace(self.friction, **changed))


def rigid_truth(model: pin.Model) -> Truth:
    """Bodies alone."""
    n = model.nv
    none = np.zeros(n)
    return Truth(model, BristleLaw.none(n), none, none.copy(), none.copy(), np.eye(n))


@dataclass(frozen=True)
class Happened:
    """What truly happened.

    Attributes:
        course: Of the links.
        motor: Angle of the motors at the joint's side, shape (N, J) [rad].
        torque: Of the motors at the joint's side, shape (N, J) [N*m].
    """

    course: Course
    motor: Array
    torque: Array


def simulate(truth: Truth, course: Course) -> Happened:
    """Run the inverse along a course."""
    passed = link_torque(truth.model, course) - _extra(truth, course)
    flank = _flank(passed, truth, course.dt)
    motor = course.q + truth.compliance * passed + 0.5 * truth.play * flank
    parted = bool((truth.compliance > 0).any() or (truth.play > 0).any())
    speed = np.gradient(motor, course.dt, axis=0) if parted else course.v
    turned = speed @ truth.coupling.T
    drag = _friction(truth, turned, passed, course.dt)
    rate = np.gradient(speed, course.dt, axis=0) if parted else course.a
    torque = passed + drag @ truth.coupling + truth.inertia * rate
    for j, (size, frequency) in truth.rings.items():
        torque[:, j] += _rings(passed[:, j], size, frequency, course.dt)
    return Happened(course, motor, torque)


def link_torque(model: pin.Model, course: Course) -> Array:
    """Inverse dynamics of the bodies along a course, shape (N, J) [N*m]."""
    data = model.createData()
    rows = zip(course.q, course.v, course.a, strict=True)
    return np.array([pin.rnea(model, data, q, v, a).copy() for q, v, a in rows])


def _extra(truth: Truth, course: Course) -> Array:
    out = np.zeros_like(course.q)
    for law in truth.extra:
        stepper, j = law.start(course.dt), law.joint
        rows = zip(course.q[:, j].tolist(), course.v[:, j].tolist(), strict=True)
        out[:, j] += [stepper.torque(q, v) for q, v in rows]
    return out


def _flank(passed: Array, truth: Truth, dt: float) -> Array:
    """Which flank carries, -1 to 1, shape (N, J)."""
    side = np.sign(passed)
    if not (truth.play > 0).any():
        return np.zeros_like(passed)
    blend, out, now = 1.0 - np.exp(-dt / _CROSSING), np.empty_like(side), side[0]
    for k, row in enumerate(side):
        now = now + blend * (row - now)
        out[k] = now
    return out


def _friction(truth: Truth, speed: Array, load: Array, dt: float) -> Array:
    if not any(
        getattr(truth.friction, name).any()
        for name in ("coulomb", "excess", "viscous", "load_driving", "load_driven", "asymmetry")
    ):
        return np.zeros_like(speed)
    friction = BristleFriction(truth.friction, dt)
    return np.array([friction.torque(v, t) for v, t in zip(speed, load, strict=True)])


def _rings(passed: Array, size: float, frequency: float, dt: float) -> Array:
    """A knock that rings down within some periods at every change of flanks, shape (N,)."""
    t = np.arange(round(6.0 / frequency / dt)) * dt
    knock = size * np.exp(-0.6 * frequency * t) * np.sin(2 * np.pi * frequency * t)
    change = np.zeros_like(passed)
    change[1:] = 0.5 * np.diff(np.sign(passed))
    return np.convolve(change, knock)[: passed.size]
