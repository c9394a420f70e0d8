"""A second motor at a shaft, which takes a fixed share of the shaft's torque."""

from dataclasses import dataclass
from typing import ClassVar

from actuators.arrays import Array, Scalars, least_magnitude
from actuators.elements.element import Element, Span
from actuators.shaft import ShaftSeries


@dataclass(frozen=True, eq=False)
class SecondMotor(Element):
    """A motor beside the chain's own, on the same shaft: I = share torque / k, P = k I w + R I^2.

    At standstill it gives its share of the least torque that holds. Two motors lose least copper
    where each takes a share in proportion to its k^2 / R.

    Note:
        Its rotor's friction and inertia are elements of their own, at the same shaft. Its current
        and voltage are held against no limits.
    """

    rules: ClassVar = {"torque_constant": "positive", "share": "share"}
    torque_constant: Scalars = 1.0  #: k [N*m/A].
    resistance: Scalars = 0.0  #: R of its winding [ohm].
    share: Scalars = 0.0  #: Of the shaft's torque, dimensionless.

    def added(self, side: ShaftSeries) -> Array:
        """Return what the chain's own motor need not supply, negative for a load that resists."""
        return -self.share * side.torque

    def holding(self, low: Array, high: Array, position: Array | None = None) -> Span:
        """Shift the interval by the share of the least torque that holds."""
        own = self.share * least_magnitude(low, high)
        return low - own, high - own

    def drawn(self, torque: Array, velocity: Array, direction: Array) -> Array:
        """Return its electrical power [W]."""
        own = self.share * torque
        return own * velocity + self.resistance * (own / self.torque_constant) ** 2

    def loss(self, joint_side: ShaftSeries) -> Array:
        """Return R I^2, (N, J) [W]."""
        return self.resistance * (self.share * joint_side.torque / self.torque_constant) ** 2
