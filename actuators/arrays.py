"""Types of arrays for all rooms, and what the numbers of a law must keep to."""

import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from actuators.errors import UnphysicalElementError

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]
Index: TypeAlias = NDArray[np.intp]
Scalars: TypeAlias = float | Array  # one number for all joints, or one per joint (J,)

#: Rule of a number to what holds, which is false for NaN, and how it is said.
_RULES: Final[Mapping[str, tuple[Callable[[Any], Any], str]]] = {
    "": (lambda x: (x >= 0.0) & (x < math.inf), "must be finite and not negative"),
    "signed": (lambda x: (x > -math.inf) & (x < math.inf), "must be finite"),
    "positive": (lambda x: (x > 0.0) & (x < math.inf), "must be positive and finite"),
    "limit": (lambda x: x > 0.0, "must be > 0"),
    "share": (lambda x: (x >= 0.0) & (x < 1.0), "must be 0 or more and below 1"),
}


class Numbers:
    """A dataclass of numbers, which must be finite and not negative unless a rule says otherwise.

    Raises:
        UnphysicalElementError: On construction, where a number breaks its rule for some joint.
    """

    rules: ClassVar[Mapping[str, str]] = {}  #: Name to `signed`, `positive`, `limit` or `share`.

    def __post_init__(self) -> None:
        where = getattr(self, "name", type(self).__name__)
        for name, value in vars(self).items():
            if not isinstance(value, str | tuple):
                holds, words = _RULES[self.rules.get(name, "")]
                require(holds(value), where, f"{name} {words}")


def require(condition: object, where: str, remedy: str) -> None:
    """Raise unless a condition of the element `where` holds for every joint.

    Raises:
        UnphysicalElementError: Says that the `remedy` must hold.
    """
    if condition is not True and not np.all(np.asarray(condition)):
        raise UnphysicalElementError(f"element '{where}': {remedy}")


def least_magnitude(low: Array, high: Array) -> Array:
    """Return the value of least magnitude in each interval [low, high]."""
    return np.asarray(np.clip(0.0, low, high))
