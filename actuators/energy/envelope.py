"""The region of the plane of speed and torque in which a motor can work at all.

It is bounded by the supply's voltage, |R I + k velocity| <= U, the peak current, |k I| <= k I_peak,
and the permitted speed: three pairs of parallel lines, so the region is a convex polygon. The
continuous current bounds a root mean square and no instant; it is no edge of the region.
"""

import numpy as np

from actuators.arrays import Array
from actuators.chain import DCMotor


def operating_region(motor: DCMotor, *, joint: int = 0, reach: tuple[float, float]) -> Array:
    """Return the corners of the region, counterclockwise, (M, 2): speed [rad/s], torque [N*m].

    Args:
        motor: Its constants and limits; a limit may be infinite.
        joint: Column, where the motor's constants differ by joint.
        reach: Largest speed [rad/s] and torque [N*m] of interest, where no limit is nearer.
    """
    constant, resistance = (
        float(np.ravel(x)[joint if np.size(x) > 1 else 0])
        for x in (motor.torque_constant, motor.resistance)
    )
    speed = min(motor.max_speed, reach[0])
    torque = min(motor.peak_current * constant, reach[1])
    corners = np.array([[-speed, -torque], [speed, -torque], [speed, torque], [-speed, torque]])
    if np.isfinite(motor.supply_voltage):
        # |voltage| <= supply as two half planes: normal . (speed, torque) <= supply.
        normal = np.array([constant, resistance / constant])
        for sign in (1.0, -1.0):
            corners = _clipped(corners, sign * normal, motor.supply_voltage)
    return corners


def _clipped(corners: Array, normal: Array, bound: float) -> Array:
    """The part of a convex polygon where normal . corner <= bound."""
    above = corners @ normal - bound
    kept = []
    for i, (corner, over) in enumerate(zip(corners, above, strict=True)):
        previous, before = corners[i - 1], above[i - 1]
        if (over > 0) != (before > 0):
            kept.append(previous + (corner - previous) * before / (before - over))
        if over <= 0:
            kept.append(corner)
    return np.array(kept)
