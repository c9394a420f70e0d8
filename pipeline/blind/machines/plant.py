"""The machine as it truly is, and its sensors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from pipeline.blind.machines.chains import Machine
from pipeline.blind.machines.laws import Friction, Law
from pipeline.blind.machines.motions import Course


@dataclass(frozen=True)
class Plant:
    """A machine as it is; arrays of shape (J,), referred to the joint."""

    model: pin.Model  #: Bodies and gravity.
    friction: Friction  #: At every joint, on the motor's side of gears that give.
    inertia: Array  #: Of the rotors, as far as the URDF lacks it [kg*m^2].
    compliance: Array  #: Of the gears [rad/(N*m)].
    play: Array  #: Whole width [rad].
    coupling: Array  #: Motor speeds over joint speeds, shape (J, J); friction and rotors feel both.
    gain: Array  #: By which torques read too much [1].
    offset: Array  #: Added to torques [N*m].
    zero: Array  #: Added to positions [rad].
    delay: float = 0.0  #: Of the torques behind the positions [s].
    sides: str = "joint"  #: Where positions are measured: ``"joint"``, ``"motor"`` or ``"both"``.
    #: Joint to a law begun for a time step [s].
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
    """What truly happened."""

    course: Course  #: Of the links.
    motor: Array  #: Angle of the motors at the joint's side, shape (N, J) [rad].
    torque: Array  #: Of the motors at the joint's side, shape (N, J) [N*m].
    #: Normal forces on the feet, shape (N, L) [N]; None for a fixed base.
    feet: Array | None = None

    def every(self, dt: float) -> Happened:
        """The same with rows at another, longer step [s]."""
        step, c = max(1, round(dt / self.course.dt)), self.course
        if step == 1:
            return self
        course = Course(c.time[::step], c.q[::step], c.v[::step], c.a[::step])
        return Happened(course, self.motor[::step], self.torque[::step])
