"""Which unpublished number moves which conclusion, and whether one of them stands out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pipeline.paper.calibration.calibrate import OUTPUTS


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

    @property
    def low(self) -> float:
        """Lower end of the interval."""
        return self.total - self.half_width

    @property
    def high(self) -> float:
        """Upper end of the interval."""
        return self.total + self.half_width


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
    return [row for row in ranked if row.high >= ranked[0].low]


def sensitivity_rows(results: Mapping[str, Any]) -> list[dict[str, Any]]:
    """First-order and total Sobol indices, one row per output and number."""
    table = results["sensitivity"]
    return [
        {
            "output": output,
            "parameter": name,
            "first_order": table[output]["S1"][i],
            "first_order_95": table[output]["S1_conf"][i],
            "total": table[output]["ST"][i],
            "total_95": table[output]["ST_conf"][i],
        }
        for output in OUTPUTS
        for i, name in enumerate(table["names"])
    ]
