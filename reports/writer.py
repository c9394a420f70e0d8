"""Write tables as CSV with a sidecar, whole or not at all.

Comma, dot decimal, UTF-8, LF, one header row. Floats are written with the shortest digits that
read back to the same number; NaN and None are empty cells. The file holds no time stamp and no
path: the same table gives the same bytes.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reports.atomic import replacing, write_text
from reports.errors import OutputError, TableError
from reports.meta import sidecar
from reports.table import Table

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["csv_bytes", "write_table", "write_text"]

_BOM = b"\xef\xbb\xbf"


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
            spreadsheets know UTF-8.

    Raises:
        TableError: A column whose values are of mixed types.
    """
    import pyarrow as pa
    import pyarrow.compute as pc
    import pyarrow.csv as pacsv

    arrays = {header: _array(table, header) for header in table.columns}
    delimiter = ";" if decimal == "," else ","
    # pyarrow quotes every text of a file or none: none where no text needs it.
    special = any(
        pc.any(pc.match_substring_regex(values, r'[,;"\r\n]')).as_py()
        for values in arrays.values()
        if pa.types.is_string(values.type)
    )
    if decimal == ",":
        arrays = {
            header: pc.replace_substring(pc.cast(values, pa.string()), ".", ",")
            if pa.types.is_floating(values.type)
            else values
            for header, values in arrays.items()
        }
    options = pacsv.WriteOptions(
        delimiter=delimiter,
        eol="\n",
        quoting_style="needed" if special else "none",
        quoting_header="none",
    )
    sink = io.BytesIO()
    pacsv.write_csv(pa.table(arrays), sink, options)
    return (_BOM if decimal == "," else b"") + sink.getvalue()


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
