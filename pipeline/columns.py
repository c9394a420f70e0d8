"""The columns of every table that is written, declared once: `columns.csv`.

A row names table and column, and says unit and meaning; a row without a column says what the table
holds. A column ``*__torque_Nm`` stands for that quantity of any joint or foot, a table
``rollout_*`` for one per log. A unit is empty for names and flags, ``1`` for pure numbers, and
``see COLUMN`` where another column holds the unit of each row. A title heads the column on a page
where the words of its name would not do.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from actuators.errors import LegwattError, known

if TYPE_CHECKING:
    import pandas

    from actuators.arrays import Array

FILE = Path(__file__).with_suffix(".csv")
SEE = "see "


class Column(NamedTuple):
    """What a column holds."""

    unit: str
    meaning: str
    title: str = ""


@cache
def every_table() -> dict[str, dict[str, Column]]:
    """Columns of every table, by their names."""
    out: dict[str, dict[str, Column]] = {}
    with FILE.open(encoding="utf-8", newline="") as file:
        for table, column, *said in [*csv.reader(file)][1:]:
            out.setdefault(table, {})[column] = Column(*said)
    return out


@cache
def declared(table: str) -> Mapping[str, Column]:
    """Columns of a table in their order, a table's own words under an empty name.

    Raises:
        LegwattError: No such table.
    """
    tables = every_table()
    name = next((t for t in tables if fnmatchcase(table, t)), table)
    return tables[known("no table", name, tables, FILE.name)]


@cache
def column(table: str, name: str) -> Column:
    """What one column holds.

    Raises:
        LegwattError: The table has no such column.
    """
    own = declared(table)
    found = own.get(name) or next((c for p, c in own.items() if p and fnmatchcase(name, p)), None)
    if found is None:
        raise LegwattError(f"table '{table}': no column '{name}' in {FILE.name}")
    return found


def about(table: str) -> str:
    """What a table holds, in a sentence; empty where its columns say it."""
    return declared(table).get("", Column("", "")).meaning


def frame(table: str, rows: Iterable[Sequence[Any] | Mapping[str, Any]]) -> pandas.DataFrame:
    """A table of rows, values in the order of its columns or by their names."""
    import pandas

    headers = [name for name in declared(table) if name]
    cells = [[r[h] for h in headers] if isinstance(r, Mapping) else list(r) for r in rows]
    return pandas.DataFrame(cells, columns=headers)


def series(
    time: Array,
    labels: Mapping[str, Sequence[str]],
    owners: Sequence[str],
    values: Mapping[Any, Any],
) -> pandas.DataFrame:
    """A wide time series: `time_s`, labels, then ``<owner>__<quantity>`` for every joint or foot.

    Args:
        time: Shape (N,) [s]. A time that occurs twice marks an instant at which something jumps:
            the first row is the limit from the left, the second that from the right.
        labels: Columns of texts, N each.
        owners: J of them.
        values: Quantity with its unit, for example ``force_x_N``, to values of shape (N, J); a
            tuple of J names where the owners' units differ.
    """
    import pandas

    columns: dict[str, Any] = {"time_s": time, **labels}
    for j, owner in enumerate(owners):
        for name, each in values.items():
            own = name if isinstance(name, str) else name[j]
            columns[f"{owner}__{own}"] = each[:, j]
    return pandas.DataFrame(columns)
