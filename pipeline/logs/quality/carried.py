"""Checks of one channel against another: feet that carry the weight, a torque late on its current.

Both need no model of the robot but its mass.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.logs.quality.finding import Findings
from pipeline.logs.quality.skew import skew
from pipeline.logs.quality.unit_check import column_name
from pipeline.logs.reading.log import Log

Array = NDArray[np.float64]

#: Share of the weight that feet may carry more or less on average: sensors err by some per cent.
_WEIGHT: Final = 0.1
#: Correlation of torque and current from which their shift means something.
_ALIKE: Final = 0.9
_LONGEST: Final = 0.1
_ROWS: Final = 50_000


def feet_carry(log: Log, weight: float | None, found: Findings) -> None:
    """Vertical forces of all feet, on average, against the robot's weight [N].

    Over a log in which the robot neither climbs nor falls, the mean of their sum is its weight.
    """
    if log.foot_force is None or weight is None or weight <= 0:
        return
    total = np.nansum(log.foot_force[..., 2], axis=1)
    share = float(np.mean(total)) / weight
    detail = f"on average the feet carry {share:.3g} of the robot's weight of {weight:.4g} N"
    if abs(share - 1.0) <= _WEIGHT:
        found.note("", "feet_carry", share, "1", "ok", detail)
        return
    idle = [
        foot
        for k, foot in enumerate(log.feet)
        if np.nanmax(np.abs(log.foot_force[:, k, 2]), initial=0.0) < 0.02 * weight
    ]
    if share < 0:
        why = "their sign is turned: forces are those of the ground on the robot"
    elif idle:
        why = f"{', '.join(idle)} never {'carry' if len(idle) > 1 else 'carries'} anything"
    else:
        why = "wrong unit, a load that the model lacks, or the robot hangs or leans on something"
    found.note("", "feet_carry", share, "1", "warning", f"{detail}: {why}")


def torque_on_time(log: Log, dt: float, found: Findings) -> None:
    """Shift between the torque and the current of the same motor."""
    if log.torque is None or log.current is None:
        return
    rows = slice(0, _ROWS)
    for j, joint in enumerate(log.joints):
        seen = skew(log.torque[rows, j], log.current[rows, j], dt, longest=_LONGEST)
        if seen is None or abs(seen.correlation) < _ALIKE:
            continue
        late = abs(seen.lag) > max(0.25 * dt, 4 * seen.lag_error)
        word = "behind" if seen.lag > 0 else "ahead of"
        detail = f"{1e3 * abs(seen.lag):.3g} ms {word} the current of the same motor"
        column = column_name(joint, "torque")
        found.note(column, "late", seen.lag, "s", "warning" if late else "ok", detail)
