"""Write tables as CSV, and say what stands in them for the run's record.

Comma and decimal dot, or semicolon and decimal comma; UTF-8, LF, one header row. Floats have the
shortest digits that read back to the same number; round-off of a zero is zero; NaN and None are
empty cells. The file holds no time stamp and no path: the same table gives the same bytes.

A sum of large terms that cancel leaves some 1e-16 of them, and a ratio of 400 or a square makes
2.2e-32 N*m of it, which a reader takes for a result. The tolerance is `SHARE` of the largest
magnitude that the table holds in the same unit, since what cancelled has the same unit; a pure
number is compared with its own column. It is never above `LARGEST`, so that one number gone astray
cannot wipe out the others. In tables of this project round-off lies below 1e-15 of the largest and
numbers with a meaning above 1e-11.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd
from pandas.api.types import infer_dtype, is_float_dtype

from actuators.errors import LegwattError
from pipeline.atomic import replacing
from pipeline.columns import about, column, unit_column
from reports.folder import DIALECTS

SHARE: Final = 1e-12
LARGEST: Final = 1e-9
#: Whose numbers were given and not computed, so that none is round-off.
EXACT: Final = ("parameters",)
#: A text that is nothing but a number, as a paper's "2.04".
_NUMBER = r"^([-+]?[0-9]+)\.([0-9]*(?:[eE][-+]?[0-9]+)?)$"
#: Types of a column as pandas infers them, to how they are held, and as a record names them.
_TYPES: Final = {
    **dict.fromkeys(("floating", "mixed-integer-float", "empty"), ("float64", "number")),
    "string": ("object", "string"),
    "boolean": ("object", "boolean"),
    "integer": ("Int64", "integer"),
}


def write_tables(
    tables: Mapping[str, pd.DataFrame], out: Path, *, decimal: str = "."
) -> dict[str, Any]:
    """Write each table as `<name>.csv`, whole or not at all.

    Args:
        tables: By name; their columns are declared in `pipeline/columns.csv`.
        out: Folder; made when it is missing.
        decimal: ``"."``, or ``","`` for semicolons and decimal commas, as a spreadsheet in a
            comma-decimal country expects it.

    Returns:
        For the run's record, by file name: what the table holds, and of every column the name,
        type, unit and meaning, and below which magnitude its numbers were round-off.

    Raises:
        LegwattError: A column that is not declared or that CSV cannot hold, a folder that cannot
            be written, or `decimal` is neither of the two.
    """
    if decimal not in DIALECTS:
        raise LegwattError(f"decimal '{decimal}' is unknown; use '.' or ','")
    said = {}
    for name, table in tables.items():
        shown, zero_below = without_roundoff(name, table)
        content = csv_bytes(name, shown, decimal=decimal)
        with replacing(out / f"{name}.csv") as temporary:
            temporary.write_bytes(content)
        fields = []
        for header in table:
            unit, meaning, _ = column(name, str(header))
            kind = _TYPES[infer_dtype(table[header], skipna=True)][1]
            field = {"name": header, "type": kind, "unit": unit, "description": meaning}
            zero = {"zero_below": zero_below[header]} if header in zero_below else {}
            fields.append(field | zero)
        words = {"description": about(name)} if about(name) else {}
        said[f"{name}.csv"] = {**words, "rows": len(table), "schema": {"fields": fields}}
    return said


def csv_bytes(name: str, table: pd.DataFrame, *, decimal: str = ".") -> bytes:
    """The CSV file of a table.

    Args:
        name: Of the table, for refusals.
        table: As it is to be written.
        decimal: ``"."``, or ``","`` for semicolons, decimal commas and a byte-order mark, by which
            spreadsheets know UTF-8. A text that is a number gets its comma, too.

    Raises:
        LegwattError: A column whose values are of mixed types.
    """
    columns = {}
    for header, values in table.items():
        kind = infer_dtype(values, skipna=True)
        if kind not in _TYPES:
            raise LegwattError(
                f"table '{name}', column '{header}' holds {kind} values; use numbers or texts only"
            )
        own = pd.Series(values, dtype=_TYPES[kind][0])
        if kind == "boolean":
            own = own.map({True: "true", False: "false"})
        elif kind == "string" and decimal != ".":
            own = own.str.replace(_NUMBER, rf"\1{decimal}\2", regex=True)
        columns[header] = own

    def shortest(value: Any) -> str:
        return repr(float(value)).removesuffix(".0").replace(".", decimal)

    text = pd.DataFrame(columns).to_csv(
        index=False,
        lineterminator="\n",
        sep=DIALECTS[decimal]["delimiter"],
        float_format=shortest,
    )
    return text.encode("utf-8-sig" if decimal == "," else "utf-8")


def without_roundoff(name: str, table: pd.DataFrame) -> tuple[pd.DataFrame, dict[str, Any]]:
    """The table with zero in place of round-off, and the tolerances by column.

    A tolerance is a number, or one by unit where another column holds the unit of each row.
    """
    floats = [str(header) for header in table if is_float_dtype(table[header])]
    if name in EXACT or not floats:
        return table, {}
    units = {}  # for each cell, what it is compared with: its unit, or its column
    for header in floats:
        other = unit_column(name, header)
        own = table[other] if other else [column(name, header).unit] * len(table)
        units[header] = np.array([f"{header} [{u}]" if u in ("", "1") else u for u in own])
    largest: dict[str, float] = {}
    for header, unit in units.items():
        magnitude = table[header].abs().where(np.isfinite(table[header]), 0.0).to_numpy()
        for one in dict.fromkeys(unit):
            most = float(magnitude[unit == one].max(initial=0.0))
            largest[one] = max(largest.get(one, 0.0), most)
    bounds = {unit: min(SHARE * value, LARGEST) for unit, value in largest.items()}
    out = table.copy()
    zero_below: dict[str, Any] = {}
    for header, unit in units.items():
        small = table[header].abs() <= [bounds[one] for one in unit]
        out[header] = table[header].mask(small, 0.0)
        ends = {str(one): bounds[one] for one in dict.fromkeys(unit) if bounds[one]}
        if unit_column(name, header):
            zero_below[header] = ends
        elif ends:
            (zero_below[header],) = ends.values()
    return out, zero_below
