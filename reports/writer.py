"""Write tables as CSV with a sidecar, whole or not at all.

Comma, dot decimal, UTF-8, LF, one header row. Floats are written with the shortest digits that
read back to the same number; what rounding leaves of a zero is zero (`reports/dust.py`); NaN and
None are empty cells. The file holds no time stamp and no path: the same table gives the same bytes.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reports.atomic import replacing, write_text
from reports.dust import without_dust
from reports.errors import OutputError, TableError
from reports.meta import sidecar
from reports.table import Table

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["csv_bytes", "write_table", "write_text"]

_BOM = b"\xef\xbb\xbf"
#: A text that is nothing but a number, as a paper's "2.04".
_NUMBER = r"^[-+]?[0-9]+\.[0-9]*([eE][-+]?[0-9]+)?$"
#: Rows that are laid out at once.
_BLOCK = 1 << 16


def write_table(
    table: Table, out_dir: Path, *, meta: Mapping[str, Any], decimal: str = "."
) -> list[Path]:
    """Write `<name>.csv` and `<name>.meta.json`; with comma decimals `<name>.comma.csv`, too.

    Args:
        table: What to write.
        out_dir: Folder; made when it is missing.
        meta: For the sidecar: hashes of inputs, versions, options, seed, warnings.
        decimal: ``"."``, or ``","`` for an additional copy with semicolons and decimal commas, as a
            spreadsheet in a comma-decimal country expects it. The plain files stay.

    Returns:
        The files written, the plain CSV first.

    Raises:
        TableError: A column that CSV cannot hold, or meta that JSON cannot.
        OutputError: The folder cannot be written, or `decimal` is neither of the two.
    """
    if decimal not in (".", ","):
        raise OutputError(f"decimal '{decimal}' is unknown; use '.' or ','")
    table = without_dust(table)
    plain = csv_bytes(table)
    contents = {
        out_dir / f"{table.name}.csv": plain,
        out_dir / f"{table.name}.meta.json": sidecar(
            table, hashlib.sha256(plain).hexdigest(), meta
        ).encode("utf-8"),
    }
    if decimal == ",":
        contents[out_dir / f"{table.name}.comma.csv"] = csv_bytes(table, decimal=",")
    with replacing(*contents) as temporary:
        for path, content in zip(temporary, contents.values(), strict=True):
            path.write_bytes(content)
    return list(contents)


def csv_bytes(table: Table, *, decimal: str = ".") -> bytes:
    """The CSV file of a table.

    Args:
        table: What to write.
        decimal: ``"."``, or ``","`` for semicolons, decimal commas and a byte-order mark, by which
            spreadsheets know UTF-8. A text that is a number gets its comma, too.

    Raises:
        TableError: A column whose values are of mixed types.
    """
    import pyarrow.compute as pc

    delimiter = ";" if decimal == "," else ","
    arrays = [_array(table, header) for header in table.columns]
    lines = [delimiter.join(table.columns)]
    for start in range(0, table.rows, _BLOCK):
        cells = [_cells(values.slice(start, _BLOCK), delimiter, decimal) for values in arrays]
        lines += pc.binary_join_element_wise(*cells, delimiter).to_pylist()
    text = "\n".join(lines) + "\n"
    return (_BOM if decimal == "," else b"") + text.encode("utf-8")


def _cells(values: pa.Array, delimiter: str, decimal: str) -> pa.Array:
    """What stands between the delimiters: quotes around those texts only that need them."""
    import pyarrow as pa
    import pyarrow.compute as pc

    text = pc.cast(values, pa.string())
    if pa.types.is_string(values.type):
        if decimal != ".":
            number = pc.match_substring_regex(text, _NUMBER)
            text = pc.if_else(number, pc.replace_substring(text, ".", decimal), text)
        special = pc.match_substring_regex(text, f'[{delimiter}"\r\n]')
        if pc.any(special).as_py():
            inner = pc.replace_substring(text, '"', '""')
            text = pc.if_else(special, pc.binary_join_element_wise('"', inner, '"', ""), text)
    elif decimal != "." and pa.types.is_floating(values.type):
        text = pc.replace_substring(text, ".", decimal)
    return pc.fill_null(text, "")


def _array(table: Table, header: str) -> pa.Array:
    import numpy as np
    import pyarrow as pa

    values = table.columns[header]
    try:
        if isinstance(values, np.ndarray):
            array = pa.array(np.ascontiguousarray(values), from_pandas=True)
        else:
            array = pa.array(list(values), from_pandas=True)
    except (pa.ArrowException, TypeError, ValueError):
        raise TableError(
            f"table '{table.name}', column '{header}' mixes types; use numbers or texts only"
        ) from None
    if pa.types.is_null(array.type):
        array = array.cast(pa.float64())
    if not (
        pa.types.is_floating(array.type)
        or pa.types.is_integer(array.type)
        or pa.types.is_boolean(array.type)
        or pa.types.is_string(array.type)
    ):
        raise TableError(
            f"table '{table.name}', column '{header}' holds {array.type}; use numbers or texts"
        )
    return array
