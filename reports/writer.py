"""Write tables as CSV, and say what stands in them for the run's record.

Comma and decimal dot, UTF-8, LF, one header row. Floats have the
shortest digits that read back to the same number; NaN and None are empty cells. The file holds no
time stamp and no path: the same table gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import pandas as pd

from pipeline.atomic import write_text
from pipeline.columns import about, column

#: Sums of large terms that cancel leave some 1e-16 of them, 2.2e-32 N*m behind a ratio of 400: a
#: reader takes it for a result. In SI no quantity of a machine that walks is as small as this.
ROUND_OFF: Final = 1e-11
#: Whose numbers were given and not computed, so that none is round-off.
EXACT: Final = ("parameters",)
_TYPES: Final = {"f": "number", "i": "integer", "u": "integer", "b": "boolean"}


def write_tables(tables: Mapping[str, pd.DataFrame], out: Path) -> dict[str, Any]:
    """Write each table as `<name>.csv`.

    Args:
        tables: By name; their columns are declared in `pipeline/columns.csv`.
        out: Folder; made when it is missing.

    Returns:
        For the run's record, by file name: what the table holds, and of every column the name,
        type, unit and meaning.

    Raises:
        LegwattError: A column that is not declared, or a folder that cannot be written.
    """
    said = {}
    for name, table in tables.items():
        shown = without_roundoff(name, table)
        fields = []
        for header in map(str, shown):
            unit, meaning, _ = column(name, header)
            kind = _TYPES.get(shown[header].dtype.kind, "string")
            fields.append({"name": header, "type": kind, "unit": unit, "description": meaning})
        write_text(out / f"{name}.csv", shown.to_csv(index=False, lineterminator="\n"))
        words = {"description": about(name)} if about(name) else {}
        said[f"{name}.csv"] = {**words, "rows": len(table), "schema": {"fields": fields}}
    return said


def without_roundoff(name: str, table: pd.DataFrame) -> pd.DataFrame:
    """A copy of a table with zero in place of round-off."""
    out = table.infer_objects()
    for header in out.select_dtypes("float") if name not in EXACT else ():
        out[header] = out[header].mask(out[header].abs() < ROUND_OFF, 0.0)
    return out.copy() if out is table else out
