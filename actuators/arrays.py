"""Types of arrays for all rooms, and the checks that every law of an actuator shares."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from actuators.errors import UnphysicalElementError

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]
Index: TypeAlias = NDArray[np.intp]
Scalars: TypeAlias = float | Array  # one number for all joints, or one per joint (J,)


def require(condition: object, where: str, remedy: str) -> None:
    """Raise unless a condition of the element `where` holds for every joint; NaN does not.

    Raises:
        UnphysicalElementError: Says that the `remedy` must hold.
    """
    if not np.all(np.asarray(condition)):
        raise UnphysicalElementError(f"element '{where}': {remedy}")


def require_non_negative(where: str, **values: Scalars) -> None:
    """Raise unless every value is finite and at least zero, for every joint.

    Raises:
        UnphysicalElementError: A value is negative, infinite or NaN.
    """
    for name, value in values.items():
        array = np.asarray(value, dtype=float)
        require(
            np.isfinite(array) & (array >= 0.0), where, f"{name} must be finite and not negative"
        )


def least_magnitude(low: Array, high: Array) -> Array:
    """Return the value of least magnitude in each interval [low, high]."""
    return np.asarray(np.clip(0.0, low, high))
