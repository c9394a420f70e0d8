"""Tables refuse what a reader could not use; a column is declared once, on the rows' dataclass."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest

from actuators.errors import LegwattError
from pipeline.column import column
from reports.table import Quantity, Table, table_of, wide_series

X = {"x": ("length", "m")}


@dataclass(frozen=True)
class Row:
    """One thing."""

    table: ClassVar = "things"
    about: ClassVar = "Some things."
    name: str = column("of it")
    peak_torque_Nm: float = column("largest magnitude", "N*m")
    low: float = column("lower end", "see unit", "95 % from", of=lambda r: r.ends[0])
    unit: str = column("unit of low")


@pytest.mark.parametrize(
    ("name", "columns", "meanings", "says"),
    [
        ("t", {}, {}, "there is none"),
        ("t", {"x": [1.0]}, {}, "'x' lacks values or a meaning"),
        ("t", {"x": [1.0]}, {**X, "y": ("b", "m")}, "'y' lacks values or a meaning"),
        ("t", {"x": [1.0], "X": [2.0]}, {**X, "X": ("b", "m")}, "same word"),
        ("t", {"x": [1.0], "y": [1.0, 2.0]}, {**X, "y": ("b", "m")}, "unequal length: 'x' 1, 'y'"),
        ("t", {"x,y": [1.0]}, {"x,y": ("a", "m")}, "letters, digits"),
        *((name, {"x": [1.0]}, X, "plain file name") for name in ("", "a/b", "../t", "a b")),
    ],
)
def test_unusable_table_is_refused_in_one_line(name, columns, meanings, says) -> None:
    with pytest.raises(LegwattError) as caught:
        Table(name, columns, meanings)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_table_of_rows() -> None:
    rows = [
        SimpleNamespace(name=n, peak_torque_Nm=1.0, ends=(k, 9), unit="m")
        for k, n in ((2, "a"), (3, "b"))
    ]
    table = table_of(Row, rows)
    assert (table.name, table.description, table.rows) == ("things", "Some things.", 2)
    assert dict(table.columns) == {
        "name": ["a", "b"],
        "peak_torque_Nm": [1.0, 1.0],
        "low": [2, 3],
        "unit": ["m", "m"],
    }
    assert table.meanings["peak_torque_Nm"][:2] == ("largest magnitude", "N*m")
    titles = ["name", "peak torque [N·m]", "95 % from", "unit"]
    assert [table.title(header) for header in table.columns] == titles
    assert table.unit_columns == {"unit"}
    assert list(table.frame().columns) == list(table.columns)
    other = table_of(Row, [], name="none", about="Nothing.", exact=True)
    assert (other.name, other.description, other.exact, other.rows) == ("none", "Nothing.", True, 0)


def test_wide_series_keeps_owners_together_and_names_the_unit() -> None:
    values = np.arange(6.0).reshape(3, 2)
    quantities = [
        Quantity("acceleration", ("rad/s^2", "m/s^2"), "acceleration", values),
        Quantity("torque_rate", "N*m/s", "torque rate", -values),
        Quantity("friction_needed", "1", "friction", values),
    ]
    labels = {"segment": (["s"] * 3, "segment")}
    table = wide_series("w", np.arange(3.0), ["a", "é b"], quantities, labels=labels)
    assert list(table.columns) == [
        *("time_s", "segment"),
        *("a__acceleration_rad_s2", "a__torque_rate_Nm_s", "a__friction_needed"),
        *("é b__acceleration_m_s2", "é b__torque_rate_Nm_s", "é b__friction_needed"),
    ]
    np.testing.assert_array_equal(table.columns["é b__torque_rate_Nm_s"], [-1.0, -3.0, -5.0])
    assert table.meanings["a__torque_rate_Nm_s"] == ("a: torque rate", "N*m/s")
    assert table.title("a__torque_rate_Nm_s") == "a torque rate [N·m/s]"


def test_wide_series_refuses_wrong_shapes_and_doubled_headers() -> None:
    good = Quantity("v", "m", "v", np.zeros((2, 1)))
    with pytest.raises(LegwattError, match="shape"):
        wide_series("w", np.zeros(3), ["a"], [good])
    with pytest.raises(LegwattError, match="occurs twice"):
        wide_series("w", np.zeros(2), ["a"], [good, good])
