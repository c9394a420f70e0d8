"""Torques that depend on a shaft's position alone: parallel spring, ripple and any curve.

They are conservative: what they take on one half of a closed path they give back on the other.
"""

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from actuators.arrays import Array, Scalars
from actuators.elements.element import Element, Span
from actuators.errors import LegwattError
from actuators.parameters import require
from actuators.shaft import ShaftSeries


@dataclass(frozen=True, eq=False)
class PositionTorque(Element):
    """What the motor side has to supply in addition because of where the shaft stands."""

    @abstractmethod
    def torque(self, position: Array) -> Array:
        """Return the additional demand (...) [N*m] at positions (...) [rad]."""

    def added(self, side: ShaftSeries) -> Array:
        """Return the torque at the series' positions, (N, J) [N*m]."""
        return self.torque(side.position)

    def holding(self, low: Array, high: Array, position: Array | None = None) -> Span:
        """Shift the interval.

        Raises:
            LegwattError: The position is not known.
        """
        if position is None:
            raise LegwattError(
                f"element '{self.name}': what holds depends on the position: state it"
            )
        torque = self.torque(position)
        return low + torque, high + torque

    def stored(self, joint_side: ShaftSeries) -> Array:
        """Return the rate of potential energy, (N, J) [W]."""
        return self.torque(joint_side.position) * joint_side.velocity


@dataclass(frozen=True, eq=False)
class ParallelSpring(PositionTorque):
    """A spring beside the drive, between the two links: stiffness (position - rest).

    Its torque acts on the joint against the displacement, so that the drive supplies it on top.
    """

    rules: ClassVar = {"stiffness": "signed", "rest": "signed"}
    stiffness: Scalars = 0.0  #: [N*m/rad].
    rest: Scalars = 0.0  #: Position without torque [rad].

    def torque(self, position: Array) -> Array:
        """Return stiffness (position - rest) [N*m]."""
        return self.stiffness * (position - self.rest)


@dataclass(frozen=True, eq=False)
class Ripple(PositionTorque):
    """Torque periodic in the angle: amplitude sin(order position + phase).

    Harmonic Drives disturb twice per turn of the wave generator (Tuttle and Seering, IEEE T-RA
    12(3), 1996), motors with slots by their cogging order.
    """

    rules: ClassVar = {"amplitude": "signed", "order": "signed", "phase": "signed"}
    amplitude: float = 0.0  #: [N*m].
    order: float = 1.0  #: Periods per turn of the shaft.
    phase: float = 0.0  #: [rad].

    def torque(self, position: Array) -> Array:
        """Return the ripple torque [N*m]."""
        return np.asarray(self.amplitude * np.sin(self.order * position + self.phase))


@dataclass(frozen=True, eq=False)
class PositionCurve(PositionTorque):
    """Torque over position that has no law: straight lines between knots, even beyond them."""

    places: tuple[float, ...] = (0.0,)  #: Knots, ascending, (P,) [rad].
    levels: tuple[float, ...] = (0.0,)  #: There, (P,) [N*m].

    def __post_init__(self) -> None:
        ascending = len(self.places) == len(self.levels) and (np.diff(self.places) > 0.0).all()
        require(ascending, self.name, "places must ascend, with a level at each")
        require(np.isfinite(self.levels), self.name, "levels must be finite")

    def torque(self, position: Array) -> Array:
        """Return the curve's torque [N*m]."""
        return np.interp(position, self.places, self.levels)
