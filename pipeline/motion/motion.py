"""A motion as a list of segments with closed ends, and the plane on which it takes place."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from actuators.arrays import Array
from actuators.errors import LegwattError


def level_ground() -> Array:
    """The normal of level ground in the world frame, shape (3,)."""
    return np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Segment:
    """A stretch of motion during which the same feet stand on the ground.

    Both ends belong to the segment: the last sample of one and the first of the next share their
    time but hold the left and the right limit, because forces jump at contact events.

    Raises:
        LegwattError: What no later stage could compute with: no samples, time that does not
            increase, lengths that differ, numbers that are not finite, a normal that is none.
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

    def __post_init__(self) -> None:
        normal, n = self.ground_normal, self.time.size
        if not (normal.shape == (3,) and abs(np.linalg.norm(normal) - 1) < 1e-9 and normal[2] > 0):
            self._refuse(": ground_normal must be a unit vector that points up")
        if n == 0:
            self._refuse(" has no samples; at least 1 is needed")
        late = np.diff(self.time) <= 0
        if late.any():
            row = int(late.argmax()) + 1
            self._refuse(f", sample {row}: time does not increase; sort the samples")
        for label in ("time", "configuration", "velocity", "acceleration"):
            values = getattr(self, label)
            if len(values) != n:
                self._refuse(f": {label} has {len(values)} samples, time has {n}")
            finite = np.isfinite(values).reshape(n, -1).all(axis=1)
            if not finite.all():
                self._refuse(f", sample {int(finite.argmin())}: {label} is not finite")

    def _refuse(self, words: str) -> None:
        raise LegwattError(f"segment '{self.name}'{words}")


@dataclass(frozen=True)
class Motion:
    """Segments in order of time.

    Raises:
        LegwattError: There are none.
    """

    segments: tuple[Segment, ...]  #: At least one; each starts where the one before ended.
    #: Duration after which the motion repeats [s], or None when it does not.
    period: float | None = None

    def __post_init__(self) -> None:
        if not self.segments:
            raise LegwattError("the motion has no segments; at least 1 is needed")

    @property
    def samples(self) -> int:
        """Number of samples over all segments."""
        return sum(segment.time.size for segment in self.segments)

    @property
    def mean_speed(self) -> float:
        """Of a floating base, straight from its first place to its last [m/s]."""
        first, last = self.segments[0], self.segments[-1]
        way = last.configuration[-1, :3] - first.configuration[0, :3]
        return float(np.linalg.norm(way) / (last.time[-1] - first.time[0]))


@dataclass(frozen=True)
class Ground:
    """An inclined plane under the robot."""

    forward: float = 0.0  #: Angle by which the ground rises along the world's x axis [rad].
    left: float = 0.0  #: Angle by which it rises along the world's y axis [rad].

    @property
    def level(self) -> bool:
        """Whether the plane is horizontal."""
        return self.forward == 0 and self.left == 0

    @cached_property
    def rotation(self) -> Array:
        """From the plane's axes to the world's, shape (3, 3).

        z is the normal; x lies in the plane above the world's x axis, so that walking straight
        ahead on ground that rises forward is walking straight uphill.
        """
        rise = np.array([np.tan(self.forward), np.tan(self.left)])
        normal = np.array([-rise[0], -rise[1], 1.0]) / np.sqrt(1 + rise @ rise)
        ahead = np.array([np.cos(self.forward), 0.0, np.sin(self.forward)])
        return np.stack([ahead, np.cross(normal, ahead), normal], axis=1)

    @property
    def normal(self) -> Array:
        """Unit vector out of the ground in the world frame, shape (3,)."""
        return self.rotation[:, 2].copy()
