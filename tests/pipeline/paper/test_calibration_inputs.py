"""The calibration's inputs: the printed values and the prior, and what is wrong with bad ones."""

from __future__ import annotations

import csv
import os
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from actuators.loading.build import load_catalog
from pipeline.paper.calibration.prior import PRIOR_FILE, Free, load_prior
from pipeline.paper.calibration.quantities import DIMENSIONS, IDS
from pipeline.paper.errors import PriorError, TargetError
from pipeline.paper.published import PUBLISHED_FILE, load_published
from pipeline.robot.robot_file import load_robot_file

SHARED = os.environ.get("LEGWATT_SHARED", "")
HEADER, *ROWS = PUBLISHED_FILE.read_text(encoding="utf-8").splitlines()


def written(tmp_path: Path, lines: list[str]) -> Path:
    path = tmp_path / "published.csv"
    path.write_text("\n".join([HEADER, *lines]) + "\n", encoding="utf-8")
    return path


def test_every_printed_value_is_computed_and_has_its_role() -> None:
    published = load_published(IDS, DIMENSIONS)
    assert Counter(p.role for p in published.values()) == {
        "input": 11,
        "target": 11,
        "consequence": 19,
        "symmetry": 1,
        "prediction": 1,
        "contradicted": 3,
    }


def test_half_widths_of_the_standing_tables_are_half_of_the_last_printed_digit() -> None:
    """None was widened to make a value fit; a column's zeros have the digits of their column."""
    digits = {
        **{f"{a}_current_2": 2 for a in ("ideal", "rotor", "reversible")},
        **{f"{a}_voltage_{j}": 3 for a in ("ideal", "rotor", "reversible") for j in (2, 3)},
        **{"ideal_power_2": 2, "rotor_power_2": 2, "reversible_power_2": 3},
        **{"rotor_motor_torque_2": 5, "reversible_motor_torque_2": 5, "rotor_motor_torque_3": 5},
        **{f"{a}_leg_energy_3s": 2 for a in ("ideal", "rotor", "reversible")},
        **{"rotor_current_3": 2, "standing_torque_2": 2, "standing_torque_3": 2},
    }
    published = load_published(IDS, DIMENSIONS)
    for name, count in digits.items():
        assert published[name].half_width == pytest.approx(0.5 * 10.0**-count), name


@pytest.mark.skipif(not SHARED, reason="the table is shared only where $LEGWATT_SHARED is set")
def test_the_printed_values_are_the_shared_ones() -> None:
    def rows(path: Path) -> list[list[str]]:
        with path.open(encoding="utf-8", newline="") as file:
            return [row[:8] for row in csv.reader(file)]  # notes may name other files

    assert rows(PUBLISHED_FILE) == rows(Path(SHARED) / "published_values.csv")


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda rows: rows[1:], "'body_length' is missing"),
        (lambda rows: [*rows, rows[0]], "is there twice"),
        (lambda rows: [rows[0].replace(",m,", ",kg,"), *rows[1:]], "unit of mass"),
        (lambda rows: [rows[0].replace(",m,", ",furlong,"), *rows[1:]], "unknown unit"),
        (lambda rows: [rows[0].replace("body_length", "body_lenght"), *rows[1:]], "did you mean"),
        (lambda rows: [rows[0].replace("0.600", "nan"), *rows[1:]], "not a finite number"),
        (lambda rows: [rows[0].replace("0.600", "x"), *rows[1:]], "not a finite number"),
        (lambda rows: [rows[0].replace("0.0005", "-1"), *rows[1:]], "must not be negative"),
        (lambda rows: [rows[0].replace("input", "inptu"), *rows[1:]], "role"),
        (lambda rows: [rows[0] + ",more", *rows[1:]], "number of columns"),
        (lambda rows: ["body_length", *rows[1:]], "number of columns"),
    ],
)
def test_bad_targets_are_one_line(tmp_path: Path, edit, message: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(TargetError, match=message) as caught:
        load_published(IDS, DIMENSIONS, written(tmp_path, edit(list(ROWS))))
    assert "\n" not in str(caught.value)


def test_a_missing_target_file_or_column_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(TargetError, match="cannot be read"):
        load_published(IDS, DIMENSIONS, tmp_path / "none.csv")
    path = tmp_path / "x.csv"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(TargetError):
        load_published(IDS, DIMENSIONS, path)
    path.write_text("id,value\n", encoding="utf-8")
    with pytest.raises(TargetError, match="column 'where' is missing"):
        load_published(IDS, DIMENSIONS, path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("bounds = [0, 60]", "bounds = [40, 60]", "bounds exclude the value"),
        ("deviation = 15.306", "deviation = 0", "deviation must be positive"),
        ('unit = "mm"', 'unit = "mmm"', "unknown unit"),
        ('scale = "linear"', 'scale = "liner"', "'scale' = 'liner': did you mean 'linear'"),
        ("value = 30", 'value = "thirty"', "'value' must be a number, not 'thirty'"),
        ("bounds = [0, 60]", "bound = [0, 60]", "did you mean 'bounds'"),
        ("value = 30", "", "missing key 'value'"),
    ],
)
def test_bad_priors_are_one_line(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = tmp_path / "prior.toml"
    path.write_text(PRIOR_FILE.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")
    with pytest.raises(PriorError, match=message) as caught:
        load_prior(path)
    assert "\n" not in str(caught.value)


def test_coordinates_are_those_of_a_unit_gaussian() -> None:
    prior = load_prior()
    z = np.linspace(-0.5, 0.5, len(prior.free))
    np.testing.assert_allclose(prior.coordinates(prior.values(z)), z, atol=1e-9)
    for free in prior.free:
        assert free.bounds[0] <= free.centre <= free.bounds[1]
        assert free.value(0.0) == pytest.approx(free.centre)
    drawn = prior.draw(np.random.default_rng(0))
    assert ((drawn >= prior.lower) & (drawn <= prior.upper)).all()


@pytest.mark.parametrize("free", load_prior().free, ids=lambda f: f.key)
def test_an_interval_holds_95_percent_of_the_belief(free: Free) -> None:
    """By integration over the belief, as much below the interval as above it."""
    z = np.linspace(free.coordinate(free.bounds[0]), free.coordinate(free.bounds[1]), 200_001)
    weight = np.exp(-0.5 * z**2)
    value, (low, high) = free.at(z), free.interval
    shares = [np.sum(weight[side]) / np.sum(weight) for side in (value < low, value > high)]
    assert shares == pytest.approx([0.025, 0.025], abs=2e-4)
    assert free.bounds[0] < low < high < free.bounds[1]


def test_the_prior_names_numbers_that_exist(root: Path) -> None:
    spec = load_robot_file(root / "urdf" / "hexapod.toml")
    catalog = load_catalog()
    known = {f"robot.{name}" for name in spec.parameters}
    known |= {f"{component}.{p.name}" for component, p in catalog.rows()}
    assert set(load_prior().keys) <= known
