"""Torques that depend on a joint's position alone: parallel spring and ripple.

They stand on the joint side of the chain and add to what the joint demands; unlike the elements
of a chain they need the position at standstill, too.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from actuators.arrays import FloatArray, require


@dataclass(frozen=True)
class PositionTorque(ABC):
    """What the actuator has to supply on top because of where the joint stands."""

    name: str

    @abstractmethod
    def torque(self, position: FloatArray) -> FloatArray:
        """Return the additional demand (N,) [N*m] at positions (N,) [rad]."""


@dataclass(frozen=True)
class ParallelSpring(PositionTorque):
    """A spring between the joint's two links: stiffness (position - rest).

    Attributes:
        stiffness: [N*m/rad].
        rest: Position without torque [rad].
    """

    stiffness: float = 0.0
    rest: float = 0.0

    def __post_init__(self) -> None:
        require(np.isfinite([self.stiffness, self.rest]), self.name, "values must be finite")

    def torque(self, position: FloatArray) -> FloatArray:
        """Return stiffness (position - rest) [N*m]."""
        return self.stiffness * (position - self.rest)


@dataclass(frozen=True)
class Ripple(PositionTorque):
    """Torque periodic in the angle: amplitude sin(order position + phase).

    Harmonic Drives disturb twice per turn of the wave generator (Tuttle and Seering, IEEE T-RA
    12(3), 1996), motors with slots by their cogging order.

    Attributes:
        amplitude: [N*m].
        order: Periods per turn of the joint; a motor's order times the ratio.
        phase: [rad].
    """

    amplitude: float = 0.0
    order: float = 1.0
    phase: float = 0.0

    def __post_init__(self) -> None:
        values = [self.amplitude, self.order, self.phase]
        require(np.isfinite(values), self.name, "values must be finite")

    def torque(self, position: FloatArray) -> FloatArray:
        """Return the ripple torque [N*m]."""
        result: FloatArray = self.amplitude * np.sin(self.order * position + self.phase)
        return result
