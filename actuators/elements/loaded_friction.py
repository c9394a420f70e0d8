"""What laws of friction share that are told as one curve: a free part and a share of the load.

    friction = free(velocity) + share(torque, velocity) |torque| s(velocity)

s is the sense of motion. After a reversal it may rise instead of jumping: over a small travel
(presliding, `actuators.presliding`), or over a speed, s = erf(velocity / (sqrt(2) rise)).
"""

from abc import abstractmethod
from dataclasses import dataclass
from typing import Final

import numpy as np

from actuators.arrays import FloatArray, Scalars, require_non_negative
from actuators.elements.element import Element
from actuators.presliding import presliding
from actuators.shaft import ShaftSeries

#: Abramowitz and Stegun, Handbook of Mathematical Functions, 7.1.26; error below 1.5e-7.
_P: Final = 0.3275911
_A: Final = (0.254829592, -0.284496736, 1.421413741, -1.453152027, 1.061405429)


def erf(x: FloatArray) -> FloatArray:
    """Return the error function to 1.5e-7; odd, zero at zero."""
    t = 1.0 / (1.0 + _P * np.abs(x))
    series = t * (_A[0] + t * (_A[1] + t * (_A[2] + t * (_A[3] + t * _A[4]))))
    return np.asarray(np.sign(x) * (1.0 - series * np.exp(-(x**2))))


@dataclass(frozen=True, eq=False)
class LoadedFriction(Element):
    """Friction with a part of its own and a part per transmitted torque.

    Attributes:
        rise: Speed over which dry friction rises after a reversal; 0 for a jump [rad/s].
        travel: Travel over which it does, in place of a speed; 0 for none [rad].

    Note:
        At standstill dry friction holds with its whole level, whatever the rise.
    """

    rise: Scalars = 0.0
    travel: float = 0.0

    def __post_init__(self) -> None:
        require_non_negative(self.name, rise=self.rise, travel=self.travel)

    @abstractmethod
    def free(self, side: ShaftSeries) -> FloatArray:
        """Return the friction torque that no load changes, (N, J) [N*m]."""

    @abstractmethod
    def share(self, side: ShaftSeries, sign: FloatArray) -> FloatArray:
        """Return friction per transmitted torque where the load has a sign, (N, J), below 1."""

    @abstractmethod
    def static(self) -> tuple[Scalars, Scalars, Scalars, Scalars]:
        """Return levels [N*m] against negative and positive motion, and shares driving, driven."""

    def sense(self, side: ShaftSeries) -> FloatArray:
        """Return the sense of motion, -1 to 1, (N, J)."""
        if self.travel > 0.0:
            columns = zip(side.position.T, side.direction.T, strict=True)
            return np.stack([presliding(side.time, q, d, self.travel) for q, d in columns], axis=1)
        if not np.any(self.rise):
            return side.direction
        width = np.maximum(np.sqrt(2.0) * np.asarray(self.rise), 1e-300)
        return np.where(np.asarray(self.rise) > 0.0, erf(side.velocity / width), side.direction)

    def friction(self, joint_side: ShaftSeries) -> FloatArray:
        """Return the friction torque that the motor side overcomes, (N, J) [N*m]."""
        torque = joint_side.torque
        load = self.share(joint_side, np.sign(torque)) * np.abs(torque)
        return self.free(joint_side) + load * self.sense(joint_side)

    def moving(self, joint_side: ShaftSeries) -> ShaftSeries:
        """Add the friction torque."""
        return joint_side.with_torque(joint_side.torque + self.friction(joint_side))

    def driving(self, motor_side: ShaftSeries) -> ShaftSeries:
        """Subtract the friction torque; as shares are below 1, the load has the sign of the rest.

        With x = torque on the motor side less the free part, x = torque + share s |torque|.
        """
        x = motor_side.torque - self.free(motor_side)
        sign = np.sign(x)
        return motor_side.with_torque(
            x / (1.0 + self.share(motor_side, sign) * self.sense(motor_side) * sign)
        )

    def holding(self, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Widen the interval by the whole dry friction at each end."""
        against, along, driving, driven = self.static()
        return (
            low - against - np.where(low < 0.0, driving, driven) * np.abs(low),
            high + along + np.where(high > 0.0, driving, driven) * np.abs(high),
        )

    def loss(self, joint_side: ShaftSeries, motor_side: ShaftSeries) -> FloatArray:
        """Return friction torque times speed, (N, J) [W]."""
        return self.friction(joint_side) * joint_side.velocity
