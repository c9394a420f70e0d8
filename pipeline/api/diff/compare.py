"""Two runs, number by number: rows of a table meet where their names are the same."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.errors import one_line
from pipeline.api.diff.runs import Run, RunTable
from pipeline.errors import ReportError

if TYPE_CHECKING:
    import pandas

#: The table of what went in.
PARAMETERS = "parameters"
Key = tuple[str, ...]


@dataclass(frozen=True)
class Pair:
    """One number of two runs."""

    table: str  #: Name.
    row: str  #: What names its row, in words.
    quantity: str  #: Header of its column.
    unit: str  #: Of both.
    a: float  #: Of run A; NaN where it has none.
    b: float  #: Of run B.
    weight: float  #: |b - a| over the largest magnitude in the same column and unit.

    @property
    def both(self) -> bool:
        """Whether both runs have it."""
        return not np.isnan([self.a, self.b]).any()

    @property
    def difference(self) -> float:
        """B less A, in `unit`."""
        return self.b - self.a

    @property
    def ratio(self) -> float:
        """B over A; NaN where A is zero."""
        return self.b / self.a if self.a else float("nan")


@dataclass(frozen=True, eq=False)
class Comparison:
    """Two runs side by side."""

    a: Run  #: Run.
    b: Run  #: Run.
    #: Every number of every table that both have, in the order of A's tables.
    pairs: tuple[Pair, ...]
    inputs: tuple[tuple[str, str, str], ...]  #: What went in and differs: what, in A, in B.
    #: Tables and figures that one of them has alone: name to ``"A"`` or ``"B"``.
    alone: Mapping[str, str]
    figures: tuple[str, ...]  #: Figures that both have and that are not the same.

    def table(self, name: str) -> list[Pair]:
        """Numbers of one table."""
        return [pair for pair in self.pairs if pair.table == name]


def compare(a: Run, b: Run) -> Comparison:
    """Two runs of one kind.

    Raises:
        ReportError: They are the same folder, of different kinds, or have no table in common.
    """
    shown = f"{one_line(a.folder)} and {one_line(b.folder)}"
    if a.folder.resolve() == b.folder.resolve():
        raise ReportError(f"{shown}: the same folder; name two runs")
    common = [name for name in a.tables if name in b.tables]
    if a.kind != b.kind or not set(common) - {PARAMETERS}:
        raise ReportError(
            f"{shown}: runs of '{one_line(a.verb)}' and '{one_line(b.verb)}', which have no table "
            "in common; name two runs of one kind"
        )
    alone = {n: "A" for n in (*a.tables, *a.figures) if n not in {*b.tables, *b.figures}}
    alone |= {n: "B" for n in (*b.tables, *b.figures) if n not in {*a.tables, *a.figures}}
    return Comparison(
        a,
        b,
        tuple(pair for name in common for pair in _pairs(name, a.tables[name], b.tables[name])),
        _inputs(a.meta, b.meta),
        alone,
        tuple(n for n, digest in a.figures.items() if b.figures.get(n, digest) != digest),
    )


def _pairs(name: str, a: RunTable, b: RunTable) -> list[Pair]:
    keys = [key for key in _keys(a) if key in _keys(b)]
    rows = [_rows(_of_any_robot(name, table.frame), keys) for table in (a, b)]
    out = []
    for quantity, unit in a.units.items():
        if not unit or quantity not in b.units or quantity in keys or _numbers(a, quantity):
            continue
        found = []
        for key in dict.fromkeys((*rows[0], *rows[1])):
            units, values = zip(
                *(_cell(t, own.get(key), quantity) for t, own in zip((a, b), rows, strict=True)),
                strict=True,
            )
            # The same name in another unit is another number.
            if units[0] and units[1] and units[0] != units[1]:
                continue
            if not np.isnan(values).all():
                found.append((key, units[0] or units[1], *values))
        largest: dict[str, float] = {}
        for _, own, x, y in found:
            largest[own] = float(np.nanmax([largest.get(own, 0.0), abs(x), abs(y)]))
        out += [
            Pair(
                name, ", ".join(filter(None, key)), quantity, own, x, y, _weight(x, y, largest[own])
            )
            for key, own, x, y in found
        ]
    return out


def _of_any_robot(name: str, frame: pandas.DataFrame) -> pandas.DataFrame:
    """Parameters under the same name whatever the robot: its own come first."""
    if name != PARAMETERS or frame.empty:
        return frame
    first = frame.columns[0]
    return frame.assign(**{first: frame[first].replace(frame[first].iloc[0], "robot")})


def _weight(a: float, b: float, largest: float) -> float:
    apart = abs(b - a)
    return 0.0 if np.isnan(apart) or largest == 0 else apart / largest


def _keys(table: RunTable) -> list[str]:
    """Columns that name a row: the texts in front of the first number that does not count rows."""
    out = []
    for header, unit in table.units.items():
        if unit and not _numbers(table, header):
            break
        if not unit:
            out.append(header)
    return out


def _numbers(table: RunTable, header: str) -> bool:
    """Whether a column numbers the rows: it comes first and counts without falling."""
    if header != next(iter(table.units)) or table.units[header] != "1":
        return False
    values = np.asarray(table.frame[header], dtype=float)
    return bool((np.diff(values) >= 0).all() and (values == np.round(values)).all())


def _rows(frame: pandas.DataFrame, keys: list[str]) -> dict[Key, Any]:
    """Rows by name; one that has its name from another before it has its number, too."""
    out: dict[Key, Any] = {}
    seen: dict[Key, int] = {}
    for _, row in frame.iterrows():
        key = tuple(str(row[k]) for k in keys)
        seen[key] = seen.get(key, 0) + 1
        out[key if seen[key] == 1 else (*key, f"no. {seen[key]}")] = row
    return out


def _cell(table: RunTable, row: Any, quantity: str) -> tuple[str, float]:
    """Unit and value; neither where there is no row."""
    if row is None:
        return "", float("nan")
    unit = table.units[quantity]
    if unit.startswith("see "):
        unit = str(row.get(unit.removeprefix("see "), ""))
    return unit, float(row[quantity])


def _inputs(a: Mapping[str, Any], b: Mapping[str, Any]) -> tuple[tuple[str, str, str], ...]:
    """Options, versions and files that are not the same."""
    out = []
    labels = {"inputs_sha256": "file", "options": "option", "versions": "version of"}
    for group, label in labels.items():
        own, other = ((m.get(group) or {}) for m in (a, b))
        for key in dict.fromkeys((*own, *other)):
            if own.get(key) == other.get(key):
                continue
            if group != "inputs_sha256":
                x, y = (_words(m.get(key)) for m in (own, other))
            elif key in own and key in other:
                x, y = "read", "read, with other contents"
            else:
                x, y = ("read" if key in m else "not read" for m in (own, other))
            out.append((f"{label} {key}", x, y))
    return tuple(out)


def _words(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(map(str, value)) or "none"
    return "none" if value is None else str(value)
