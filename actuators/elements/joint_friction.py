"""Friction of a joint in one law: dry, viscous, Stribeck, quadratic, saturating, by load.

The sum that Bona and Indri, "Friction compensation in robotics: an overview", CDC 2005, review,
with s the sense of motion and v the velocity:

    friction = (coulomb + excess exp(-(v / stribeck_speed)^2)) s + viscous v + asymmetry |v|
             + quadratic v |v| + saturating tanh(v / saturation_speed)
             + (when_driving or when_driven, by the quadrant of power) |torque| s
"""

from dataclasses import dataclass

import numpy as np

from actuators.arrays import FloatArray, Scalars, require, require_non_negative
from actuators.elements.loaded_friction import LoadedFriction
from actuators.shaft import ShaftSeries


@dataclass(frozen=True, eq=False)
class JointFriction(LoadedFriction):
    """Terms of friction at one shaft; those that a joint does not have are zero.

    Attributes:
        coulomb: Dry friction [N*m].
        viscous: Per speed [N*m*s/rad].
        asymmetry: By which viscous friction is larger forward and smaller backward [N*m*s/rad].
        excess: Break-away less Coulomb friction [N*m].
        stribeck_speed: At which 1/e of the excess is left [rad/s].
        quadratic: Per squared speed [N*m*s^2/rad^2].
        saturating: Level of friction that grows less and less with speed [N*m].
        saturation_speed: Over which it grows [rad/s].
        when_driving: Per transmitted torque while the motor drives the load, dimensionless.
        when_driven: Per transmitted torque while the load drives the motor; below 1.

    Raises:
        UnphysicalElementError: A term would give energy, or a speed is not positive.
    """

    coulomb: Scalars = 0.0
    viscous: Scalars = 0.0
    asymmetry: Scalars = 0.0
    excess: Scalars = 0.0
    stribeck_speed: Scalars = 1.0
    quadratic: Scalars = 0.0
    saturating: Scalars = 0.0
    saturation_speed: Scalars = 1.0
    when_driving: Scalars = 0.0
    when_driven: Scalars = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require_non_negative(
            self.name,
            coulomb=self.coulomb,
            viscous=self.viscous,
            excess=self.excess,
            quadratic=self.quadratic,
            saturating=self.saturating,
            when_driving=self.when_driving,
            when_driven=self.when_driven,
        )
        require(np.greater(self.stribeck_speed, 0.0), self.name, "stribeck_speed must be > 0")
        require(np.greater(self.saturation_speed, 0.0), self.name, "saturation_speed must be > 0")
        require(np.less(self.when_driven, 1.0), self.name, "when_driven must be below 1")
        within = np.less_equal(np.abs(self.asymmetry), self.viscous)
        require(within, self.name, "asymmetry must not exceed viscous: it would give energy")

    def free(self, side: ShaftSeries) -> FloatArray:
        """Return all terms but those of the load, (N, J) [N*m]."""
        v = side.velocity
        dry = self.coulomb + self.excess * np.exp(-((v / self.stribeck_speed) ** 2))
        torque: FloatArray = dry * self.sense(side) + self.viscous * v
        torque = torque + (self.asymmetry + self.quadratic * v) * np.abs(v)
        return torque + self.saturating * np.tanh(v / self.saturation_speed)

    def share(self, side: ShaftSeries, sign: FloatArray) -> FloatArray:
        """Return the coefficient of the quadrant of power, (N, J)."""
        return np.where(sign * self.sense(side) > 0.0, self.when_driving, self.when_driven)

    def static(self) -> tuple[Scalars, Scalars, Scalars, Scalars]:
        """Return dry friction either way and the shares of load."""
        level = self.coulomb + self.excess
        return level, level, self.when_driving, self.when_driven
