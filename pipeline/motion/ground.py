"""The ground: a plane, level or inclined in both directions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from actuators.arrays import Array


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
        if self.level:
            return np.eye(3)
        rise = np.array([np.tan(self.forward), np.tan(self.left)])
        normal = np.array([-rise[0], -rise[1], 1.0]) / np.sqrt(1 + rise @ rise)
        ahead = np.array([np.cos(self.forward), 0.0, np.sin(self.forward)])
        return np.stack([ahead, np.cross(normal, ahead), normal], axis=1)

    @property
    def normal(self) -> Array:
        """Unit vector out of the ground in the world frame, shape (3,)."""
        return self.rotation[:, 2].copy()
