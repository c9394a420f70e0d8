"""Load friction that differs between driving a load and being driven by it.

Hamon, Gautier and Garrec, "Dynamic identification of robots with a dry friction model depending
on load and velocity", IROS 2010: one coefficient per power quadrant,

    friction = (driving where torque velocity > 0, driven where < 0) |torque| sgn(velocity)
"""

from dataclasses import dataclass

import numpy as np

from actuators.arrays import FloatArray, Scalars, require, require_non_negative
from actuators.elements.element import Element
from actuators.shaft import ShaftSeries


@dataclass(frozen=True, eq=False)
class QuadrantFriction(Element):
    """Load-dependent friction by power quadrant.

    Attributes:
        when_driving: Per transmitted torque while the motor drives the load, dimensionless.
        when_driven: Per transmitted torque while the load drives the motor; below 1.

    Raises:
        UnphysicalElementError: A coefficient is negative or `when_driven` is not below 1.
    """

    when_driving: Scalars = 0.0
    when_driven: Scalars = 0.0

    def __post_init__(self) -> None:
        require_non_negative(
            self.name, when_driving=self.when_driving, when_driven=self.when_driven
        )
        require(np.less(self.when_driven, 1.0), self.name, "when_driven must be below 1")

    def moving(self, joint_side: ShaftSeries) -> ShaftSeries:
        """Add the friction torque; it vanishes with the load, so the quadrants join smoothly."""
        torque, direction = joint_side.torque, joint_side.direction
        friction = self.share(torque, direction) * np.abs(torque) * direction
        return joint_side.with_torque(torque + friction)

    def share(self, torque: FloatArray, direction: FloatArray) -> FloatArray:
        """Return the coefficient that acts in each sample (N, J)."""
        result: FloatArray = np.where(torque * direction > 0.0, self.when_driving, self.when_driven)
        return result

    def driving(self, motor_side: ShaftSeries) -> ShaftSeries:
        """Subtract the friction torque; the joint side's torque has the motor side's sign."""
        x, d = motor_side.torque, motor_side.direction
        return motor_side.with_torque(x / (1.0 + self.share(x, d) * d * np.sign(x)))

    def holding(self, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Widen the interval: lifting costs `when_driving`, letting down saves `when_driven`."""
        return (
            low - np.where(low < 0.0, self.when_driving, self.when_driven) * np.abs(low),
            high + np.where(high > 0.0, self.when_driving, self.when_driven) * np.abs(high),
        )

    def loss(self, joint_side: ShaftSeries, motor_side: ShaftSeries) -> FloatArray:
        """Return friction torque times speed, (N, J) [W]."""
        torque, direction = joint_side.torque, joint_side.direction
        share = self.share(torque, direction)
        return share * np.abs(torque) * direction * joint_side.velocity
