"""The abstract element: one law between two neighbouring shafts of an actuator."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

from actuators.arrays import FloatArray, Scalars
from actuators.shaft import ShaftSeries


@dataclass(frozen=True, eq=False)
class Element(ABC):
    """What every element of a chain answers, vectorised over samples and joints.

    Elements are listed from the joint to the supply. Each has a joint side and a motor side.
    Subclasses are frozen dataclasses; a parameter is one number for all joints or one per joint
    (J,). A law that an alternative does not have is simply not in its list.

    Every element is local: a sample of a joint depends on no other sample and no other joint. What
    is not (a warming winding, wind-up, a coupled wrist) stands beside the row of elements, in
    `pipeline.machine`.

    Attributes:
        name: Unique in its chain; names the row of its loss.
    """

    name: str

    @abstractmethod
    def moving(self, joint_side: ShaftSeries) -> ShaftSeries:
        """Return what the motor side needs (inverse).

        Where `direction` is zero, Coulomb friction is zero here; the chain replaces such samples
        by `holding`.
        """

    @abstractmethod
    def driving(self, motor_side: ShaftSeries) -> ShaftSeries:
        """Return what reaches the joint side (forward), all motion being known.

        It inverts `moving`: load-dependent friction is solved exactly, being piecewise linear.
        At rest (`direction` zero) the same limit as in `moving` applies; a forward simulation
        asks `holding` first.
        """

    @abstractmethod
    def holding(self, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the motor-side torques that hold some joint-side torque at standstill.

        Args:
            low: Lower ends of the joint-side intervals [N*m], any shape.
            high: Upper ends [N*m], same shape.

        Returns:
            Lower and upper ends on the motor side [N*m].
        """

    def loss(self, joint_side: ShaftSeries, motor_side: ShaftSeries) -> FloatArray | None:
        """Return the dissipated power (N, J) [W] from the element's own law, or None.

        Args:
            joint_side: Series on the joint side.
            motor_side: Series on the motor side.
        """
        return None

    def stored(self, joint_side: ShaftSeries, motor_side: ShaftSeries) -> FloatArray | None:
        """Return the rate of energy stored in the element (N, J) [W], or None."""
        return None

    @property
    def gearing(self) -> Scalars:
        """How many times faster the motor side turns."""
        return 1.0
