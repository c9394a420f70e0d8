"""Wide time series: `time_s`, then `<joint>__<quantity>_<unit>` for every joint or foot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reports.errors import TableError
from reports.table import Column, Table
from reports.typeset import unit_suffix

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Quantity:
    """One quantity at every joint (or foot).

    Attributes:
        name: As it stands in the header, e.g. ``"torque"``.
        unit: As people write it, e.g. ``"N*m"``; ``"1"`` leaves the header without a unit. One for
            each owner, in a tuple, where they differ.
        meaning: One clause with the sign, e.g. ``"torque the actuator applies to the joint"``.
        values: Shape (N, J).
    """

    name: str
    unit: str | tuple[str, ...]
    meaning: str
    values: Array

    def unit_of(self, owner: int) -> str:
        """Of the owner's column, counted from 0."""
        return self.unit if isinstance(self.unit, str) else self.unit[owner]


def header(owner: str, quantity: str, unit: str) -> str:
    """Header of one column, e.g. ``rm_joint_2__torque_Nm``."""
    suffix = unit_suffix(unit)
    return f"{owner}__{quantity}_{suffix}" if suffix else f"{owner}__{quantity}"


def wide_series(
    name: str,
    time: Array,
    joints: Sequence[str],
    quantities: Sequence[Quantity],
    *,
    labels: Mapping[str, tuple[Column, str]] | None = None,
    description: str = "",
) -> Table:
    """Lay out quantities at several joints as a wide table.

    Args:
        name: Of the table.
        time: Shape (N,) [s]. A time that occurs twice marks an instant at which something jumps:
            the first row is the limit from the left, the second that from the right.
        joints: Owners of the columns, J of them.
        quantities: Each with values of shape (N, J).
        labels: Columns between time and quantities, header to (values, meaning), e.g. the segment.
        description: One sentence.

    Raises:
        TableError: Shapes that do not fit, or headers that clash.
    """
    columns: dict[str, Column] = {"time_s": np.asarray(time, dtype=np.float64)}
    meanings = {"time_s": ("time; where it repeats, the left limit then the right limit", "s")}
    for label, (values, meaning) in (labels or {}).items():
        columns[label] = values
        meanings[label] = (meaning, "")
    for quantity in quantities:
        if quantity.values.shape != (len(time), len(joints)):
            raise TableError(
                f"table '{name}', quantity '{quantity.name}' has shape {quantity.values.shape}; "
                f"{len(time)} times and {len(joints)} columns need ({len(time)}, {len(joints)})"
            )
    for j, joint in enumerate(joints):
        for quantity in quantities:
            unit = quantity.unit_of(j)
            key = header(joint, quantity.name, unit)
            if key in columns:
                raise TableError(f"table '{name}': header '{key}' occurs twice; rename one")
            columns[key] = quantity.values[:, j]
            meanings[key] = (f"{joint}: {quantity.meaning}", unit)
    return Table(name, columns, meanings, description)
