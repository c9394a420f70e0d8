"""The sidecar of a table: what its columns mean and what it was computed from."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

import numpy as np

from reports.dust import RULE
from reports.errors import TableError
from reports.table import Table

#: An absolute path, in Unix or Windows writing, that starts a word.
_PATH = re.compile(r"(?<![\w./])(?:/|[A-Za-z]:[\\/])(?:[^\s'\"/\\:;,()]+[/\\])+([^\s'\"/\\:;,()]*)")
_RESERVED = ("table", "description", "columns", "rows", "sha256", "zero")


def sidecar(table: Table, sha256: str, meta: Mapping[str, Any]) -> str:
    """JSON text of a table's sidecar; the same input gives the same text.

    Args:
        table: What was written.
        sha256: Of the CSV's bytes, so that a sidecar of another run is noticed.
        meta: Hashes of inputs, versions, options, seed, warnings. Keys are sorted and folders of
            absolute paths are left out, so that two machines write the same.

    Raises:
        TableError: A reserved key, or a value that JSON cannot hold.
    """
    for key in _RESERVED:
        if key in meta:
            raise TableError(f"table '{table.name}': meta key '{key}' is reserved; rename it")
    head = {
        "table": table.name,
        "description": table.description,
        "rows": table.rows,
        "sha256": sha256,
        "columns": [
            {
                "name": header,
                "meaning": table.meanings[header][0],
                "unit": table.meanings[header][1],
                **({"zero_below": table.zero_below[header]} if header in table.zero_below else {}),
            }
            for header in table.columns
        ],
        **({"zero": RULE} if table.zero_below else {}),
    }
    rest = {str(key): _plain(meta[key], table.name) for key in sorted(meta, key=str)}
    return json.dumps({**head, **rest}, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


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
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, np.generic | np.ndarray):
        return _plain(value.tolist(), table)
    if isinstance(value, int):
        return value
    if isinstance(value, float):
        # JSON has no infinity; NaN is "no value", as in the CSV.
        return value if math.isfinite(value) else None if math.isnan(value) else str(value)
    if isinstance(value, set | frozenset):
        return [_plain(item, table) for item in sorted(value, key=str)]
    if isinstance(value, list | tuple):
        return [_plain(item, table) for item in value]
    raise TableError(
        f"table '{table}': meta holds a {type(value).__name__}; use texts, numbers, lists, mappings"
    )


def without_folders(text: str) -> str:
    """The text with every absolute path cut down to its last part."""
    return _PATH.sub(lambda match: match.group(1), text)
