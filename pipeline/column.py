"""A column of a table, declared once: as a field of the dataclass of the table's rows.

Such a dataclass also names its table (`table`) and says in a sentence what it holds (`about`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import Any


def column(
    meaning: str, unit: str = "", title: str = "", of: Callable[[Any], object] | None = None
) -> Any:
    """A field that is a column; its name, with the unit in it, heads the column in the CSV.

    Args:
        meaning: One clause, with the sign where there is one.
        unit: ``""`` for names and flags, ``"1"`` for pure numbers, ``"see COLUMN"`` where another
            column holds the unit of each row.
        title: Heads the column on a page; the name's own words by default.
        of: The value of a row, where rows are results of another kind; by default the attribute of
            the column's name.
    """
    return field(metadata={"column": (meaning, unit, title), "of": of})
