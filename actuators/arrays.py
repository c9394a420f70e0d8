"""Types of arrays for all packages."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]
Index: TypeAlias = NDArray[np.intp]
Scalars: TypeAlias = float | Array  # one number for all joints, or one per joint (J,)


def least_magnitude(low: Array, high: Array) -> Array:
    """Return the value of least magnitude in each interval [low, high]."""
    return np.asarray(np.clip(0.0, low, high))
