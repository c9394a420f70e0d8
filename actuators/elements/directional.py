"""Coulomb friction that differs with the direction of motion.

As measured on geared joints, e.g. Armstrong, "Control of machines with friction", 1991:

    friction = positive for velocity > 0, -negative for velocity < 0
"""

from dataclasses import dataclass

import numpy as np

from actuators.arrays import FloatArray, Scalars, require_non_negative
from actuators.elements.element import Element
from actuators.shaft import ShaftSeries


@dataclass(frozen=True, eq=False)
class DirectionalFriction(Element):
    """Load-independent friction with a level for each direction.

    Attributes:
        positive: Level in positive motion [N*m].
        negative: Level in negative motion [N*m].

    Raises:
        UnphysicalElementError: A level is negative.

    Note:
        In motion it equals Coulomb friction (positive + negative) / 2 with a constant torque
        (positive - negative) / 2; only standstill tells the two apart.
    """

    positive: Scalars = 0.0
    negative: Scalars = 0.0

    def __post_init__(self) -> None:
        require_non_negative(self.name, positive=self.positive, negative=self.negative)

    def torque(self, side: ShaftSeries) -> FloatArray:
        """Return the friction torque (N, J) [N*m]; zero where `direction` is zero."""
        level = np.where(side.direction > 0.0, self.positive, self.negative)
        result: FloatArray = level * side.direction
        return result

    def moving(self, joint_side: ShaftSeries) -> ShaftSeries:
        """Add the friction torque."""
        return joint_side.with_torque(joint_side.torque + self.torque(joint_side))

    def driving(self, motor_side: ShaftSeries) -> ShaftSeries:
        """Subtract the friction torque."""
        return motor_side.with_torque(motor_side.torque - self.torque(motor_side))

    def holding(self, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Widen the interval: friction holds with up to `negative` against sinking back."""
        return low - self.negative, high + self.positive

    def loss(self, joint_side: ShaftSeries, motor_side: ShaftSeries) -> FloatArray:
        """Return friction torque times speed, (N, J) [W]."""
        return self.torque(joint_side) * joint_side.velocity
