"""A named table whose every column says what it means and in which unit."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from reports.errors import TableError
from reports.typeset import unit_suffix, unit_text

if TYPE_CHECKING:
    import pandas

#: What a column may hold: a NumPy vector, or a sequence in which None stands for "no value".
Column = Sequence[Any] | NDArray[Any]
#: Of a column: (meaning, unit), and where the header's own words would not do, its title.
Meaning = tuple[str, str] | tuple[str, str, str]
_NAME = re.compile(r"[A-Za-z0-9_.-]+")
_SEE = "see "
#: A quantity in plain words, after its owner, whose name a URDF may write as it likes.
_HEADER = re.compile(r"""(?:[^/\\,;"\x00-\x1f\x7f]+__)?[A-Za-z0-9_]+""")


@dataclass(frozen=True)
class Table:
    """Columns of equal length, ready to be written.

    Attributes:
        name: File name without ending, e.g. ``"standing"``.
        columns: Header to values, in the order of the file. NaN and None are empty cells.
        meanings: Header to (meaning, unit) or (meaning, unit, title). The unit is ``""`` for names,
            ``"1"`` for pure numbers and ``"see unit"`` where another column, here ``unit``, holds
            it. The title heads the column on a page; without one it is the header's own words.
        description: One sentence on what the table holds and its sign conventions.
        exact: Whether the numbers were given and not computed, so that none is rounding's.
        zero_below: Header to the magnitude up to which numbers were set to zero, by unit where
            rows have units of their own; filled in by `reports.dust`.
    """

    name: str
    columns: Mapping[str, Column]
    meanings: Mapping[str, Meaning]
    description: str = ""
    exact: bool = False
    zero_below: Mapping[str, float | Mapping[str, float]] = field(default_factory=dict)
    rows: int = field(init=False)

    def __post_init__(self) -> None:
        """Refuse what a reader could not use.

        Raises:
            TableError: No columns, headers that are not plain words or differ only in case,
                unequal lengths, columns without a meaning or meanings without a column.
        """
        if not _NAME.fullmatch(self.name):
            raise TableError(f"table '{self.name}': the name must be a plain file name")
        if not self.columns:
            raise TableError(f"table '{self.name}' has no columns; at least 1 is needed")
        folded: dict[str, str] = {}
        for header in self.columns:
            if not _HEADER.fullmatch(header):
                raise TableError(
                    f"table '{self.name}', column '{header}': use letters, digits and underscores"
                )
            if header.casefold() in folded:
                raise TableError(
                    f"table '{self.name}': headers '{folded[header.casefold()]}' and '{header}' "
                    "are the same word; rename one"
                )
            folded[header.casefold()] = header
        missing = [header for header in self.columns if not all(self._meaning(header))]
        if missing:
            raise TableError(
                f"table '{self.name}', column '{missing[0]}' has no meaning; state it and its unit"
            )
        extra = [header for header in self.meanings if header not in self.columns]
        if extra:
            raise TableError(f"table '{self.name}': meaning of '{extra[0]}', which is no column")
        lengths = {header: _length(self.name, header, v) for header, v in self.columns.items()}
        first = next(iter(lengths))
        for header, length in lengths.items():
            if length != lengths[first]:
                raise TableError(
                    f"table '{self.name}': column '{header}' has {length} rows, "
                    f"'{first}' has {lengths[first]}"
                )
        object.__setattr__(self, "rows", lengths[first])

    def frame(self) -> pandas.DataFrame:
        """The table as a pandas frame: columns are named as in the CSV, units in their names."""
        import pandas

        return pandas.DataFrame({h: list(values) for h, values in self.columns.items()})

    @property
    def unit_columns(self) -> frozenset[str]:
        """Columns that hold the units of others."""
        units = (meaning[1] for meaning in self.meanings.values())
        named = {unit.removeprefix(_SEE) for unit in units if unit.startswith(_SEE)}
        return frozenset({"unit", *named} & set(self.columns))

    def title(self, header: str) -> str:
        """Heading of a column on a page: words, with the unit in brackets."""
        _, unit, *declared = self.meanings[header]
        words = declared[0] if declared else _words(header, unit)
        if unit in ("", "1") or unit.startswith(_SEE):
            return words
        return f"{words} [{unit_text(unit)}]"

    def _meaning(self, header: str) -> tuple[bool, bool]:
        entry = self.meanings.get(header)
        return (entry is not None and bool(entry[0].strip()), entry is not None)


def _words(header: str, unit: str) -> str:
    """The words of a header such as ``walking_speed_m_s`` without its unit."""
    suffix = unit_suffix(unit)
    words = header.removesuffix(f"_{suffix}") if suffix else header
    owner, apart, quantity = words.partition("__")
    # The owner of a column, a joint or a foot, keeps its name.
    return f"{owner} {quantity.replace('_', ' ')}" if apart else owner.replace("_", " ")


def _length(table: str, header: str, values: Column) -> int:
    if isinstance(values, np.ndarray) and values.ndim != 1:
        raise TableError(
            f"table '{table}', column '{header}' has {values.ndim} dimensions; a column has 1"
        )
    if isinstance(values, str):
        raise TableError(f"table '{table}', column '{header}' is one text; give one per row")
    return len(values)


def table_from_rows(
    name: str,
    rows: Sequence[Mapping[str, Any]],
    meanings: Mapping[str, Meaning],
    description: str = "",
    *,
    exact: bool = False,
) -> Table:
    """A tidy table from one mapping per row; the columns are those of `meanings`, in its order.

    Raises:
        TableError: A row lacks a column or has one without a meaning.
    """
    expected = set(meanings)
    for number, row in enumerate(rows):
        if set(row) != expected:
            odd = sorted(set(row) ^ expected)
            raise TableError(
                f"table '{name}', row {number}: columns {', '.join(odd)} are in the row or in the "
                "meanings, not in both"
            )
    columns = {header: [row[header] for row in rows] for header in meanings}
    return Table(name, columns, meanings, description, exact)
