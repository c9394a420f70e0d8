"""Friction that falls as a gear warms: thinner grease, looser fits.

Dry and viscous friction of a robot's joint fall with its temperature, the viscous part about as
exp(-T / T_0) (Bittencourt and Gunnarsson 2012, "Static friction in a robot joint: modeling and
identification of load and temperature effects", J. Dyn. Syst. Meas. Control 134(5), 051013). To
first order about a reference,

    torque = -(T - T_ref) (coulomb sgn(v) + viscous v)

which is added to the friction that the joint has at the reference.
"""

from dataclasses import dataclass
from typing import Final

from actuators.arrays import Array, require, require_non_negative

ZERO_CELSIUS: Final = 273.15  # [K]


@dataclass(frozen=True)
class Warming:
    """By how much one joint's friction falls.

    Raises:
        UnphysicalElementError: Friction would grow, or the reference is not above absolute zero.
    """

    coulomb: float = 0.0  #: Dry friction per kelvin [N*m/K].
    viscous: float = 0.0  #: Viscous friction per kelvin [N*m*s/(rad*K)].
    reference: float = 298.15  #: Temperature at which nothing is taken off [K].

    def __post_init__(self) -> None:
        require_non_negative("warming", coulomb=self.coulomb, viscous=self.viscous)
        require(self.reference > 0.0, "warming", "reference must be > 0 K")

    def torque(self, temperature: Array, direction: Array, velocity: Array) -> Array:
        """Return what comes on top of the friction at the reference, (N,) [N*m].

        Args:
            temperature: By the joint's sensor, (N,) [degC].
            direction: Of the motion, -1 to 1, (N,).
            velocity: (N,) [rad/s].
        """
        warmer = temperature + ZERO_CELSIUS - self.reference  # [K]
        return -warmer * (self.coulomb * direction + self.viscous * velocity)
