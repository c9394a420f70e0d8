"""Every number that went in, with where it comes from."""

from __future__ import annotations

from collections.abc import Iterable

from actuators.parameters import Parameter
from actuators.units import from_si
from reports.table import Table, table_from_rows


def parameters(groups: Iterable[tuple[str, Iterable[Parameter]]]) -> Table:
    """All parameters in the units of their files.

    Args:
        groups: Owner (robot file, component) and its parameters.
    """
    rows = []
    for owner, entries in groups:
        for p in entries:
            low, high = p.interval if p.interval is not None else (None, None)
            rows.append(
                {
                    "group": owner,
                    "parameter": p.name,
                    "value": p.value_as_written,
                    "unit": p.unit,
                    "basis": p.basis,
                    "source": p.source,
                    "interval_low": None if low is None else from_si(low, p.unit),
                    "interval_high": None if high is None else from_si(high, p.unit),
                    "reason": p.reason,
                }
            )
    return table_from_rows(
        "parameters",
        rows,
        {
            "group": ("robot file or component", ""),
            "parameter": ("name in its file", ""),
            "value": ("in the row's unit", "see unit"),
            "unit": ("unit as the file writes it; 1 is a pure number", ""),
            "basis": (
                "published, datasheet, derived, calibrated, identified (from a log) or assumed",
                "",
            ),
            "source": ("where the number comes from", ""),
            "interval_low": ("lower end of where the true value is thought to lie", "see unit"),
            "interval_high": ("upper end", "see unit"),
            "reason": ("why this value, for an assumption", ""),
        },
        exact=True,
    )
