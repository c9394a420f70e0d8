"""Turning feet, wrenches and forces between base, ground and world over one segment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.dynamics.contact_forces import ground_frame
from pipeline.motion.motion import Segment
from pipeline.robot.robot import Robot

Array = NDArray[np.float64]
ALL = slice(None)


class GroundFrames:
    """Base, ground and world along a segment.

    The ground's frame has its origin in the base's and its z axis along the ground's normal.

    Args:
        robot: With a floating base.
        segment: The motion.
    """

    def __init__(self, robot: Robot, segment: Segment) -> None:
        rotation = robot.base_rotation(segment.configuration)  # base -> world, or None
        self._ground = ground_frame(segment.ground_normal)  # world -> ground, or None
        self._base = rotation  # base -> ground
        if self._ground is not None:
            self._base = (
                np.broadcast_to(self._ground, (segment.time.size, 3, 3))
                if rotation is None
                else self._ground @ rotation
            )

    @property
    def same(self) -> bool:
        """Whether all three have the same axes throughout."""
        return self._base is None

    def to_ground(self, vectors: Array, rows: slice = ALL) -> Array:
        """From the base's axes, shape (n, K, 3)."""
        if self._base is None:
            return vectors
        return np.einsum("nij,nfj->nfi", self._base[rows], vectors)

    def wrench_to_ground(self, wrench: Array, rows: slice = ALL) -> Array:
        """Force and moment from the base's axes, shape (n, 6)."""
        if self._base is None:
            return wrench
        turned = np.einsum("nij,nkj->nki", self._base[rows], wrench.reshape(-1, 2, 3))
        return turned.reshape(-1, 6)

    def to_base(self, vectors: Array, rows: slice = ALL) -> Array:
        """From the ground's axes, shape (n, K, 3)."""
        if self._base is None:
            return vectors
        return np.einsum("nji,nfj->nfi", self._base[rows], vectors)

    def to_world(self, vectors: Array) -> Array:
        """From the ground's axes, shape (n, K, 3)."""
        return vectors if self._ground is None else vectors @ self._ground
