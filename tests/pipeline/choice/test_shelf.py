"""Parts of designs: what is missing, what fits what, margins, and what options leave."""

from shutil import copy

import numpy as np
import pandas as pd
import pytest

import pipeline as lw
from actuators.errors import LegwattError
from actuators.loading.parts import PARTS, listed_pairs, load_parts
from pipeline.choice.options import ChooseOptions, filtered, problem_of
from pipeline.choice.shelf import Margins, PartCatalog, combinations, fit_of

KNOWN = load_parts()


def shelf_of(*names: str, margins: Margins | None = None) -> PartCatalog:
    parts = {name: KNOWN[name] for name in names}
    return PartCatalog(parts, voltage=48.0, margins=margins or Margins())


def test_a_part_that_says_less_is_filled_from_its_class():
    """A gear stripped of what it may leave out has the ranges of its class."""
    whole = KNOWN["maxon_gp_42_c_126"]
    kept = {name: whole.printed[name] for name in ("gear_ratio", "gear_continuous_torque")}
    bare = whole.model_copy(update={"name": "bare", "printed": kept})
    shelf = PartCatalog({"bare": bare, "worm": KNOWN["hpc_m1_120"]}, voltage=48.0)
    own = shelf.numbers["bare"]
    for entry in ("mass", "gear_inertia", "gear_max_speed", "gear_starting_torque"):
        assert 0.0 < own[entry].low < own[entry].high, entry
        assert own[entry].low / 3 < whole.printed[entry].value < own[entry].high * 3, entry
    assert own["gear_efficiency"].low < own["gear_efficiency"].high < 1.0
    # 2 to 50 % of what the worm loses at 40 N*m: 40 / 120 (1 / 0.25 - 1) = 1 N*m at its input.
    start = shelf.numbers["worm"]["gear_starting_torque"]
    assert (start.low, start.high) == pytest.approx((0.02, 0.5))


def test_options_leave_what_they_do_not_name():
    """A filter of motors leaves all gears of the kinds asked for, and the brakes."""
    only = ("maxon_148867", "wittenstein", "strain_wave", "planetary")
    left = filtered(KNOWN, ChooseOptions(only=only, without=("hd_",)))
    assert [name for name, part in left.items() if part.kind == "motor"] == ["maxon_148867"]
    assert {part.kind for part in left.values()} == {"motor", "planetary", "brake"}
    brakes = {name for name, part in left.items() if part.kind == "brake"}
    assert brakes
    assert all(name.startswith("wittenstein") for name in brakes)
    none = filtered(KNOWN, ChooseOptions(without=("brake",)))
    assert {part.kind for part in none.values()} & {"motor", "brake", "belt"} == {"motor", "belt"}


def test_a_motor_goes_on_gears_that_its_maker_lists_and_that_the_builder_mounts():
    names = ("maxon_148867", "maxon_607930", "maxon_gp_52_c_66", "hd_csg_17_80", "hpc_m1_40")
    shelf, pairs = shelf_of(*names), listed_pairs(PARTS)
    listed = {(motor, gear) for motor, gear, _ in combinations(shelf, pairs)}
    assert {gear for motor, gear in listed if motor == "maxon_607930"} == {"", "hd_csg_17_80"}
    assert ("maxon_148867", "maxon_gp_52_c_66") in listed
    assert not any(gear == "hpc_m1_40" for _, gear in listed)
    assert len({row[:2] for row in combinations(shelf)}) == 2 * 4
    assert {part for pair in pairs for part in pair} <= KNOWN.keys()  # no name is misspelt
    motor, bore = KNOWN["maxon_607930"], KNOWN["odri_at3_9"].printed["shaft_bore"]
    for more, says in (
        (None, "own mounting, shaft not checked"),
        (0.0, "own mounting"),
        (1e-4, ""),
    ):
        own = {} if more is None else {"shaft_diameter": bore._replace(low=bore.low + more)}
        parts = {"m": motor.model_copy(update={"printed": {**motor.printed, **own}})}
        parts["belt"] = KNOWN["odri_at3_9"]
        assert fit_of(PartCatalog(parts, voltage=48.0), "m", "belt", set()) == says
    assert fit_of(shelf_of("cubemars_ak80_64"), "cubemars_ak80_64", "", set()) == "gear inside"


