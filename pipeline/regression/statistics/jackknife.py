"""Standard errors from leaving out one block at a time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def standard_error(replicas: Array) -> Array:
    """Standard error from leaving out one block at a time (B, ...) (Efron and Tibshirani, 11)."""
    b = len(replicas)
    d = replicas - replicas.mean(axis=0)
    out: Array = np.sqrt((b - 1) / b * (d**2).sum(axis=0))
    return out
