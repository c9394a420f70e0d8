"""What rounding leaves where the true number is zero is written as zero.

A sum of large terms that cancel leaves some 1e-16 of them, and a ratio of 400 or a square makes
2.2e-32 N*m of it, which a reader takes for a result. The tolerance is `SHARE` of the largest
magnitude that the table holds in the same unit, since what cancelled has the same unit; a pure
number is compared with its own column. It is never above `LARGEST`, so that one number gone astray
cannot wipe out the others. In tables of this project rounding lies below 1e-15 of the largest and
numbers with a meaning above 1e-11.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from reports.table import Column, Table

SHARE: Final = 1e-12
LARGEST: Final = 1e-9
#: A column with this unit has that of another column's cell in the same row, e.g. "see unit".
_SEE: Final = "see "
#: What a sidecar says of it.
RULE: Final = (
    "numbers of magnitude up to zero_below are what rounding leaves and are written as 0; it is "
    f"{SHARE:g} of the largest magnitude in the same unit in this table, at most {LARGEST:g}"
)


def without_dust(table: Table) -> Table:
    """The table with zero in place of what rounding leaves; told by its `zero_below`."""
    if table.exact or table.zero_below:
        return table
    floats = {header: _floats(values) for header, values in table.columns.items()}
    units = {
        header: _units(table, header) for header, values in floats.items() if values is not None
    }
    largest: dict[str, float] = {}
    for header, keys in units.items():
        magnitude = np.abs(floats[header])
        magnitude[~np.isfinite(magnitude)] = 0.0
        for key in dict.fromkeys(keys):
            own = magnitude if len(keys) == 1 else magnitude[[k == key for k in keys]]
            largest[key] = max(largest.get(key, 0.0), float(own.max(initial=0.0)))
    bounds = {key: min(SHARE * value, LARGEST) for key, value in largest.items()}
    columns: dict[str, Column] = dict(table.columns)
    zero_below: dict[str, float | Mapping[str, float]] = {}
    for header, keys in units.items():
        tolerance = np.array([bounds[key] for key in keys])
        with np.errstate(invalid="ignore"):
            dust = np.abs(floats[header]) <= tolerance
        if dust.any():
            columns[header] = _cleared(table.columns[header], dust)
        if _row_unit(table, header):
            zero_below[header] = {k: bounds[k] for k in dict.fromkeys(keys) if bounds[k]}
        elif bounds[keys[0]]:
            zero_below[header] = bounds[keys[0]]
    return replace(table, columns=columns, zero_below=zero_below)


def _floats(values: Column) -> Any:
    """A column of floats as such, nothing being NaN; None for whole numbers, flags and texts."""
    if isinstance(values, np.ndarray):
        return values.astype(np.float64) if values.dtype.kind == "f" else None
    if not any(isinstance(v, float | np.floating) for v in values):
        return None
    if any(isinstance(v, str) for v in values):
        return None
    return np.array([math.nan if v is None else float(v) for v in values])


def _row_unit(table: Table, header: str) -> str:
    """The column that holds the unit of each row; empty where one unit serves all."""
    unit = table.meanings[header][1]
    other = unit.removeprefix(_SEE)
    return other if unit.startswith(_SEE) and other in table.columns else ""


def _units(table: Table, header: str) -> Sequence[str]:
    """What a column's cells are compared by: one key, or one per row."""
    rows = _row_unit(table, header)
    keys = [str(v) for v in table.columns[rows]] if rows else [table.meanings[header][1]]
    return [f"{header} [{key}]" if key in ("", "1") else key for key in keys] or [header]


def _cleared(values: Column, dust: Any) -> Column:
    if isinstance(values, np.ndarray):
        return np.where(dust, 0.0, values)
    return [0.0 if zero else v for v, zero in zip(values, dust, strict=True)]
