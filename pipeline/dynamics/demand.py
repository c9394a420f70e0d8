"""What a motion demands of the actuated joints."""

from __future__ import annotations

from dataclasses import dataclass

from actuators.arrays import Array


@dataclass(frozen=True)
class JointDemand:
    """Motion and torque of the actuated joints over one segment."""

    joints: tuple[str, ...]  #: Names, in the robot file's order; they label the columns.
    time: Array  #: Shape (N,) [s].
    position: Array  #: Shape (N, J) [rad].
    velocity: Array  #: Shape (N, J) [rad/s].
    acceleration: Array  #: Shape (N, J) [rad/s^2].
    torque: Array  #: What the actuator must apply to the joint, shape (N, J) [N*m].
    segment: str  #: The segment's name.
