"""Winding temperature over the day, the modes in their order, day after day.

By the two-body model of each motor (`actuators.elements.two_body`), with the resistance that warms
along: where that feeds itself without end, the winding runs away and its temperature is infinite.
Surroundings are at the sheets' 25 degC. Heat of friction is left in gears and bearings.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from actuators.elements.two_body import REFERENCE_K, Temperatures, TwoBody
from actuators.supply.battery import HOUR
from pipeline.choice.parts.designs import Designs

Array = NDArray[np.float64]


def day(designs: Designs, hours: Sequence[float], copper: Array) -> Temperatures:
    """Temperatures that the modes lead to.

    Args:
        designs: D of them, or one.
        hours: Of each mode, (M,) [h].
        copper: Mean of R I^2 with the sheet's R in each mode, (D, M), or (J, M) of one [W].
    """
    body = TwoBody(
        designs.winding_to_housing,
        designs.housing_to_ambient,
        designs.winding_time,
        designs.housing_time,
    )
    with np.errstate(over="ignore", invalid="ignore"):  # where it runs away
        return body.day(HOUR * np.asarray(hours), copper)


def share(designs: Designs, hours: Sequence[float], copper: Array) -> Array:
    """Share of the permitted rise above 25 degC that is reached, (D,); infinite if running away.

    Arguments as for `day`.
    """
    peak = np.nan_to_num(day(designs, hours, copper).peak, nan=np.inf, posinf=np.inf)
    return np.asarray((peak - REFERENCE_K) / (designs.winding_limit - REFERENCE_K))
