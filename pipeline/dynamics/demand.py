"""What a motion demands of the actuated joints."""

from __future__ import annotations

from dataclasses import dataclass

from actuators.arrays import Array


@dataclass(frozen=True)
class JointDemand:
    """Motion and torque of the actuated joints over one segment.

    Attributes:
        joints: Names, in the robot file's order; they label the columns.
        time: Shape (N,) [s].
        position: Shape (N, J) [rad].
        velocity: Shape (N, J) [rad/s].
        acceleration: Shape (N, J) [rad/s^2].
        torque: What the actuator must apply to the joint, shape (N, J) [N*m].
        segment: The segment's name.
    """

    joints: tuple[str, ...]
    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    torque: Array
    segment: str
