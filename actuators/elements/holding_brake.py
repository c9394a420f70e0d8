"""A holding brake: engaged at standstill, released in motion.

Engaged it holds like dry friction, with up to its static torque in either sense, so that the motor
needs no current below it. The power-off kind (springs close it) costs its coil's power while it is
released; the other kind while it is engaged.
"""

from dataclasses import dataclass

import numpy as np

from actuators.arrays import Array, Scalars
from actuators.elements.element import Element, Span
from actuators.parameters import number
from actuators.shaft import ShaftSeries


@dataclass(frozen=True, eq=False)
class HoldingBrake(Element):
    """A brake that engages wherever its shaft is at rest, and adds nothing in motion.

    Note:
        It engages and releases at once; the coil's transients and the drag of a released brake
        (a `friction` of its own) are left out.
    """

    static_torque: Scalars = number("torque", needed=True)  #: With which it holds [N*m].
    released_power: Scalars = number("power")  #: Of the coil in motion [W].
    engaged_power: Scalars = number("power")  #: Of the coil at rest; 0 if springs close it [W].

    def holding(self, low: Array, high: Array, position: Array | None = None) -> Span:
        """Widen the interval by the static torque."""
        return low - self.static_torque, high + self.static_torque

    def drawn(self, direction: Array) -> Array:
        """Return the coil's power [W]."""
        return np.where(direction == 0.0, self.engaged_power, self.released_power)

    def loss(self, joint_side: ShaftSeries) -> Array:
        """Return the coil's power, all of it heat, (N, J) [W]."""
        return self.drawn(joint_side.direction)
