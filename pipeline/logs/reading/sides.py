"""On which side of the gear positions were measured: at the joint, at the motor, or on both."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from actuators.arrays import Array
from pipeline.logs.errors import LogFormatError
from pipeline.logs.reading.expected import Expected

#: Difference from a stated gear ratio, relative, from which the two positions contradict it.
_CONTRADICTS: Final = 0.05
#: How much a joint must move for its two positions to tell their ratio [rad].
_LEAST_MOTION: Final = 0.05


_ALONE: Final = (
    "has a motor-side position alone, other joints have a joint-side one: what its gear winds up "
    "or plays is taken for the joint's motion"
)


class Sides(NamedTuple):
    """Positions brought to the joint's side."""

    #: Of the joint where that was measured, else of the motor over the ratio, (N, J).
    position: Array
    #: Of the motor over the ratio where both were measured, shape (N, J), NaN for joints with one
    #: position; None where the log has one kind of position.
    motor: Array | None
    source: str  #: ``"motor"`` where every position is the motor's, else ``"joint"``.
    remarks: Mapping[str, str]  #: Joint to what a reader should know about its positions.


def sides_of(
    joint: Array | None,
    motor: Array | None,
    expected: Expected,
    ratio: Mapping[str, float],
    where: str,
) -> Sides:
    """Decide which position of each joint is its own.

    A gear ratio comes from the mapping, else from the actuator, else from the two positions
    themselves; a motor's position alone without any of them is taken as divided by the ratio
    already where it stays within the joint's limits.

    Args:
        joint: Joint-side positions, shape (N, J) [rad], NaN columns where there are none; or None.
        motor: Motor-side positions as logged, likewise.
        expected: Names, limits, and gear ratios of the actuator.
        ratio: Gear ratios the mapping states, signed.
        where: File, for messages.

    Raises:
        LogFormatError: A motor's position needs a gear ratio that nothing states.
    """
    if motor is None:
        assert joint is not None
        return Sides(joint, None, "joint", {})
    own = np.full_like(motor, np.nan) if joint is None else joint
    has_own = np.asarray(np.isfinite(own).any(axis=0))
    has_motor = np.asarray(np.isfinite(motor).any(axis=0))
    divided = np.full_like(motor, np.nan)
    remarks: dict[str, str] = {}
    for k, name in enumerate(expected.joints):
        if not has_motor[k]:
            continue
        seen = _slope(motor[:, k], own[:, k]) if has_own[k] else None
        known = ratio.get(name, None if expected.ratio is None else float(expected.ratio[k]))
        n, remark = _ratio(known, seen)
        if n is None and not _within_limits(motor[:, k], expected, k):
            raise LogFormatError(
                f"{where}: {name}__motor_position_rad leaves the joint's limits and no gear ratio "
                "is known; give actuators, or the ratio under [gear_ratio] in a mapping file"
            )
        if n is None:
            remark = (
                "no gear ratio is known: taken as divided by it already, since it stays within "
                "the joint's limits; else state it under [gear_ratio] in a mapping file"
            )
        divided[:, k] = motor[:, k] / (n or 1.0)
        if remark:
            remarks[name] = remark
    mixed = joint is not None  # by its columns: a piece of a log may hold no number of one
    remarks |= {expected.joints[k]: _ALONE for k in np.flatnonzero(mixed & has_motor & ~has_own)}
    both = has_own & has_motor
    position = np.where(has_own, own, divided)
    side = np.where(both, divided, np.nan) if mixed else None
    return Sides(position, side, "joint" if mixed else "motor", remarks)


def _ratio(known: float | None, seen: float | None) -> tuple[float | None, str]:
    """The ratio to divide by, and what is odd about it."""
    if seen is None:
        return known, ""
    if known is None:
        return seen, f"gear ratio {seen:.6g} from the two positions; no file states it"
    if abs(seen / known - 1.0) <= _CONTRADICTS:
        return known, ""
    if abs(seen - 1.0) <= _CONTRADICTS:
        return 1.0, "the motor's position is divided by the gear ratio already: taken as it is"
    return seen, f"gear ratio {seen:.6g} by the two positions, {known:.6g} by the files"


def _slope(motor: Array, joint: Array) -> float | None:
    """Turns of the motor per turn of the joint; None where the joint hardly moves."""
    good = np.isfinite(motor) & np.isfinite(joint)
    if good.sum() < 2 or np.ptp(joint[good]) < _LEAST_MOTION:
        return None
    x = joint[good] - joint[good].mean()
    return float(x @ (motor[good] - motor[good].mean()) / (x @ x))


def _within_limits(motor: Array, expected: Expected, k: int) -> bool:
    q = motor[np.isfinite(motor)]
    low, high = float(expected.lower[k]), float(expected.upper[k])
    if not (np.isfinite(low) and np.isfinite(high)):
        low, high = -np.pi, np.pi
    margin = 0.05 * (high - low)
    return bool(q.min() >= low - margin and q.max() <= high + margin)
