"""The calibration's inputs: the printed values and the prior, and what is wrong with bad ones."""

from __future__ import annotations

import csv
import os
from pathlib import Path

import numpy as np
import pytest

from actuators.errors import LegwattError
from pipeline.paper.prior import Prior
from pipeline.paper.published import PUBLISHED_FILE, Published, load_published

SHARED = os.environ.get("LEGWATT_SHARED", "")


def test_half_widths_of_the_standing_tables_are_half_of_the_last_printed_digit(
    published: dict[str, Published],
) -> None:
    """None was widened to make a value fit; a column's zeros have the digits of their column."""
    digits = {
        **{f"{a}_current_2": 2 for a in ("ideal", "rotor", "reversible")},
        **{f"{a}_voltage_{j}": 3 for a in ("ideal", "rotor", "reversible") for j in (2, 3)},
        **{"ideal_power_2": 2, "rotor_power_2": 2, "reversible_power_2": 3},
        **{"rotor_motor_torque_2": 5, "reversible_motor_torque_2": 5, "rotor_motor_torque_3": 5},
        **{f"{a}_leg_energy_3s": 2 for a in ("ideal", "rotor", "reversible")},
        **{"rotor_current_3": 2, "standing_torque_2": 2, "standing_torque_3": 2},
    }
    found = {name: published[name].half_width for name in digits}
    assert found == pytest.approx({name: 0.5 * 10.0**-count for name, count in digits.items()})


@pytest.mark.skipif(not SHARED, reason="the table is shared only where $LEGWATT_SHARED is set")
def test_the_printed_values_are_the_shared_ones() -> None:
    def rows(path: Path) -> list[list[str]]:
        with path.open(encoding="utf-8", newline="") as file:
            return [row[:8] for row in csv.reader(file)]  # notes may name other files

    assert rows(PUBLISHED_FILE) == rows(Path(SHARED) / "published_values.csv")


def test_coordinates_are_those_of_a_unit_gaussian(prior: Prior) -> None:
    z = np.linspace(-0.5, 0.5, len(prior.free))
    values = prior.values(z)
    again = [f.coordinate(values[f.key]) for f in prior.free]
    np.testing.assert_allclose(again, z, atol=1e-9)
    for free in prior.free:
        assert free.bounds[0] <= free.centre <= free.bounds[1]
        assert free.value(0.0) == pytest.approx(free.centre)
    drawn = prior.draw(np.random.default_rng(0))
    assert ((drawn >= prior.ends[0]) & (drawn <= prior.ends[1])).all()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("0.600", "nan", "not a finite number"),
        ("0.0005", "-1", "half_width"),
        ("input", "inptu", "role.*did you mean 'input'"),
    ],
)
def test_bad_published_values_are_one_line(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    path = tmp_path / "published.csv"
    text = PUBLISHED_FILE.read_text(encoding="utf-8").replace(old, new, 1)
    path.write_text(text, encoding="utf-8")
    with pytest.raises(LegwattError, match=message) as caught:
        load_published(path)
    assert "\n" not in str(caught.value)
