"""Knots of curves over the position."""

from __future__ import annotations

import numpy as np

from pipeline.logs.prepared.measurement import Measurement


def place_knots(m: Measurement, joint: int, count: int) -> tuple[float, ...]:
    """Even knots over the travel of a joint [rad]; none where it stands."""
    low, high = float(m.q[:, joint].min()), float(m.q[:, joint].max())
    return tuple(np.linspace(low, high, count).tolist()) if high > low + 1e-6 else ()
