"""Round-off where the true number is zero is written as zero.

A sum of large terms that cancel leaves some 1e-16 of them, and a ratio of 400 or a square makes
2.2e-32 N*m of it, which a reader takes for a result. The tolerance is `SHARE` of the largest
magnitude that the table holds in the same unit, since what cancelled has the same unit; a pure
number is compared with its own column. It is never above `LARGEST`, so that one number gone astray
cannot wipe out the others. In tables of this project round-off lies below 1e-15 of the largest and
numbers with a meaning above 1e-11.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from reports.table import Column, Table

SHARE: Final = 1e-12
LARGEST: Final = 1e-9
#: What a sidecar says of it.
RULE: Final = (
    "numbers of magnitude up to zero_below are what rounding leaves and are written as 0; it is "
    f"{SHARE:g} of the largest magnitude in the same unit in this table, at most {LARGEST:g}"
)


def without_roundoff(table: Table) -> Table:
    """The table with zero in place of round-off; its `zero_below` states the tolerances."""
    if table.exact or table.zero_below:
        return table
    floats = {h: x for h, values in table.columns.items() if (x := _floats(values)) is not None}
    units = {header: _units(table, header) for header in floats}
    largest: dict[str, float] = {}
    for header, values in floats.items():
        magnitude = np.where(np.isfinite(values), np.abs(values), 0.0)
        for unit in dict.fromkeys(units[header]):
            own = float(magnitude[units[header] == unit].max(initial=0.0))
            largest[unit] = max(largest.get(unit, 0.0), own)
    bounds = {unit: min(SHARE * value, LARGEST) for unit, value in largest.items()}
    columns: dict[str, Column] = dict(table.columns)
    zero_below: dict[str, float | Mapping[str, float]] = {}
    for header, values in floats.items():
        own_bounds = {unit: bounds[unit] for unit in dict.fromkeys(units[header]) if bounds[unit]}
        with np.errstate(invalid="ignore"):
            small = np.abs(values) <= [bounds[unit] for unit in units[header]]
        if small.any():
            given = zip(table.columns[header], small, strict=True)
            columns[header] = [0.0 if zero else value for value, zero in given]
        if table.unit_column(header):
            zero_below[header] = own_bounds
        elif own_bounds:
            (zero_below[header],) = own_bounds.values()
    return replace(table, columns=columns, zero_below=zero_below)


def _floats(values: Column) -> Any:
    """A column of floats, NaN for no value; None for whole numbers, flags and texts."""
    if isinstance(values, np.ndarray):
        return values.astype(np.float64) if values.dtype.kind == "f" else None
    if any(isinstance(v, str) for v in values) or not any(isinstance(v, float) for v in values):
        return None
    return np.array([np.nan if v is None else float(v) for v in values])


def _units(table: Table, header: str) -> Any:
    """For each cell, what it is compared with: all of its unit, or its own column."""
    other = table.unit_column(header)
    units = table.columns[other] if other else [table.meanings[header][1]] * table.rows
    return np.array([f"{header} [{unit}]" if unit in ("", "1") else unit for unit in units])
