"""Parts of designs: what is missing, what fits what, margins, and what options leave."""

from __future__ import annotations

import csv
from pathlib import Path
from shutil import copy

import numpy as np
import pytest

import pipeline as lw
from actuators.errors import LegwattError
from actuators.loading.parts import PARTS, load_parts
from pipeline.choice.options import ChooseOptions, filtered, problem_of
from pipeline.choice.shelf import Margins, PartCatalog, combinations, listed_pairs
from tests.actuators.test_parts import own_motor


def test_a_part_that_says_less_is_filled_from_its_class() -> None:
    """A strain wave gear stripped of what it may leave out has the ranges of its class."""
    parts = load_parts()
    whole = parts["maxon_gp_42_c_126"]
    kept = {name: whole.printed[name] for name in ("gear_ratio", "gear_continuous_torque")}
    bare = whole.model_copy(update={"name": "bare", "printed": kept})
    shelf = PartCatalog(
        {"bare": bare, "worm": parts["hpc_m1_120"].model_copy(update={"name": "worm"})},
        voltage=48.0,
    )
    own = shelf.numbers["bare"]
    for entry in ("mass", "gear_inertia", "gear_max_speed", "gear_starting_torque"):
        assert 0.0 < own[entry].low < own[entry].high, entry
        assert own[entry].low / 3 < whole.printed[entry].value < own[entry].high * 3, entry
    assert own["gear_efficiency"].low < own["gear_efficiency"].high < 1.0
    # 2 to 50 % of what the worm loses at 40 N*m: 40 / 120 (1 / 0.25 - 1) = 1 N*m at its input.
    start = shelf.numbers["worm"]["gear_starting_torque"]
    assert (start.low, start.high) == pytest.approx((0.02, 0.5))


def test_options_leave_what_they_do_not_name() -> None:
    """A filter of motors leaves all gears of the kinds asked for, and the brakes."""
    only = ("maxon_148867", "wittenstein", "strain_wave", "planetary")
    left = filtered(load_parts(), ChooseOptions(only=only, without=("hd_",)))
    assert [name for name, part in left.items() if part.kind == "motor"] == ["maxon_148867"]
    assert {part.kind for part in left.values()} == {"motor", "planetary", "brake"}
    brakes = {name for name, part in left.items() if part.kind == "brake"}
    assert brakes
    assert all(name.startswith("wittenstein") for name in brakes)
    none = filtered(load_parts(), ChooseOptions(without=("brake",)))
    assert {part.kind for part in none.values()} & {"motor", "brake", "belt"} == {"motor", "belt"}


def test_a_motor_goes_on_gears_that_its_maker_lists_and_that_the_builder_mounts() -> None:
    parts = load_parts()
    names = ("maxon_148867", "maxon_607930", "maxon_gp_52_c_66", "hd_csg_17_80", "hpc_m1_40")
    shelf = PartCatalog({name: parts[name] for name in names}, voltage=48.0)
    pairs = listed_pairs(PARTS)
    listed = {(motor, gear) for motor, gear, _ in combinations(shelf, pairs)}
    assert {gear for motor, gear in listed if motor == "maxon_607930"} == {"", "hd_csg_17_80"}
    assert ("maxon_148867", "maxon_gp_52_c_66") in listed
    assert not any(gear == "hpc_m1_40" for _, gear in listed)
    assert len({row[:2] for row in combinations(shelf)}) == 2 * 4
    assert {part for pair in pairs for part in pair} <= parts.keys()  # no name is misspelt


