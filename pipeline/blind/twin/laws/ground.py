"""Compliant ground under point feet: Hunt-Crossley normal force and elasto-plastic friction.

Hunt and Crossley, J. Appl. Mech. 42(2), 1975: N = k d (1 + a dd/dt), which starts without a jump
at touch-down. Tangentially each foot drags a spring that slips where it would exceed mu N.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Ground:
    """Horizontal ground (or a slope, in its own frame) at z = 0 and the rubber of the feet.

    Attributes:
        stiffness: k [N/m].
        dissipation: a [s/m].
        tangential_stiffness: [N/m].
        tangential_damping: [N*s/m], fading in with the first millimetre of penetration.
        friction: mu [1].
    """

    stiffness: float = 4e4
    dissipation: float = 4.0
    tangential_stiffness: float = 1.5e4
    tangential_damping: float = 300.0
    friction: float = 0.7


class Footing:
    """The state of the feet on a `Ground`."""

    def __init__(self, ground: Ground, feet: int, dt: float) -> None:
        self._ground = ground
        self._dt = dt
        self._drag = np.zeros((feet, 2))  # [m]

    def forces(self, position: Array, velocity: Array) -> Array:
        """Forces of the ground on the feet over one step.

        Args:
            position: Of the foot points [m], shape (F, 3).
            velocity: [m/s], shape (F, 3).

        Returns:
            [N], shape (F, 3); feet in the air feel none.
        """
        g = self._ground
        depth = np.maximum(-position[:, 2], 0.0)
        normal = np.maximum(g.stiffness * depth * (1 - g.dissipation * velocity[:, 2]), 0.0)
        touching = normal > 0
        slip = velocity[:, :2]
        drag = np.where(touching[:, None], self._drag + slip * self._dt, 0.0)
        damping = g.tangential_damping * np.minimum(depth / 1e-3, 1.0)
        pull = -g.tangential_stiffness * drag - damping[:, None] * slip
        size = np.sqrt(pull[:, 0] ** 2 + pull[:, 1] ** 2)
        limit = g.friction * normal
        share = np.where(size > limit, limit / np.maximum(size, 1e-12), 1.0)
        pull = pull * share[:, None]
        slips = share < 1.0
        # A slipping foot keeps the spring that gives just the force at the limit.
        kept = -(pull + damping[:, None] * slip) / g.tangential_stiffness
        self._drag = np.where((slips & touching)[:, None], kept, drag)
        return np.column_stack([pull, normal])
