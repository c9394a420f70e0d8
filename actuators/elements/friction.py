"""Coulomb, load-dependent and viscous friction at one shaft.

Eq. 4, 5, 6, 10, 15, 17 and 19 of the paper in one law, with the magnitudes that Eq. 5 and 6 need
in order to dissipate for every sign:

    friction = (coulomb + load |torque| + viscous |velocity|) sgn(velocity)
"""

from dataclasses import dataclass

import numpy as np

from actuators.arrays import FloatArray, Scalars, require, require_non_negative
from actuators.elements.element import Element
from actuators.shaft import ShaftSeries


@dataclass(frozen=True, eq=False)
class Friction(Element):
    """Friction that the motor side has to overcome; the shaft is the same on both sides.

    The load is the torque on the joint side. At standstill friction holds with up to
    coulomb + load |torque| in either sense.

    Attributes:
        coulomb: Load-independent friction [N*m].
        load: Friction per transmitted torque, below 1, dimensionless. At 1 a load could no longer
            drive the shaft backwards.
        viscous: Friction per speed [N*m*s/rad].

    Raises:
        UnphysicalElementError: A coefficient is negative or `load` is not below 1.
    """

    coulomb: Scalars = 0.0
    load: Scalars = 0.0
    viscous: Scalars = 0.0

    def __post_init__(self) -> None:
        require_non_negative(self.name, coulomb=self.coulomb, load=self.load, viscous=self.viscous)
        require(np.less(self.load, 1.0), self.name, "load must be below 1")

    def magnitude(self, joint_side: ShaftSeries) -> FloatArray:
        """Return the magnitude of the friction torque in motion, (N, J) [N*m]."""
        friction = np.abs(joint_side.velocity)
        friction *= self.viscous
        friction += self.coulomb
        if np.any(self.load):
            friction += self.load * np.abs(joint_side.torque)
        return friction

    def moving(self, joint_side: ShaftSeries) -> ShaftSeries:
        """Add the friction torque."""
        torque = self.magnitude(joint_side)
        torque *= joint_side.direction
        torque += joint_side.torque
        return joint_side.with_torque(torque)

    def driving(self, motor_side: ShaftSeries) -> ShaftSeries:
        """Subtract the friction torque; its load term is solved for the joint-side torque.

        With x = torque on the motor side less the load-independent friction, x = torque +
        direction load |torque|, and torque has the sign of x because load < 1.
        """
        d = motor_side.direction
        x = motor_side.torque - d * (self.coulomb + self.viscous * np.abs(motor_side.velocity))
        return motor_side.with_torque(x / (1.0 + self.load * d * np.sign(x)))

    def holding(self, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Widen the interval by the static friction at each end; monotone because load < 1."""
        return (
            low - self.coulomb - self.load * np.abs(low),
            high + self.coulomb + self.load * np.abs(high),
        )

    def loss(self, joint_side: ShaftSeries, motor_side: ShaftSeries) -> FloatArray:
        """Return friction torque times speed, (N, J) [W]; zero at rest."""
        power = self.magnitude(joint_side)
        power *= joint_side.direction
        power *= joint_side.velocity
        return power
