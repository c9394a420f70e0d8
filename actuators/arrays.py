"""Array types of the actuator room and the checks that every law shares."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from actuators.errors import UnphysicalElementError

FloatArray: TypeAlias = NDArray[np.float64]
Scalars: TypeAlias = float | FloatArray  # one number for all joints, or one per joint (J,)


def require(condition: object, where: str, remedy: str) -> None:
    """Raise unless a condition holds for every joint.

    Args:
        condition: Boolean or boolean array (J,); NaN compares false and so is refused.
        where: The element.
        remedy: What must hold.

    Raises:
        UnphysicalElementError: The condition fails for at least one joint.
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


def least_magnitude(low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the value of least magnitude in each interval [low, high]."""
    value: FloatArray = np.clip(0.0, low, high)
    return value