def test_a_motor_whose_numbers_contradict_each_other_is_left_out_and_said(tmp_path):
    """Of 0.0302 N*m/A: 12 % apart is scatter, 24 % another motor, unit or convention."""
    for name in ("battery", "driver"):
        copy(PARTS / f"{name}.csv", tmp_path)
    table = pd.read_csv(PARTS / "motor.csv", dtype=str).set_index("name", drop=False)
    for constant, out in (("283", ()), ("254", ("maxon_148867",))):
        table.loc["maxon_148867", "speed_constant_rpm_V"] = constant
        two = table.loc[["maxon_148867", "maxon_353297"]]
        two.to_csv(tmp_path / "motor.csv", index=False)
        problem = problem_of(lw.load("urdf/leg.toml"), (), ChooseOptions(parts=tmp_path))
        assert tuple(problem.left_out) == out
        assert ("maxon_148867" in problem.shelf.parts) == (not out)
    assert "0.0302 N*m/A" in problem.left_out["maxon_148867"]
    assert "0.0376 N*m/A" in problem.left_out["maxon_148867"]
    machine, alone = lw.load("urdf/leg.toml"), ChooseOptions(parts=tmp_path, only=("maxon_148867",))
    with pytest.raises(LegwattError, match=r"no motor is left; of maxon_148867, torque_constant"):
        problem_of(machine, (), alone)


def test_numbers_of_parts_join_and_margins_divide_limits_and_nothing_else():
    design = ("maxon_634043", "hd_csg_17_80", "")
    shelf = shelf_of(*design[:2])
    plain = shelf.designs([design])
    motor, gear = shelf.designs([(design[0], "", "")]), shelf.designs([("", design[1], "")])
    assert plain.mass == motor.mass + gear.mass
    assert (plain.ratio, plain.gear_peak) == (gear.ratio, gear.gear_peak)
    assert plain.gear_momentary > plain.gear_peak  # the catalogue has both
    safe = shelf_of(*design[:2], margins=Margins(1.5, 1.15)).designs([design])
    torque = {"gear_peak", "gear_continuous", "continuous_current"}
    speed = {"gear_speed", "gear_mean_speed", "max_speed", "voltage"}
    for name, value in vars(plain).items():
        if name != "parts":
            share = 1.5 if name in torque else 1.15 if name in speed else 1.0
            assert getattr(safe, name) * share == pytest.approx(value, nan_ok=True), name
    factors = {
        (design[0], "torque_constant_factor"): 0.9,
        (design[0], "resistance_factor"): 1.07,
        (design[1], "grease_factor"): 1.5,
    }
    drawn = shelf.designs([design], factors)
    assert drawn.torque_constant == pytest.approx(0.9 * plain.torque_constant)
    assert drawn.resistance == pytest.approx(1.07 * plain.resistance)
    assert drawn.coulomb - motor.coulomb == pytest.approx(1.5 * (plain.coulomb - motor.coulomb))


def test_a_built_in_gear_bears_what_its_sheet_says_or_what_the_currents_give():
    """Without either it would win by saying less than a gear that is bought apart."""
    part = KNOWN["cubemars_ak80_64"]
    torques = ("gear_continuous_torque", "gear_peak_torque")
    bare = {name: number for name, number in part.printed.items() if name not in torques}
    parts = {"said": part, "bare": part.model_copy(update={"printed": bare})}
    found = PartCatalog(parts, voltage=48.0).designs([("said", "", ""), ("bare", "", "")])
    by_current = 64 * 0.136 * np.array([7.0, 19.0])
    assert found.gear_continuous.tolist() == pytest.approx([48.0, by_current[0]])
    assert found.gear_peak.tolist() == pytest.approx([120.0, by_current[1]])
    assert found.gear_momentary.tolist() == found.gear_peak.tolist()


def test_one_bus_bounds_windings_and_drivers_and_a_brake_held_open_takes_what_its_sheet_says():
    machine = lw.load("urdf/leg.toml")
    for options, volts in (({}, KNOWN["aspilsan_13s4p"].printed["voltage"].value), ("40 V", 40.0)):
        wanted = ChooseOptions(voltage=options or None)
        assert problem_of(machine, (), wanted).shelf.voltage == volts
    brake = KNOWN["mitsubishi_ha_ff_053b_13b"]
    more = {**brake.printed, "open_power": brake.printed["release_power"]._replace(value=2.0)}
    parts = {"plain": brake, "held": brake.model_copy(update={"printed": more})}
    parts["motor"] = KNOWN["maxon_353297"]
    winding = parts["motor"].printed["supply_voltage"].value
    for bus in (6.0, 0.5 * winding, 3.0 * winding):
        found = PartCatalog(parts, voltage=bus).designs(
            [("motor", "", b) for b in ("plain", "held")]
        )
        assert found.brake_power.tolist() == [7.0, 2.0]
        assert (found.voltage <= min(bus, winding)).all()
        assert (found.voltage > 0.85 * min(bus, winding)).all()
        assert ((found.bus_use <= 1.0) == (10.0 <= bus <= 54.0)).all()
    inside = [("rmd_x4_36", "", ""), ("rmd_x6_60", "", "")]
    own = PartCatalog(KNOWN, voltage=46.8).designs(inside)
    assert (own.bus_use <= 1.0).tolist() == [False, True]  # drives inside, for 24 and 48 V
