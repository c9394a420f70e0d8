"""What rounding leaves of a zero is written as zero, at a tolerance that the sidecar states."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reports.table import LARGEST, SHARE, Table, without_roundoff
from reports.writer import csv_bytes

ROUNDOFF = 2.2e-32


def torques(**more: object) -> Table:
    return Table(
        "t",
        {
            "joint": ["a", "b", "c"],
            "joint_torque_Nm": np.array([-30.0, ROUNDOFF, np.nan]),
            "motor_torque_Nm": [ROUNDOFF, -3e-14, None],
            "power_W": [1e-12, 2.0, 3.0],
            "share": [ROUNDOFF, 0.25, 1e-11],
            "count": [1, 0, 10**15],
        },
        {
            "joint": ("joint", ""),
            "joint_torque_Nm": ("torque", "N*m"),
            "motor_torque_Nm": ("torque", "N*m"),
            "power_W": ("power", "W"),
            "share": ("share", "1"),
            "count": ("count", "1"),
        },
        **more,  # type: ignore[arg-type]
    )


def test_roundoff_is_zero_beside_what_has_the_same_unit() -> None:
    """A column of round-off alone, too; a pure number is compared with its own column."""
    clean = without_roundoff(torques())
    assert list(clean.columns["joint_torque_Nm"][:2]) == [-30.0, 0.0]
    assert math.isnan(clean.columns["joint_torque_Nm"][2])
    assert clean.columns["motor_torque_Nm"] == [0.0, 0.0, None]
    assert clean.columns["power_W"] == [0.0, 2.0, 3.0]
    assert clean.columns["share"] == [0.0, 0.25, 1e-11]
    assert clean.columns["count"] == [1, 0, 10**15]
    assert csv_bytes(clean).decode().splitlines()[1] == "a,-30,0,0,0,1"


def test_rows_with_units_of_their_own() -> None:
    made = Table(
        "t",
        {"peak": [700.0, ROUNDOFF, 5e-11, 0.2], "unit": ["rad/s", "rad/s", "A", "A"]},
        {"peak": ("peak", "see unit"), "unit": ("its unit", "")},
    )
    clean = without_roundoff(made)
    assert clean.columns["peak"] == [700.0, 0.0, 5e-11, 0.2]
    assert clean.zero_below["peak"] == pytest.approx({"rad/s": 700 * SHARE, "A": 0.2 * SHARE})


def test_given_numbers_are_left_alone() -> None:
    exact = torques(exact=True)
    assert without_roundoff(exact) is exact
    assert b"2.2e-32" in csv_bytes(exact)


def test_one_number_gone_astray_wipes_out_nothing() -> None:
    """The end of an interval that nothing bounds is no measure of rounding."""
    made = Table("t", {"x": [1e30, 0.5, 1e-6, -1e-10]}, {"x": ("x", "m")})
    assert without_roundoff(made).columns["x"] == [1e30, 0.5, 1e-6, 0.0]
    assert without_roundoff(made).zero_below["x"] == LARGEST


@given(st.lists(st.floats(allow_nan=False), min_size=1, max_size=20))
def test_twice_is_once_and_every_change_is_below_what_is_stated(values: list[float]) -> None:
    made = Table("t", {"x": np.array(values)}, {"x": ("x", "m")})
    once = without_roundoff(made)
    bound = once.zero_below.get("x", 0.0)
    assert isinstance(bound, float)
    for old, new in zip(values, once.columns["x"], strict=True):
        assert new == (0.0 if abs(old) <= bound else old)
        assert math.copysign(1.0, new) == 1.0 or new < 0
    again = without_roundoff(Table("t", once.columns, once.meanings))
    assert np.array_equal(again.columns["x"], once.columns["x"])
