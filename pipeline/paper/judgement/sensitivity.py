"""Which unpublished number moves which conclusion, and whether one of them stands out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Index:
    """Total Sobol index of one number: its share of the variance, interactions included.

    Attributes:
        parameter: ``robot.<name>`` or ``<component>.<name>``.
        total: The index [1].
        half_width: Of its 95 % interval [1].
    """

    parameter: str
    total: float
    half_width: float


def ranking(results: Mapping[str, Any], output: str) -> list[Index]:
    """Every number's total index on an output, largest first."""
    table = results["sensitivity"]
    own = table[output]
    rows = zip(table["names"], own["ST"], own["ST_conf"], strict=True)
    return sorted((Index(*row) for row in rows), key=lambda row: -row.total)


def leading(ranked: Sequence[Index]) -> list[Index]:
    """Those that may be the largest: their intervals reach the largest one's lower end.

    One alone stands out; with more, nothing says which of them to measure first.
    """
    least = ranked[0].total - ranked[0].half_width
    return [row for row in ranked if row.total + row.half_width >= least]


def sensitivity_rows(results: Mapping[str, Any]) -> list[dict[str, Any]]:
    """First-order and total Sobol indices, one row per output and number."""
    table = results["sensitivity"]
    columns = {
        "first_order": "S1",
        "first_order_95": "S1_conf",
        "total": "ST",
        "total_95": "ST_conf",
    }
    return [
        {"output": output, "parameter": name}
        | {column: own[key][i] for column, key in columns.items()}
        for output, own in table.items()
        if isinstance(own, Mapping)
        for i, name in enumerate(table["names"])
    ]
