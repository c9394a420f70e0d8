"""Torques at a joint beside friction: springs, ripple, drag, a cable's hysteresis."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class ExtraTorque(ABC):
    """A torque on one joint that depends on its motion."""

    joint: int

    @abstractmethod
    def start(self, dt: float) -> Stepper:
        """A fresh state of this torque."""


class Stepper(ABC):
    """The state of an extra torque during one simulation."""

    @abstractmethod
    def torque(self, position: float, velocity: float) -> float:
        """Torque on the joint in its positive sense over one step [N*m]."""


@dataclass(frozen=True)
class Spring(ExtraTorque):
    """Linear and cubic spring from base to joint: -k (q - q0) - k3 (q - q0)^3.

    Attributes:
        joint: Column of the joint.
        rest: q0 [rad].
        linear: k [N*m/rad].
        cubic: k3 [N*m/rad^3].
    """

    joint: int
    rest: float
    linear: float
    cubic: float = 0.0

    def start(self, dt: float) -> Stepper:
        """A spring has no state."""
        return _SpringStepper(self)


class _SpringStepper(Stepper):
    def __init__(self, law: Spring) -> None:
        self._law = law

    def torque(self, position: float, velocity: float) -> float:
        d = position - self._law.rest
        return -d * (self._law.linear + self._law.cubic * d * d)


@dataclass(frozen=True)
class Ripple(ExtraTorque):
    """Torque periodic in the joint's angle: a sin(k q + phase).

    Attributes:
        joint: Column of the joint.
        amplitude: a [N*m].
        order: k, periods per turn of the joint [1].
        phase: [rad].
    """

    joint: int
    amplitude: float
    order: float
    phase: float

    def start(self, dt: float) -> Stepper:
        """A ripple has no state."""
        return _RippleStepper(self)


class _RippleStepper(Stepper):
    def __init__(self, law: Ripple) -> None:
        self._law = law

    def torque(self, position: float, velocity: float) -> float:
        law = self._law
        return float(law.amplitude * np.sin(law.order * position + law.phase))


@dataclass(frozen=True)
class QuadraticDrag(ExtraTorque):
    """Drag by a fluid: -c |w| w.

    Attributes:
        joint: Column of the joint.
        coefficient: c [N*m*s^2/rad^2].
    """

    joint: int
    coefficient: float

    def start(self, dt: float) -> Stepper:
        """A drag has no state."""
        return _DragStepper(self)


class _DragStepper(Stepper):
    def __init__(self, law: QuadraticDrag) -> None:
        self._law = law

    def torque(self, position: float, velocity: float) -> float:
        return -self._law.coefficient * abs(velocity) * velocity


@dataclass(frozen=True)
class CableDrag(ExtraTorque):
    """A cable loom: cubic spring and a slow hysteresis (Dahl 1968, long bristles).

    Attributes:
        joint: Column of the joint.
        rest: Where the cable hangs loose [rad].
        cubic: [N*m/rad^3].
        hysteresis: Torque once fully wound [N*m].
        width: Angle over which it winds up [rad].
    """

    joint: int
    rest: float
    cubic: float
    hysteresis: float
    width: float

    def start(self, dt: float) -> Stepper:
        """Starts unwound."""
        return _CableStepper(self, dt)


class _CableStepper(Stepper):
    def __init__(self, law: CableDrag, dt: float) -> None:
        self._law, self._dt, self._z = law, dt, 0.0

    def torque(self, position: float, velocity: float) -> float:
        law = self._law
        target = 1.0 if velocity > 0 else -1.0
        self._z = target + (self._z - target) * float(np.exp(-abs(velocity) * self._dt / law.width))
        return -law.cubic * (position - law.rest) ** 3 - law.hysteresis * self._z


@dataclass(frozen=True)
class StickingSpot:
    """Dry friction that rises over a short stretch of a joint's travel.

    It is friction, not an extra torque: the bristles of the joint's shaft carry it.

    Attributes:
        joint: Column of the joint.
        centre: [rad].
        width: Standard deviation of the stretch [rad].
        torque: Friction at its centre [N*m].
    """

    joint: int
    centre: float
    width: float
    torque: float

    def level(self, position: float) -> float:
        """Dry friction at a position [N*m]."""
        return float(self.torque * np.exp(-0.5 * ((position - self.centre) / self.width) ** 2))
