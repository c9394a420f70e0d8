"""Friction that falls with speed near standstill (Stribeck).

Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30(7), 1994: above Coulomb friction

    friction = excess exp(-(velocity / speed)^2) sgn(velocity)
"""

from dataclasses import dataclass

import numpy as np

from actuators.arrays import FloatArray, Scalars, require, require_non_negative
from actuators.elements.element import Element
from actuators.shaft import ShaftSeries


@dataclass(frozen=True, eq=False)
class Stribeck(Element):
    """The part of break-away friction that vanishes in motion; Coulomb friction stands beside it.

    Attributes:
        excess: Break-away less Coulomb friction [N*m].
        speed: At which 1/e of the excess is left [rad/s].

    Raises:
        UnphysicalElementError: The excess is negative or the speed not positive.
    """

    excess: Scalars = 0.0
    speed: Scalars = 0.1

    def __post_init__(self) -> None:
        require_non_negative(self.name, excess=self.excess, speed=self.speed)
        require(np.greater(self.speed, 0.0), self.name, "speed must be > 0")

    def torque(self, side: ShaftSeries) -> FloatArray:
        """Return the friction torque (N, J) [N*m]; zero where `direction` is zero."""
        result: FloatArray = self.excess * np.exp(-((side.velocity / self.speed) ** 2))
        return result * side.direction

    def moving(self, joint_side: ShaftSeries) -> ShaftSeries:
        """Add the friction torque."""
        return joint_side.with_torque(joint_side.torque + self.torque(joint_side))

    def driving(self, motor_side: ShaftSeries) -> ShaftSeries:
        """Subtract the friction torque."""
        return motor_side.with_torque(motor_side.torque - self.torque(motor_side))

    def holding(self, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Widen the interval by the excess, which is whole at standstill."""
        return low - self.excess, high + self.excess

    def loss(self, joint_side: ShaftSeries, motor_side: ShaftSeries) -> FloatArray:
        """Return friction torque times speed, (N, J) [W]."""
        return self.torque(joint_side) * joint_side.velocity
