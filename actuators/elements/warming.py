"""Friction that falls as a gear warms: thinner grease, looser fits.

Dry and viscous friction of a robot's joint fall with its temperature, the viscous part about as
exp(-T / T_0) (Bittencourt and Gunnarsson 2012, "Static friction in a robot joint: modeling and
identification of load and temperature effects", J. Dyn. Syst. Meas. Control 134(5), 051013). To
first order about a reference,

    torque = -(T - T_ref) (coulomb sgn(v) + viscous v)

which is added to the friction that the joint has at the reference.
"""

from dataclasses import dataclass
from typing import ClassVar, Final

from actuators.arrays import Array, Numbers

ZERO_CELSIUS: Final = 273.15  # [K]


@dataclass(frozen=True)
class Warming(Numbers):
    """By how much one joint's friction falls."""

    rules: ClassVar = {"reference": "positive"}
    coulomb: float = 0.0  #: Dry friction per kelvin [N*m/K].
    viscous: float = 0.0  #: Viscous friction per kelvin [N*m*s/(rad*K)].
    reference: float = 298.15  #: Temperature at which nothing is taken off [K].

    def torque(self, temperature: Array, direction: Array, velocity: Array) -> Array:
        """Return what comes on top of the friction at the reference, (N,) [N*m].

        The joint's sensor tells the temperature (N,) [degC]; the direction is -1 to 1, (N,).
        """
        warmer = temperature + ZERO_CELSIUS - self.reference  # [K]
        return -warmer * (self.coulomb * direction + self.viscous * velocity)
