"""A hypoid gear with friction at the tooth contact (Eq. 12 and 13 of the paper).

With the wheel (2) on the joint side and the pinion (1) on the motor side, s = sgn(w2), and the
normal force F

    F = T2 / (r2 (cos b2 + s sgn(T2) mu sin b2))                                        (Eq. 12)
    T1 = (F cos b1 + s mu |F| sin b1) r1                                                (Eq. 13)

Power is conserved at mu = 0 only if r1 is tied to the ratio: n = r2 cos b2 / (r1 cos b1). Then

    T1 = T2 / n (1 + mu tan b1) / (1 + mu tan b2)   where the pinion drives (s T2 > 0)
    T1 = T2 / n (1 - mu tan b1) / (1 - mu tan b2)   where the wheel drives (s T2 < 0)

so that the wheel cannot drive where mu tan b1 >= 1. Eq. 11 of the paper is the limit mu = 0.
"""

from dataclasses import dataclass

import numpy as np

from actuators.arrays import Array, Scalars
from actuators.elements.element import Element, Span
from actuators.parameters import number, require
from actuators.shaft import ShaftSeries


@dataclass(frozen=True, eq=False)
class Hypoid(Element, law="hypoid"):
    """A hypoid gear; reversible or self-locking as its angles and friction decide.

    Note:
        Friction is the same at standstill as in motion.
    """

    #: n, pinion speed over wheel speed [1].
    ratio: Scalars = number("ratio", "positive", 1.0, needed=True)
    pinion_angle: Scalars = number("angle", needed=True)  #: b1, spiral angle [rad].
    wheel_angle: Scalars = number("angle", needed=True)  #: b2, smaller than b1 [rad].
    #: r2, mean radius of the wheel [m]; the pinion's torque does not depend on it.
    wheel_radius: Scalars = number("length", "positive", 1.0, needed=True)
    #: mu at the tooth contact; mu tan b2 must stay below 1.
    friction: Scalars = number("ratio", needed=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        b1, b2 = np.asarray(self.pinion_angle), np.asarray(self.wheel_angle)
        require((b1 < np.pi / 2) & (b2 >= 0.0), self.name, "angles must lie in [0, 90) deg")
        require(b1 > b2, self.name, "pinion_angle must exceed wheel_angle, or friction gives power")
        turns = self.friction * np.tan(b2) < 1.0
        lacking = "friction x tan(wheel_angle) must be below 1, or the wheel cannot turn at all"
        require(turns, self.name, lacking)

    @property
    def factors(self) -> tuple[Array, Array]:
        """T1 n / T2 where the pinion drives, above 1, and where the wheel does, below 1.

        The second is zero or less when the gear locks itself.
        """
        pinion, wheel = np.tan(self.pinion_angle), np.tan(self.wheel_angle)
        signed = (np.asarray(self.friction), -np.asarray(self.friction))
        driving, driven = ((1.0 + mu * pinion) / (1.0 + mu * wheel) for mu in signed)
        return np.asarray(driving), np.asarray(driven)

    @property
    def pinion_radius(self) -> Scalars:
        """r1 [m], tied to the ratio."""
        turned = self.ratio * np.cos(self.pinion_angle)
        return self.wheel_radius * np.cos(self.wheel_angle) / turned

    @property
    def gearing(self) -> Scalars:
        """The ratio."""
        return self.ratio

    def normal_force(self, joint_side: ShaftSeries) -> Array:
        """Return the signed normal force at the teeth, (N, J) [N] (Eq. 12)."""
        along = np.sign(joint_side.torque) * joint_side.direction
        across = np.cos(self.wheel_angle) + self.friction * np.sin(self.wheel_angle) * along
        return joint_side.torque / (self.wheel_radius * across)

    def inverse(self, joint_side: ShaftSeries) -> ShaftSeries:
        """Return the pinion's torque and motion (Eq. 13)."""
        force = self.normal_force(joint_side)
        rubbing = self.friction * np.sin(self.pinion_angle) * joint_side.direction * np.abs(force)
        torque = (force * np.cos(self.pinion_angle) + rubbing) * self.pinion_radius
        return joint_side.geared(self.ratio, torque)

    def holding(self, low: Array, high: Array, position: Array | None = None) -> Span:
        """Return the span of Eq. 13 over both senses of an impending motion.

        Its ends are concave and convex in the load: their extremes lie at the interval's ends.
        """
        driving, driven = (factor / self.ratio for factor in self.factors)
        ends = [low * driving, low * driven, high * driving, high * driven]
        return np.minimum.reduce(ends), np.maximum.reduce(ends)

    def loss(self, joint_side: ShaftSeries) -> Array:
        """Return mu |F| |v|, (N, J) [W], v = r2 w2 cos b2 (tan b1 - tan b2) along the teeth."""
        slip = np.cos(self.wheel_angle) * (np.tan(self.pinion_angle) - np.tan(self.wheel_angle))
        speed = self.wheel_radius * slip * joint_side.direction * joint_side.velocity
        return self.friction * np.abs(self.normal_force(joint_side)) * speed
