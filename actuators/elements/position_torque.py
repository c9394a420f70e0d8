"""Torque that depends on a shaft's position alone: parallel spring and ripple.

It is conservative: what it takes on one half of a closed path it gives back on the other.
"""

from dataclasses import dataclass

import numpy as np

from actuators.arrays import Array, Scalars
from actuators.elements.element import NEEDS_POSITION, Element, Span
from actuators.parameters import number, require
from actuators.shaft import ShaftSeries


@dataclass(frozen=True, eq=False)
class PositionTorque(Element):
    """What the motor side has to supply in addition because of where the shaft stands.

        torque = stiffness (position - rest) + amplitude sin(order position + phase)

    A spring lies beside the drive, between the two links, and acts against the displacement.
    Harmonic Drives disturb twice per turn of the wave generator (Tuttle and Seering, IEEE T-RA
    12(3), 1996), motors with slots by their cogging order.
    """

    #: [N*m/rad].
    stiffness: Scalars = number("rotational stiffness", "signed", needed=True)
    rest: Scalars = number("angle", "signed", needed=True)  #: Position without torque [rad].
    amplitude: Scalars = number(rule="signed")  #: [N*m].
    order: Scalars = number("", "signed", 1.0)  #: Periods per turn of the shaft.
    phase: Scalars = number(rule="signed")  #: [rad].

    def torque(self, position: Array) -> Array:
        """Return the additional demand (...) [N*m] at positions (...) [rad]."""
        torque = self.stiffness * (position - self.rest)
        if np.any(self.amplitude):
            torque = torque + self.amplitude * np.sin(self.order * position + self.phase)
        return torque

    def added(self, side: ShaftSeries) -> Array:
        """Return the torque at the series' positions, (N, J) [N*m]."""
        return self.torque(side.position)

    def holding(self, low: Array, high: Array, position: Array | None = None) -> Span:
        """Shift the interval; the position has to be known."""
        require(position is not None, self.name, NEEDS_POSITION)
        torque = self.torque(np.asarray(position))
        return low + torque, high + torque

    def stored(self, joint_side: ShaftSeries) -> Array:
        """Return the rate of potential energy, (N, J) [W]."""
        return self.torque(joint_side.position) * joint_side.velocity
