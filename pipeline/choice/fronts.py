"""Fronts of power and mass: what no other design beats in both, and robots as sums of groups."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]


def front(power: Array, mass: Array) -> Index:
    """Designs that none beats in power and mass, from the least power on.

    Args:
        power: (D,) [W].
        mass: (D,) [kg].
    """
    order = np.lexsort((mass, power))
    lightest = np.minimum.accumulate(mass[order])
    first = np.ones(len(order), dtype=np.bool_)
    first[1:] = mass[order][1:] < lightest[:-1]
    return np.asarray(order[first])


def merged(fronts: Sequence[tuple[Array, Array]]) -> tuple[Array, Array, Index]:
    """The front of all sums of one design of each group.

    Groups share nothing but power and mass, which add: a sum that holds a design beaten in its own
    group is beaten itself, so that sums of fronts, pair by pair, lose nothing.

    Args:
        fronts: Of each group, power (F,) [W] and mass (F,) [kg].

    Returns:
        Power (P,), mass (P,), and which design of each group's front a point takes (P, groups).
    """
    power, mass = np.zeros(1), np.zeros(1)
    taken = np.zeros((1, 0), dtype=np.intp)
    for p, m in fronts:
        both = (power[:, None] + p).ravel(), (mass[:, None] + m).ravel()
        kept = front(*both)
        before, own = np.unravel_index(kept, (len(power), len(p)))
        power, mass = both[0][kept], both[1][kept]
        taken = np.column_stack([taken[before], own])
    return power, mass, taken
