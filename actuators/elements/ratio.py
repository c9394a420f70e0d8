"""An ideal transmission: a ratio without loss (Eq. 1 and 2 of the paper)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from actuators.arrays import Array, Scalars
from actuators.elements.element import Element, Span
from actuators.shaft import ShaftSeries


@dataclass(frozen=True, eq=False)
class Ratio(Element):
    """Speed divided from motor side to joint side, torque multiplied, power kept."""

    rules: ClassVar = {"ratio": "positive"}
    ratio: Scalars = 1.0  #: Motor-side over joint-side speed, positive, dimensionless.

    def inverse(self, joint_side: ShaftSeries) -> ShaftSeries:
        """Return the faster shaft with the smaller torque."""
        return joint_side.geared(self.ratio, joint_side.torque / self.ratio)

    def forward(self, motor_side: ShaftSeries) -> ShaftSeries:
        """Return the slower shaft with the larger torque."""
        return motor_side.geared(1.0 / np.asarray(self.ratio), motor_side.torque * self.ratio)

    def holding(self, low: Array, high: Array, position: Array | None = None) -> Span:
        """Scale the interval."""
        return low / self.ratio, high / self.ratio

    @property
    def gearing(self) -> Scalars:
        """The ratio."""
        return self.ratio
