"""A holding brake: engaged at standstill, released in motion.

Engaged it holds like dry friction, with up to its static torque in either sense, so that the motor
needs no current below it. The power-off kind (springs close it) costs its coil's power while it is
released; the other kind while it is engaged.
"""

from dataclasses import dataclass

import numpy as np

from actuators.arrays import Array, Scalars, require_non_negative
from actuators.elements.element import Element
from actuators.shaft import ShaftSeries


@dataclass(frozen=True, eq=False)
class HoldingBrake(Element):
    """A brake that engages wherever its shaft is at rest, and adds nothing in motion.

    Raises:
        UnphysicalElementError: A value is negative.

    Note:
        It engages and releases at once; the coil's transients and the drag of a released brake
        (a `friction` of its own) are left out.
    """

    static_torque: Scalars = 0.0  #: With which it holds at its own shaft [N*m].
    #: Of the coil in motion; zero for a brake that current closes [W].
    released_power: Scalars = 0.0
    engaged_power: Scalars = 0.0  #: Of the coil at rest; zero for a brake that springs close [W].

    def __post_init__(self) -> None:
        require_non_negative(
            self.name,
            static_torque=self.static_torque,
            released_power=self.released_power,
            engaged_power=self.engaged_power,
        )

    def holding(
        self, low: Array, high: Array, position: Array | None = None
    ) -> tuple[Array, Array]:
        """Widen the interval by the static torque."""
        return low - self.static_torque, high + self.static_torque

    def drawn(self, torque: Array, velocity: Array, direction: Array) -> Array:
        """Return the coil's power [W]."""
        return np.where(direction == 0.0, self.engaged_power, self.released_power)

    def loss(self, joint_side: ShaftSeries) -> Array:
        """Return the coil's power, all of it heat, (N, J) [W]."""
        return self.drawn(joint_side.torque, joint_side.velocity, joint_side.direction)
