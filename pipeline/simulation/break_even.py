"""Which share of time standing makes an actuator pay that costs more walking."""

from __future__ import annotations

import math


def break_even(extra: float, saved: float) -> float:
    """Fraction of time standing at which two actuators cost the same; above it the second pays.

    (1 - f) extra = f saved, both over the same time (Fig. 21 of the paper).

    Args:
        extra: What the second one costs more walking [J, or W].
        saved: What it costs less standing for as long [J, or W].

    Returns:
        f, or NaN where it never costs more walking, or saves nothing standing.
    """
    if extra <= 0 or saved <= 0:
        return math.nan
    return extra / (extra + saved)
