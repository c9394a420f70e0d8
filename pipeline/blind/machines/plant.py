"""The machine as it truly is, and its sensors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.blind.machines.chains import Machine
from pipeline.blind.machines.laws import Friction, Law
from pipeline.blind.machines.motions import Course

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Plant:
    """A machine as it is; arrays of shape (J,), referred to the joint.

    Attributes:
        model: Bodies and gravity.
        friction: At every joint, on the motor's side of gears that give.
        inertia: Of the rotors, as far as the URDF lacks it [kg*m^2].
        compliance: Of the gears [rad/(N*m)].
        play: Whole width [rad].
        coupling: Motor speeds over joint speeds, shape (J, J); friction and rotors feel both.
        extra: Joint to a law begun for a time step [s].
        gain: By which torques read too much [1].
        offset: Added to torques [N*m].
        zero: Added to positions [rad].
        delay: Of the torques behind the positions [s].
        sides: Where positions are measured: ``"joint"``, ``"motor"`` or ``"both"``.
    """

    model: pin.Model
    friction: Friction
    inertia: Array
    compliance: Array
    play: Array
    coupling: Array
    gain: Array
    offset: Array
    zero: Array
    delay: float = 0.0
    sides: str = "joint"
    extra: tuple[tuple[int, Callable[[float], Law]], ...] = ()

    def at(self, field: str, joint: int, value: float) -> Plant:
        """The same with one number of one joint replaced."""
        changed = getattr(self, field).copy()
        changed[joint] = value
        fields: dict[str, Any] = {field: changed}
        return replace(self, **fields)

    @property
    def parted(self) -> Array:
        """Which joints have a motor that turns apart from its link, shape (J,)."""
        return np.asarray((self.compliance > 0) | (self.play > 0))


def rigid_plant(machine: Machine, model: pin.Model) -> Plant:
    """Bodies alone, measured without bias."""
    n = len(machine.joints)
    zero = np.zeros(n)
    return Plant(model, Friction.none(n), zero, zero, zero, np.eye(n), np.ones(n), zero, zero)


@dataclass(frozen=True)
class Happened:
    """What truly happened.

    Attributes:
        course: Of the links.
        motor: Angle of the motors at the joint's side, shape (N, J) [rad].
        torque: Of the motors at the joint's side, shape (N, J) [N*m].
        feet: Normal forces on the feet, shape (N, L) [N]; None for a fixed base.
    """

    course: Course
    motor: Array
    torque: Array
    feet: Array | None = None

    def every(self, dt: float) -> Happened:
        """The same with rows at another, longer step [s]."""
        step, c = max(1, round(dt / self.course.dt)), self.course
        if step == 1:
            return self
        course = Course(c.time[::step], c.q[::step], c.v[::step], c.a[::step])
        return Happened(course, self.motor[::step], self.torque[::step])
