"""A rotating mass at one shaft (the inertial terms of Eq. 3, 7, 8, 14 and 18 of the paper)."""

from dataclasses import dataclass

from actuators.arrays import Array, Scalars
from actuators.elements.element import Element
from actuators.shaft import ShaftSeries


@dataclass(frozen=True, eq=False)
class Inertia(Element):
    """Torque for the acceleration of a shaft; stores kinetic energy and dissipates nothing.

    Note:
        Counted here, reflected rotor inertia must not stand in the rigid-body model as well.
    """

    inertia: Scalars = 0.0  #: Moment of inertia about the shaft [kg*m^2].

    def added(self, side: ShaftSeries) -> Array:
        """Return inertia times acceleration; nothing at standstill."""
        return self.inertia * side.acceleration

    def stored(self, joint_side: ShaftSeries) -> Array:
        """Return the rate of kinetic energy, (N, J) [W]."""
        return self.added(joint_side) * joint_side.velocity
