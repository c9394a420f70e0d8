"""The element: one law between two neighbouring shafts of an actuator."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from actuators.arrays import Array, Numbers, Scalars
from actuators.shaft import ShaftSeries

#: Lower and upper ends of intervals, of any shape.
Span: TypeAlias = tuple[Array, Array]


@dataclass(frozen=True, eq=False)
class Element(Numbers):
    """What every element of a chain answers, vectorised over samples and joints.

    Elements are listed from the joint to the supply. Each has a joint side and a motor side; this
    one passes everything on, and a law overrides what it does otherwise: `added` where it takes or
    gives torque, `inverse` and `forward` where it changes the motion or asks for the load.
    Subclasses are frozen dataclasses; a parameter is one number for all joints or one per joint
    (J,), and `rules` say which numbers it may be. A law that an alternative does not have is simply
    not in its list.

    Every element is local: a sample of a joint depends on no other joint, and but for friction over
    a presliding displacement on no other sample. What is not (a warming winding, elastic
    deflection, a coupled wrist) is kept by `pipeline.machine`.
    """

    name: str  #: Unique in its chain; names the row of its loss.

    def added(self, side: ShaftSeries) -> Array:
        """Return the torque that the motor side supplies on top of the joint side's, (N, J) [N*m].

        Where `direction` is zero, dry friction is zero here; the chain replaces such samples by
        `holding`.
        """
        return np.zeros_like(side.torque)

    def inverse(self, joint_side: ShaftSeries) -> ShaftSeries:
        """Return what the motor side needs (inverse)."""
        return joint_side.with_torque(joint_side.torque + self.added(joint_side))

    def forward(self, motor_side: ShaftSeries) -> ShaftSeries:
        """Return what reaches the joint side (forward), all motion being known.

        It undoes `inverse`. As it stands it does where `added` depends on the motion alone.
        """
        return motor_side.with_torque(motor_side.torque - self.added(motor_side))

    def holding(self, low: Array, high: Array, position: Array | None = None) -> Span:
        """Return the motor-side torques that hold some joint-side torque at standstill.

        Args:
            low: Lower ends of the joint-side intervals [N*m], any shape.
            high: Upper ends [N*m], same shape.
            position: Of the joint-side shaft [rad], same shape; None where nobody knows it, which
                suits all elements but those whose torque depends on it.
        """
        return low, high

    def loss(self, joint_side: ShaftSeries) -> Array | None:
        """Return the dissipated power (N, J) [W] from the element's own law, or None.

        At rest the torque of the joint side is the one that holds.
        """
        return None

    def stored(self, joint_side: ShaftSeries) -> Array | None:
        """Return the rate of energy stored in the element (N, J) [W], or None; as for `loss`."""
        return None

    def drawn(self, torque: Array, velocity: Array, direction: Array) -> Scalars:
        """Return the power that the element itself draws from the supply [W]; none as a rule.

        All are of the joint side, of any shape: torque, at rest the one that holds [N*m], velocity
        [rad/s] and direction, zero at rest.
        """
        return 0.0

    @property
    def gearing(self) -> Scalars:
        """How many times faster the motor side turns."""
        return 1.0
