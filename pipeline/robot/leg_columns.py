"""Which columns of a robot's joints belong to which leg, and the way between the two layouts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array


@dataclass(frozen=True, eq=False)
class LegColumns:
    """Legs of up to K joints among J columns; joints outside the legs belong to none."""

    #: Of each leg's joints, shape (L, K). Where a leg has fewer, its last joint's column stands
    #: once more: reading there is harmless, for the kinematics pays no heed to it; writing goes
    #: through `by_joint` or `of`.
    columns: NDArray[np.intp]
    counts: NDArray[np.intp]  #: Joints of each leg, shape (L,).
    size: int  #: J, joints outside the legs included.

    @cached_property
    def real(self) -> NDArray[np.bool_]:
        """Which of `columns` are a leg's own, shape (L, K)."""
        real: NDArray[np.bool_] = np.arange(self.columns.shape[1]) < self.counts[:, None]
        return real

    @cached_property
    def _in_a_row(self) -> bool:
        every = np.arange(self.size, dtype=np.intp)
        return bool(self.real.all() and np.array_equal(self.columns.ravel(), every))

    @cached_property
    def places(self) -> NDArray[np.intp]:
        """Leg of every column and the joint's number in it, shape (J, 2); -1 outside the legs."""
        out = np.full((self.size, 2), -1, dtype=np.intp)
        out[self.columns[self.real]] = np.argwhere(self.real)
        return out

    def of(self, leg: int) -> NDArray[np.intp]:
        """The columns of one leg, as many as it has joints."""
        return self.columns[leg, : self.counts[leg]]

    def by_leg(self, values: Array) -> Array:
        """Joints' values by leg, zero where a leg has no joint: (N, J) to (N, L, K)."""
        if self._in_a_row:
            return values.reshape(values.shape[0], *self.columns.shape)
        return np.where(self.real, values[:, self.columns], 0.0)

    def by_joint(self, values: Array, elsewhere: Array | float = 0.0) -> Array:
        """Legs' values by joint: (N, L, K) to (N, J).

        `values`: by leg; what stands where a leg has no joint is dropped. `elsewhere`: for joints
        outside the legs, shape (J,) or one number.
        """
        if self._in_a_row:
            return values.reshape(values.shape[0], self.size)
        out = np.empty((values.shape[0], self.size))
        out[:] = elsewhere
        out[:, self.columns[self.real]] = values[:, self.real]
        return out


def leg_columns(joints: Sequence[str], legs: Sequence[Sequence[str]]) -> LegColumns:
    """Where the legs' joints stand among all."""
    at = {name: k for k, name in enumerate(joints)}
    depth = max((len(leg) for leg in legs), default=0)
    columns = np.array(
        [[at[name] for name in (*leg, *[leg[-1]] * (depth - len(leg)))] for leg in legs],
        dtype=np.intp,
    ).reshape(len(legs), depth)
    counts = np.array([len(leg) for leg in legs], dtype=np.intp)
    return LegColumns(columns, counts, len(joints))
