"""The element: one law between two neighbouring shafts of an actuator."""

from dataclasses import dataclass

import numpy as np

from actuators.arrays import Array, Scalars
from actuators.shaft import ShaftSeries


@dataclass(frozen=True, eq=False)
class Element:
    """What every element of a chain answers, vectorised over samples and joints.

    Elements are listed from the joint to the supply. Each has a joint side and a motor side; this
    one passes everything on, and a law overrides what it does otherwise: `added` where it takes or
    gives torque, `inverse` and `forward` where it changes the motion or asks for the load.
    Subclasses are frozen dataclasses; a parameter is one number for all joints or one per joint
    (J,). A law that an alternative does not have is simply not in its list.

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

    def holding(
        self, low: Array, high: Array, position: Array | None = None
    ) -> tuple[Array, Array]:
        """Return the motor-side torques that hold some joint-side torque at standstill.

        Args:
            low: Lower ends of the joint-side intervals [N*m], any shape.
            high: Upper ends [N*m], same shape.
            position: Of the joint-side shaft [rad], same shape; None where nobody knows it, which
                suits all elements but those whose torque depends on it.

        Returns:
            Lower and upper ends on the motor side [N*m].
        """
        return low, high

    def loss(self, joint_side: ShaftSeries) -> Array | None:
        """Return the dissipated power (N, J) [W] from the element's own law, or None.

        Args:
            joint_side: Series on the joint side; at rest its torque is the one that holds.
        """
        return None

    def stored(self, joint_side: ShaftSeries) -> Array | None:
        """Return the rate of energy stored in the element (N, J) [W], or None; as for `loss`."""
        return None

    def drawn(self, torque: Array, velocity: Array, direction: Array) -> Scalars:
        """Return the power that the element itself draws from the supply [W]; none as a rule.

        Args:
            torque: On the joint side; at rest the one that holds [N*m], any shape.
            velocity: Of the joint side [rad/s], same shape.
            direction: Zero at rest, same shape.
        """
        return 0.0

    @property
    def gearing(self) -> Scalars:
        """How many times faster the motor side turns."""
        return 1.0