def test_a_motor_whose_numbers_contradict_each_other_is_left_out_and_said(tmp_path: Path) -> None:
    """Of 0.0302 N*m/A: 12 % apart is scatter, 24 % another motor, unit or convention."""
    machine = lw.load("urdf/leg.toml")
    for constant, out in (("283 rpm/V", ()), ("254 rpm/V", ("maxon_148867",))):
        own_motor(tmp_path, speed_constant_rpm_V=constant.split()[0])
        for name in ("battery", "driver"):
            copy(PARTS / f"{name}.csv", tmp_path)
        text = (PARTS / "motor.csv").read_text("utf-8").splitlines(keepends=True)
        other = next(line for line in text if line.startswith("maxon_353297"))
        row = next(csv.DictReader([text[0], other]))
        path = tmp_path / "motor.csv"
        kept = path.read_text("utf-8").splitlines()[0].split(",")
        with path.open("a", encoding="utf-8", newline="") as file:
            csv.DictWriter(file, kept).writerow(row)
        problem = problem_of(machine, (), ChooseOptions(parts=tmp_path))
        assert tuple(problem.left_out) == out
        assert ("maxon_148867" in problem.shelf.parts) == (not out)
    assert "0.0302 N*m/A" in problem.left_out["maxon_148867"]
    assert "0.0376 N*m/A" in problem.left_out["maxon_148867"]
    with pytest.raises(LegwattError, match=r"no motor is left; of maxon_148867, torque_constant"):
        problem_of(machine, (), ChooseOptions(parts=tmp_path, only=("maxon_148867",)))


def test_margins_divide_limits_and_nothing_else() -> None:
    parts = load_parts()
    design = [("maxon_148867", "maxon_gp_52_c_66", "")]
    own = {name: parts[name] for name in design[0] if name}
    plain, safe = (
        PartCatalog(own, voltage=48.0, margins=margins).designs(design)
        for margins in (Margins(), Margins(1.5, 1.15))
    )
    torque = {"gear_peak", "gear_continuous", "continuous_current"}
    speed = {"gear_speed", "max_speed", "voltage"}
    for name, value in vars(plain).items():
        if name != "parts":
            share = 1.5 if name in torque else 1.15 if name in speed else 1.0
            assert getattr(safe, name) * share == pytest.approx(value, nan_ok=True), name


def test_numbers_of_parts_add_ratios_multiply_and_the_lower_limit_holds() -> None:
    parts = load_parts()
    shelf = PartCatalog(
        {name: parts[name] for name in ("maxon_634043", "hd_csg_17_80")}, voltage=48.0
    )
    motor, gear = ("maxon_634043", "", ""), ("", "hd_csg_17_80", "")
    both = shelf.designs([(*motor[:1], *gear[1:])])
    one, two = shelf.designs([motor]), shelf.designs([gear])
    assert both.mass == one.mass + two.mass
    assert (both.ratio, both.gear_peak) == (two.ratio, two.gear_peak)
    assert np.isinf(one.gear_peak)
    assert both.gear_momentary > both.gear_peak  # the catalogue has both


def test_a_drawn_factor_scales_what_it_names() -> None:
    parts = load_parts()
    design = [("maxon_634043", "hd_csg_17_80", "")]
    shelf = PartCatalog({name: parts[name] for name in design[0] if name}, voltage=48.0)
    factors = {
        ("maxon_634043", "torque_constant_factor"): 0.9,
        ("maxon_634043", "resistance_factor"): 1.07,
        ("hd_csg_17_80", "grease_factor"): 1.5,
    }
    middle, drawn = shelf.designs(design), shelf.designs(design, factors)
    assert drawn.torque_constant == pytest.approx(0.9 * middle.torque_constant)
    assert drawn.resistance == pytest.approx(1.07 * middle.resistance)
    alone = shelf.designs([("", "hd_csg_17_80", "")])
    assert drawn.coulomb - middle.coulomb == pytest.approx(0.5 * alone.coulomb, rel=0.2)
    unknown = {(part, entry) for part, entry, _ in shelf.unknown(design[0])}
    assert factors.keys() <= unknown


def test_a_driver_adds_its_mass_and_one_without_has_the_range_of_its_class() -> None:
    parts = load_parts()
    motor = {"maxon_148867": parts["maxon_148867"]}
    stated, other = (
        PartCatalog(motor, parts[name], voltage=48.0) for name in ("moteus_x1", "odrive_s1")
    )
    own = (
        stated.designs([("maxon_148867", "", "")]).mass
        - parts["maxon_148867"].printed["mass"].value
    )
    assert own == pytest.approx(0.0238)
    mass = other.numbers["odrive_s1"]["mass"]
    assert (mass.low, mass.high) == (0.0089, 0.0238)
