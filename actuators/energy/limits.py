"""Where a motion asks more of a motor than its data sheet permits.

The region of the plane of speed and torque in which a motor can work at all is bounded by the
supply's voltage, |R I + k velocity| <= U, the peak current, |k I| <= k I_peak, and the permitted
speed: three pairs of parallel lines, so the region is a convex polygon. The continuous current
bounds a root mean square and no instant; it is no edge of the region.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from actuators.arrays import Array
from actuators.chain import ChainResult, HoldingResult
from actuators.energy.energy import duration, weighted
from actuators.shaft import DCMotor


class LimitRow(NamedTuple):
    """One quantity of one joint's motor against its limit, over the whole series."""

    joint: str  #: Name.
    quantity: str  #: speed, voltage, current or rms_current.
    unit: str  #: rad/s, V or A.
    limit: float  #: Permitted magnitude.
    peak: float  #: Greatest magnitude; for rms_current the root mean square.
    peak_time: float  #: When the peak occurs [s]; start of the series for rms_current.
    share_over: float  #: Share of the time above the limit; for rms_current 1 or 0.
    breach: bool  #: Whether the peak exceeds the limit.


def limit_rows(result: ChainResult) -> tuple[LimitRow, ...]:
    """Return a row for every joint and limit of its motor, breached or not.

    Raises:
        LegwattError: The series spans no time.
    """
    time, span = result.joint.time, duration(result.joint.time)
    rms, rows = rms_over_time(time, result.current), []
    for j, (joint, motor) in enumerate(zip(result.joint.joints, result.motors, strict=True)):
        for quantity, unit, limit, values in (
            ("speed", "rad/s", motor.max_speed, result.motor.velocity),
            ("voltage", "V", motor.supply_voltage, result.voltage),
            ("current", "A", motor.peak_current, result.current),
        ):
            size = np.abs(values[:, j])
            at = int(np.argmax(size))
            share = time_over(time, size, limit) / span
            row = (joint, quantity, unit, limit, float(size[at]), float(time[at]), share)
            rows.append(LimitRow(*row, breach=bool(size[at] > limit)))
        rows.append(_still(joint, "rms_current", "A", motor.continuous_current, rms[j], time[0]))
    return tuple(rows)


def standing_rows(
    holding: HoldingResult, joints: Sequence[str], motors: Sequence[DCMotor]
) -> tuple[LimitRow, ...]:
    """Return a row for every joint and limit that holding still (J,) can breach."""
    current, voltage = np.abs(holding.current), np.abs(holding.voltage)
    rows = [
        (
            _still(joint, "voltage", "V", motor.supply_voltage, voltage[j]),
            _still(joint, "current", "A", motor.peak_current, current[j]),
            _still(joint, "rms_current", "A", motor.continuous_current, current[j]),
        )
        for j, (joint, motor) in enumerate(zip(joints, motors, strict=True))
    ]
    return tuple(itertools.chain(*rows))


def _still(
    joint: str, quantity: str, unit: str, limit: float, value: float, time: float = 0.0
) -> LimitRow:
    over = bool(value > limit)
    return LimitRow(joint, quantity, unit, limit, float(value), float(time), float(over), over)


def rms_over_time(time: Array, values: Array) -> Array:
    """Return the root mean square of a piecewise linear quantity (N, J), (J,).

    Time is (N,), or (N, J) where every column has its own [s]; repeated stamps are breaks.

    Raises:
        LegwattError: The series spans no time.
    """
    duration(time)
    a, b = values[:-1], values[1:]
    square = weighted(np.diff(time, axis=0), a * a + a * b + b * b) / 3.0  # exact if linear
    return np.sqrt(np.asarray(square / (time[-1] - time[0])))


def time_over(time: Array, magnitude: Array, limit: float) -> float:
    """Return for how long a piecewise linear quantity (N,) exceeds a limit [s]."""
    if not np.isfinite(limit):
        return 0.0
    low = np.minimum(magnitude[:-1], magnitude[1:])
    high = np.maximum(magnitude[:-1], magnitude[1:])
    rise = np.where(high > low, high - low, 1.0)
    share = np.where(low > limit, 1.0, np.where(high > limit, (high - limit) / rise, 0.0))
    return float(np.diff(time) @ share)
