"""Which unpublished number moves which conclusion, and whether one of them stands out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from pipeline.column import column


@dataclass(frozen=True)
class Sensitivity:
    """Which unpublished number moves which conclusion."""

    table: ClassVar = "sensitivities"
    about: ClassVar = (
        "Every number uniform within one prior standard deviation of the calibrated point."
    )
    output: str = column("walking ratio, energy difference or break-even")
    parameter: str = column("robot or component, and name in its file")
    first_order: float = column("Sobol index of the number alone", "1")
    first_order_95: float = column("half width of its 95 % interval", "1")
    total: float = column("Sobol index with all interactions", "1")
    total_95: float = column("half width of its 95 % interval", "1")


def sensitivities(results: Mapping[str, Any]) -> list[Sensitivity]:
    """Sobol indices of every number on every output."""
    table = results["sensitivity"]
    outputs = {output: own for output, own in table.items() if isinstance(own, Mapping)}
    return [
        Sensitivity(output, *row)
        for output, own in outputs.items()
        for row in zip(
            table["names"], *(own[key] for key in ("S1", "S1_conf", "ST", "ST_conf")), strict=True
        )
    ]


def ranking(results: Mapping[str, Any], output: str) -> list[Sensitivity]:
    """Every number's indices on an output, the largest total first."""
    return sorted(
        (row for row in sensitivities(results) if row.output == output), key=lambda row: -row.total
    )


def leading(ranked: Sequence[Sensitivity]) -> list[Sensitivity]:
    """Those that may be the largest: their intervals reach the largest one's lower end.

    One alone stands out; with more, nothing says which of them to measure first.
    """
    least = ranked[0].total - ranked[0].total_95
    return [row for row in ranked if row.total + row.total_95 >= least]
