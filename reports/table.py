"""A named table whose every column says its meaning and unit; round-off in it is zero."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError
from reports.typeset import unit_suffix, unit_text

if TYPE_CHECKING:
    import pandas

#: What a column may hold: a NumPy vector, or a sequence in which None stands for "no value".
Column = Sequence[Any] | NDArray[Any]
#: Of a column: (meaning, unit), and where the header's own words would not do, its title.
Meaning = tuple[str, str] | tuple[str, str, str]
#: In place of a unit, before the name of the column that holds the unit of each row.
SEE = "see "
_NAME = re.compile(r"[A-Za-z0-9_.-]+")
#: A quantity in plain words, after its owner, whose name a URDF may write as it likes.
_HEADER = re.compile(r"""(?:[^/\\,;"\x00-\x1f\x7f]+__)?[A-Za-z0-9_]+""")


@dataclass(frozen=True)
class Table:
    """Columns of equal length, ready to be written."""

    name: str  #: File name without ending, e.g. ``"standing"``.
    #: Header to values, in the order of the file. NaN and None are empty cells.
    columns: Mapping[str, Column]
    #: Header to (meaning, unit) or (meaning, unit, title); see `pipeline.column`.
    meanings: Mapping[str, Meaning]
    description: str = ""  #: One sentence on what the table holds and its sign conventions.
    #: Whether the numbers were given and not computed, so that none is round-off.
    exact: bool = False
    #: Header to the magnitude up to which numbers were set to zero, by unit where rows have units
    #: of their own; filled in by `reports.table`.
    zero_below: Mapping[str, float | Mapping[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse what a reader could not use.

        Raises:
            LegwattError: A name that is no file name, headers that are not plain words or differ
                only in case, columns of unequal length or without a meaning.
        """
        place = f"table '{self.name}'"
        if not _NAME.fullmatch(self.name):
            raise LegwattError(f"{place}: the name must be a plain file name")
        folded: dict[str, str] = {}
        for header in self.columns:
            if not _HEADER.fullmatch(header):
                raise LegwattError(
                    f"{place}, column '{header}': use letters, digits and underscores"
                )
            other = folded.setdefault(header.casefold(), header)
            if other != header:
                raise LegwattError(
                    f"{place}: headers '{other}' and '{header}' are the same word; rename one"
                )
        odd = sorted(set(self.columns) ^ set(self.meanings))
        if odd:
            raise LegwattError(f"{place}: '{odd[0]}' lacks values or a meaning; give both")
        lengths = {len(values): header for header, values in self.columns.items()}
        if len(lengths) != 1:
            said = ", ".join(f"'{header}' {length}" for length, header in lengths.items())
            raise LegwattError(f"{place}: columns of unequal length: {said or 'there is none'}")

    @property
    def rows(self) -> int:
        """How many."""
        return len(next(iter(self.columns.values())))

    def frame(self) -> pandas.DataFrame:
        """The table as a pandas frame: columns are named as in the CSV, units in their names."""
        import pandas

        return pandas.DataFrame({h: list(values) for h, values in self.columns.items()})

    def unit_column(self, header: str) -> str:
        """The column that holds the unit of each row; empty where one unit serves all."""
        other = self.meanings[header][1].removeprefix(SEE)
        return other if self.meanings[header][1].startswith(SEE) and other in self.columns else ""

    @property
    def unit_columns(self) -> frozenset[str]:
        """Columns that hold the units of others."""
        return frozenset({"unit", *map(self.unit_column, self.columns)} & set(self.columns))

    def title(self, header: str) -> str:
        """Heading of a column on a page: words, with the unit in brackets."""
        _, unit, *declared = self.meanings[header]
        words = declared[0] if declared else ""
        if not words:
            suffix = unit_suffix(unit)
            plain = header.removesuffix(f"_{suffix}") if suffix else header
            owner, apart, quantity = plain.partition("__")
            # The owner of a column, a joint or a foot, keeps its name.
            words = f"{owner} {quantity.replace('_', ' ')}" if apart else owner.replace("_", " ")
        if unit in ("", "1") or unit.startswith(SEE):
            return words
        return f"{words} [{unit_text(unit)}]"


def table_of(
    kind: Any, rows: Sequence[Any], *, name: str = "", about: str = "", exact: bool = False
) -> Table:
    """A tidy table of rows.

    Args:
        kind: Dataclass whose fields are columns (`pipeline.column`), which names the table.
        rows: Of that kind, or what its columns take their values of.
        about: One sentence, where it depends on the run.
    """
    columns, meanings = {}, {}
    for declared in fields(kind):
        value = declared.metadata["of"] or attrgetter(declared.name)
        columns[declared.name] = [value(row) for row in rows]
        meanings[declared.name] = declared.metadata["column"]
    text = about or getattr(kind, "about", "")
    return Table(name or kind.table, columns, meanings, text, exact)


@dataclass(frozen=True)
class Quantity:
    """One quantity at every joint (or foot)."""

    name: str  #: As it stands in the header, e.g. ``"torque"``.
    #: As people write it, e.g. ``"N*m"``; ``"1"`` leaves the header without a unit. One for each
    #: owner, in a tuple, where they differ.
    unit: str | tuple[str, ...]
    meaning: str  #: One clause with the sign, e.g. ``"torque the actuator applies to the joint"``.
    values: Array  #: Shape (N, J).


def wide_series(
    name: str,
    time: Array,
    owners: Sequence[str],
    quantities: Sequence[Quantity],
    *,
    labels: Mapping[str, tuple[Column, str]] | None = None,
    description: str = "",
) -> Table:
    """A wide time series: `time_s`, then `<owner>__<quantity>_<unit>` for every joint or foot.

    Args:
        time: Shape (N,) [s]. A time that occurs twice marks an instant at which something jumps:
            the first row is the limit from the left, the second that from the right.
        owners: Of the columns, J of them.
        quantities: Each with values of shape (N, J).
        labels: Columns between time and quantities, header to (values, meaning), e.g. the segment.

    Raises:
        LegwattError: Shapes that do not fit, or headers that clash.
    """
    labels = labels or {}
    columns: dict[str, Column] = {"time_s": time, **{h: v for h, (v, _) in labels.items()}}
    meanings: dict[str, Meaning] = {
        "time_s": ("time; where it repeats, the left limit then the right limit", "s")
    }
    meanings |= {header: (meaning, "") for header, (_, meaning) in labels.items()}
    for quantity in quantities:
        if quantity.values.shape != (len(time), len(owners)):
            raise LegwattError(
                f"table '{name}', quantity '{quantity.name}' has shape {quantity.values.shape}; "
                f"{len(time)} times and {len(owners)} columns need ({len(time)}, {len(owners)})"
            )
    for j, owner in enumerate(owners):
        for quantity in quantities:
            unit = quantity.unit if isinstance(quantity.unit, str) else quantity.unit[j]
            suffix = unit_suffix(unit)
            header = f"{owner}__{quantity.name}" + (f"_{suffix}" if suffix else "")
            if header in columns:
                raise LegwattError(f"table '{name}': header '{header}' occurs twice; rename one")
            columns[header] = quantity.values[:, j]
            meanings[header] = (f"{owner}: {quantity.meaning}", unit)
    return Table(name, columns, meanings, description)


# A sum of large terms that cancel leaves some 1e-16 of them, and a ratio of 400 or a square makes
# 2.2e-32 N*m of it, which a reader takes for a result. The tolerance is SHARE of the largest
# magnitude that the table holds in the same unit, since what cancelled has the same unit; a pure
# number is compared with its own column. It is never above LARGEST, so that one number gone astray
# cannot wipe out the others. In tables of this project round-off lies below 1e-15 of the largest
# and numbers with a meaning above 1e-11.
SHARE: Final = 1e-12
LARGEST: Final = 1e-9
#: What a sidecar says of it.
RULE: Final = (
    "numbers of magnitude up to zero_below are what rounding leaves and are written as 0; it is "
    f"{SHARE:g} of the largest magnitude in the same unit in this table, at most {LARGEST:g}"
)


def without_roundoff(table: Table) -> Table:
    """The table with zero in place of round-off; its `zero_below` states the tolerances."""
    if table.exact or table.zero_below:
        return table
    floats = {h: x for h, values in table.columns.items() if (x := _floats(values)) is not None}
    units: dict[str, Any] = {}  # for each cell, what it is compared with: its unit, or its column
    for header in floats:
        other = table.unit_column(header)
        own = table.columns[other] if other else [table.meanings[header][1]] * table.rows
        units[header] = np.array([f"{header} [{u}]" if u in ("", "1") else u for u in own])
    largest: dict[str, float] = {}
    for header, values in floats.items():
        magnitude = np.where(np.isfinite(values), np.abs(values), 0.0)
        for unit in dict.fromkeys(units[header]):
            most = float(magnitude[units[header] == unit].max(initial=0.0))
            largest[unit] = max(largest.get(unit, 0.0), most)
    bounds = {unit: min(SHARE * value, LARGEST) for unit, value in largest.items()}
    columns: dict[str, Column] = dict(table.columns)
    zero_below: dict[str, float | Mapping[str, float]] = {}
    for header, values in floats.items():
        own_bounds = {unit: bounds[unit] for unit in dict.fromkeys(units[header]) if bounds[unit]}
        with np.errstate(invalid="ignore"):
            small = np.abs(values) <= [bounds[unit] for unit in units[header]]
        if small.any():
            given = zip(table.columns[header], small, strict=True)
            columns[header] = [0.0 if zero else value for value, zero in given]
        if table.unit_column(header):
            zero_below[header] = own_bounds
        elif own_bounds:
            (zero_below[header],) = own_bounds.values()
    return replace(table, columns=columns, zero_below=zero_below)


def _floats(values: Column) -> Any:
    """A column of floats, NaN for no value; None for whole numbers, flags and texts."""
    if isinstance(values, np.ndarray):
        return values.astype(np.float64) if values.dtype.kind == "f" else None
    if any(isinstance(v, str) for v in values) or not any(isinstance(v, float) for v in values):
        return None
    return np.array([np.nan if v is None else float(v) for v in values])
