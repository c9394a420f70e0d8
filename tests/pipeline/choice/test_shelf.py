"""Parts of designs: what is missing, what fits what, margins, and what options leave."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from actuators.loading.parts import PARTS, load_parts
from pipeline.choice.options import ChooseOptions, filtered
from pipeline.choice.shelf import Margins, PartCatalog, combinations, listed_pairs


def test_a_part_that_says_less_is_filled_from_its_class() -> None:
    """A strain wave gear stripped of what it may leave out has the ranges of its class."""
    parts = load_parts()
    whole = parts["maxon_gp_42_c_126"]
    kept = {name: whole.printed[name] for name in ("gear_ratio", "gear_continuous_torque")}
    bare = replace(whole, name="bare", printed=kept)
    shelf = PartCatalog.of({"bare": bare, "worm": replace(parts["hpc_m1_120"], name="worm")})
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
    only, kinds = ("maxon_148867", "wittenstein"), ("strain_wave", "planetary")
    wanted = ChooseOptions(only=only, without=("hd_",), kind=kinds)
    left = filtered(load_parts(), wanted)
    assert [name for name, part in left.items() if part.kind == "motor"] == ["maxon_148867"]
    assert {part.kind for part in left.values()} == {"motor", "planetary", "brake"}
    assert any(name.startswith("mitsubishi") for name in left)


def test_a_motor_goes_on_gears_that_its_maker_lists_and_that_the_builder_mounts() -> None:
    parts = load_parts()
    names = ("maxon_148867", "maxon_607930", "maxon_gp_52_c_66", "hd_csg_17_80", "hpc_m1_40")
    shelf = PartCatalog.of({name: parts[name] for name in names})
    pairs = listed_pairs(PARTS)
    listed = {(motor, gear) for motor, gear, _ in combinations(shelf, pairs)}
    assert {gear for motor, gear in listed if motor == "maxon_607930"} == {"", "hd_csg_17_80"}
    assert ("maxon_148867", "maxon_gp_52_c_66") in listed
    assert not any(gear == "hpc_m1_40" for _, gear in listed)
    assert len({row[:2] for row in combinations(shelf)}) == 2 * 4
    assert {part for pair in pairs for part in pair} <= parts.keys()  # no name is misspelt


def test_margins_divide_limits_and_nothing_else() -> None:
    parts = load_parts()
    design = [("maxon_148867", "maxon_gp_52_c_66", "")]
    own = {name: parts[name] for name in design[0] if name}
    plain, safe = (
        PartCatalog.of(own, voltage=48.0, margins=margins).designs(design)
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
    shelf = PartCatalog.of({name: parts[name] for name in ("maxon_634043", "hd_csg_17_80")})
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
    shelf = PartCatalog.of({name: parts[name] for name in design[0] if name})
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
    stated, other = (PartCatalog.of(motor, parts[name]) for name in ("moteus_x1", "odrive_s1"))
    own = (
        stated.designs([("maxon_148867", "", "")]).mass
        - parts["maxon_148867"].printed["mass"].value
    )
    assert own == pytest.approx(0.0238)
    mass = other.numbers["odrive_s1"]["mass"]
    assert (mass.low, mass.high) == (0.0089, 0.0238)
