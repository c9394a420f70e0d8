"""Every number that went in, with where it comes from."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

from actuators.parameters import Parameter
from actuators.units import from_si
from pipeline.column import column
from reports.table import Table, table_of


@dataclass(frozen=True)
class InputRow:
    """One number in the unit of its file."""

    table: ClassVar = "parameters"
    group: str = column("robot file or component")
    parameter: str = column("name in its file")
    value: float | str = column("in the row's unit", "see unit")
    unit: str = column("unit as the file writes it; 1 is a pure number")
    basis: str = column(
        "published, datasheet, derived, calibrated, identified (from a log) or assumed"
    )
    source: str = column("where the number comes from")
    interval_low: float | None = column(
        "lower end of where the true value is thought to lie", "see unit"
    )
    interval_high: float | None = column("upper end", "see unit")
    reason: str = column("why this value, for an assumption")


def parameters(groups: Iterable[tuple[str, Iterable[Parameter]]]) -> Table:
    """All parameters in the units of their files."""
    rows = []
    for owner, entries in groups:
        for p in entries:
            ends = [None, None] if p.interval is None else [from_si(x, p.unit) for x in p.interval]
            low, high = ends
            given = (owner, p.name, p.value_as_written, p.unit, p.basis, p.source)
            rows.append(InputRow(*given, low, high, p.reason))
    return table_of(InputRow, rows, exact=True)
