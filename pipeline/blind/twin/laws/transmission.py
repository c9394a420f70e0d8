"""Spring with backlash between a motor and its link (two-mass joint)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def transmitted_torque(
    twist: Array, twist_rate: Array, stiffness: Array, damping: Array, gap: Array
) -> Array:
    """Torque that a transmission with backlash passes from motor to link.

    Args:
        twist: Motor angle less link angle, both at the joint [rad], shape (E,).
        twist_rate: Its rate [rad/s], shape (E,).
        stiffness: [N*m/rad], shape (E,).
        damping: Of the flanks in contact [N*m*s/rad], shape (E,).
        gap: Whole width of the backlash [rad], shape (E,).

    Returns:
        [N*m], shape (E,); zero inside the gap. Flanks push and never pull.
    """
    half = 0.5 * gap
    wound = twist - np.minimum(np.maximum(twist, -half), half)
    elastic = stiffness * wound
    torque = elastic + np.where(wound == 0.0, 0.0, damping * twist_rate)
    pulls = (torque * elastic < 0) & (gap > 0)
    result: Array = np.where(pulls, 0.0, torque)
    return result
