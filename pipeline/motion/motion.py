"""A motion as a list of segments with closed ends."""

from dataclasses import dataclass, field

import numpy as np

from actuators.arrays import Array


def level_ground() -> Array:
    """The normal of level ground in the world frame, shape (3,)."""
    return np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Segment:
    """A stretch of motion during which the same feet stand on the ground.

    Both ends belong to the segment: the last sample of one and the first of the next share their
    time but hold the left and the right limit, because forces jump at contact events.
    """

    name: str  #: For people, e.g. ``"support of lf, lr, rm"``.
    time: Array  #: Increasing, shape (N,) [s].
    configuration: Array  #: Pinocchio configuration, shape (N, nq) [m, quaternion, rad].
    velocity: Array  #: Pinocchio tangent velocity, shape (N, nv) [m/s, rad/s].
    acceleration: Array  #: Its derivative, shape (N, nv) [m/s^2, rad/s^2].
    stance: tuple[str, ...]  #: Names of the legs whose feet carry load.
    #: Unit vector in the world frame (z opposes gravity) that points out of the ground, shape (3,);
    #: the standing feet rest on one plane with this normal.
    ground_normal: Array = field(default_factory=level_ground)
    #: Where the feet should be in the base frame, shape (N, L, 3) [m]; None where the motion was
    #: not made from feet.
    foot_target: Array | None = None
    #: Whether it stands on two feet, whose forces leave the moment about their line open.
    rocks: bool = False


@dataclass(frozen=True)
class Motion:
    """Segments in order of time."""

    segments: tuple[Segment, ...]  #: At least one; each starts where the one before ended.

    @property
    def mean_speed(self) -> float:
        """Of a floating base, straight from its first place to its last [m/s]."""
        first, last = self.segments[0], self.segments[-1]
        way = last.configuration[-1, :3] - first.configuration[0, :3]
        return float(np.linalg.norm(way) / (last.time[-1] - first.time[0]))
