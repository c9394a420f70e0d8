"""Tables refuse what a reader could not use."""

from __future__ import annotations

import numpy as np
import pytest

from reports.errors import TableError
from reports.table import Table, table_from_rows
from reports.wide import Quantity, header, wide_series

X = {"x": ("length", "m")}


@pytest.mark.parametrize(
    ("columns", "meanings", "says"),
    [
        ({}, {}, "no columns"),
        ({"x": [1.0]}, {}, "'x' has no meaning"),
        ({"x": [1.0]}, {"x": ("  ", "m")}, "'x' has no meaning"),
        ({"x": [1.0]}, {**X, "y": ("b", "m")}, "'y', which is no column"),
        ({"x": [1.0], "X": [2.0]}, {**X, "X": ("b", "m")}, "same word"),
        ({"x": [1.0], "y": [1.0, 2.0]}, {**X, "y": ("b", "m")}, "2 rows"),
        ({"x,y": [1.0]}, {"x,y": ("a", "m")}, "letters, digits"),
        ({"x": np.zeros((2, 2))}, X, "2 dimensions"),
        ({"x": "abc"}, X, "one text"),
    ],
)
def test_unusable_table_is_refused_in_one_line(columns, meanings, says) -> None:
    with pytest.raises(TableError) as caught:
        Table("t", columns, meanings)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["", "a/b", "../t", "a b"])
def test_name_is_a_plain_file_name(name: str) -> None:
    with pytest.raises(TableError, match="plain file name"):
        Table(name, {"x": [1.0]}, X)


def test_rows_take_the_order_of_the_meanings() -> None:
    meanings = {"b": ("second", "1"), "a": ("first", "1")}
    table = table_from_rows("t", [{"a": 1, "b": 2}, {"b": 4, "a": 3}], meanings)
    assert list(table.columns) == ["b", "a"]
    assert table.columns["a"] == [1, 3]
    assert table.rows == 2


def test_row_with_a_missing_column_is_named() -> None:
    with pytest.raises(TableError, match="row 1: columns x"):
        table_from_rows("t", [{"x": 1}, {}], X)


def test_wide_headers_follow_the_design() -> None:
    assert header("rm_joint_2", "torque", "N*m") == "rm_joint_2__torque_Nm"
    assert header("rm_joint_2", "acceleration", "rad/s^2") == "rm_joint_2__acceleration_rad_s2"
    assert header("rm", "friction_needed", "1") == "rm__friction_needed"


def test_wide_series_keeps_joints_together() -> None:
    time = np.array([0.0, 1.0, 1.0])
    velocity = Quantity("velocity", "rad/s", "velocity", np.arange(6.0).reshape(3, 2))
    torque = Quantity("torque", "N*m", "torque", -np.arange(6.0).reshape(3, 2))
    table = wide_series(
        "w", time, ["a", "b"], [velocity, torque], labels={"segment": (["s"] * 3, "segment")}
    )
    assert list(table.columns) == [
        "time_s",
        "segment",
        "a__velocity_rad_s",
        "a__torque_Nm",
        "b__velocity_rad_s",
        "b__torque_Nm",
    ]
    np.testing.assert_array_equal(table.columns["b__torque_Nm"], [-1.0, -3.0, -5.0])
    assert table.meanings["b__torque_Nm"] == ("b: torque", "N*m")


def test_wide_series_refuses_wrong_shapes_and_doubled_headers() -> None:
    good = Quantity("v", "m", "v", np.zeros((2, 1)))
    with pytest.raises(TableError, match="shape"):
        wide_series("w", np.zeros(3), ["a"], [good])
    with pytest.raises(TableError, match="occurs twice"):
        wide_series("w", np.zeros(2), ["a"], [good, good])


def test_heading_is_the_declared_title_or_the_header_in_words() -> None:
    table = Table(
        "t",
        {
            h: [1.0]
            for h in ("peak_torque_Nm", "ci_low", "value", "unit", "rm_joint_2__torque_rate_Nm_s")
        },
        {
            "peak_torque_Nm": ("largest magnitude", "N*m"),
            "ci_low": ("lower end", "see unit", "95 % from"),
            "value": ("best estimate", "see unit"),
            "unit": ("unit of value", ""),
            "rm_joint_2__torque_rate_Nm_s": ("rate", "N*m/s"),
        },
    )
    assert [table.title(header) for header in table.columns] == [
        "peak torque [N·m]",
        "95 % from",
        "value",
        "unit",
        "rm_joint_2 torque rate [N·m/s]",
    ]
    assert table.unit_columns == {"unit"}
