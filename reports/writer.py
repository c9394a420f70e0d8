"""Write tables as CSV with a sidecar.

Comma and decimal dot, or semicolon and decimal comma; UTF-8, LF, one header row. Floats have the
shortest digits that read back to the same number; round-off of a zero is zero
(`reports/table.py`); NaN and None are empty cells. The file holds no time stamp and no path: the
same table gives the same bytes.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Mapping
from pathlib import Path, PurePath
from typing import Any

import numpy as np

from actuators.errors import LegwattError
from pipeline.atomic import replacing
from reports.folder import DIALECTS
from reports.table import RULE, Table, without_roundoff

#: A text that is nothing but a number, as a paper's "2.04".
_NUMBER = r"^([-+]?[0-9]+)\.([0-9]*(?:[eE][-+]?[0-9]+)?)$"
#: An absolute path, in Unix or Windows writing, that starts a word.
_PATH = re.compile(r"(?<![\w./])(?:/|[A-Za-z]:[\\/])(?:[^\s'\"/\\:;,()]+[/\\])+([^\s'\"/\\:;,()]*)")
#: Types of a column as pandas infers them, to how they are held.
_TYPES = {
    **dict.fromkeys(("floating", "mixed-integer-float", "empty"), "float64"),
    **dict.fromkeys(("string", "boolean"), "object"),
    "integer": "Int64",
}


def write_table(
    table: Table, out_dir: Path, *, meta: Mapping[str, Any], decimal: str = "."
) -> list[Path]:
    """Write `<name>.csv` and `<name>.meta.json`, each whole or not at all.

    Args:
        out_dir: Folder; made when it is missing.
        meta: For the sidecar: hashes of inputs, versions, options, seed, warnings. Keys are sorted
            and folders of absolute paths are left out, so that two machines write the same.
        decimal: ``"."``, or ``","`` for semicolons and decimal commas, as a spreadsheet in a
            comma-decimal country expects it.

    Returns:
        The files written, the CSV first.

    Raises:
        LegwattError: A column that CSV cannot hold, or meta that JSON cannot. The folder cannot be
            written, or `decimal` is neither of the two.
    """
    if decimal not in DIALECTS:
        raise LegwattError(f"decimal '{decimal}' is unknown; use '.' or ','")
    table = without_roundoff(table)
    content = csv_bytes(table, decimal=decimal)
    meta = {**meta, "dialect": DIALECTS[decimal]}
    columns = []
    for header, (meaning, unit, *_) in table.meanings.items():
        said = {"name": header, "meaning": meaning, "unit": unit}
        zero = {"zero_below": table.zero_below[header]} if header in table.zero_below else {}
        columns.append(said | zero)
    head = {
        "table": table.name,
        "description": table.description,
        "rows": table.rows,
        "sha256": hashlib.sha256(content).hexdigest(),
        "columns": columns,
        **({"zero": RULE} if table.zero_below else {}),
    }
    clash = set(meta) & {*head, "zero"}
    if clash:
        raise LegwattError(f"table '{table.name}': meta key '{min(clash)}' is reserved; rename it")
    rest = {str(key): _plain(meta[key], table.name) for key in sorted(meta, key=str)}
    sidecar = (
        json.dumps(head | rest, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    ).encode("utf-8")
    paths = [out_dir / f"{table.name}.csv", out_dir / f"{table.name}.meta.json"]
    for path, written in zip(paths, (content, sidecar), strict=True):
        with replacing(path) as temporary:
            temporary.write_bytes(written)
    return paths


def csv_bytes(table: Table, *, decimal: str = ".") -> bytes:
    """The CSV file of a table.

    Args:
        decimal: ``"."``, or ``","`` for semicolons, decimal commas and a byte-order mark, by which
            spreadsheets know UTF-8. A text that is a number gets its comma, too.

    Raises:
        LegwattError: A column whose values are of mixed types.
    """
    import pandas

    columns = {}
    for header, values in table.columns.items():
        kind = pandas.api.types.infer_dtype(values, skipna=True)
        if kind not in _TYPES:
            raise LegwattError(
                f"table '{table.name}', column '{header}' holds {kind} values; use numbers or "
                "texts only"
            )
        column = pandas.Series(values, dtype=_TYPES[kind])
        if kind == "boolean":
            column = column.map({True: "true", False: "false"})
        elif kind == "string" and decimal != ".":
            column = column.str.replace(_NUMBER, rf"\1{decimal}\2", regex=True)
        columns[header] = column

    def shortest(value: Any) -> str:
        return repr(float(value)).removesuffix(".0").replace(".", decimal)

    separator = DIALECTS[decimal]["delimiter"]
    text = pandas.DataFrame(columns).to_csv(
        index=False, lineterminator="\n", sep=separator, float_format=shortest
    )
    return text.encode("utf-8-sig" if decimal == "," else "utf-8")


def _plain(value: Any, table: str) -> Any:
    """The value in terms of JSON, mappings sorted by key."""
    if isinstance(value, Mapping):
        return {
            without_folders(str(key)): _plain(value[key], table) for key in sorted(value, key=str)
        }
    if isinstance(value, PurePath):
        return value.name if value.is_absolute() else value.as_posix()
    if isinstance(value, str):
        return without_folders(value)
    if isinstance(value, np.generic | np.ndarray):
        return _plain(value.tolist(), table)
    if isinstance(value, float):
        # JSON has no infinity; NaN is "no value", as in the CSV.
        return value if math.isfinite(value) else None if math.isnan(value) else str(value)
    if value is None or isinstance(value, int):
        return value
    if isinstance(value, list | tuple):
        return [_plain(item, table) for item in value]
    raise LegwattError(
        f"table '{table}': meta holds a {type(value).__name__}; use texts, numbers, lists, mappings"
    )


def without_folders(text: str) -> str:
    """The text with every absolute path cut down to its last part."""
    return _PATH.sub(lambda match: match.group(1), text)
