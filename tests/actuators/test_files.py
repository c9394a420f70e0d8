"""Files of actuators and parts: all load, units, edges, and what is refused."""

import csv
import math
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from actuators.errors import LegwattError
from actuators.loading.build import CATALOG, load_catalog
from actuators.loading.data_sheet import KINDS, read_entry
from actuators.loading.parts import PARTS, Part, load_parts, odd
from actuators.parameters import (
    UNITS,
    ParameterSet,
    dimension,
    from_si,
    parameters_from_table,
    quantity,
    si_unit,
    to_si,
)
from tests.actuators.motions import ALTERNATIVES


def entry(**changes: Any) -> dict[str, Any]:
    good = {"value": 2.0, "unit": "kg", "basis": "published", "source": "Table I"}
    return {k: v for k, v in (good | changes).items() if v is not ...}


def load(**entries: Any) -> ParameterSet:
    table = {"mass": entry(), "torque": entry(unit="mNm")} | entries
    table = {name: one for name, one in table.items() if one is not ...}
    return parameters_from_table(table, {"mass": "mass", "torque": "torque"}, "robot.toml")


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ({"mas": entry()}, "unknown parameter 'mas': did you mean 'mass'"),
        ({"mass": entry(unit="N")}, "unit of force, expected mass such as 'kg'"),
        ({"mass": entry(value=1e12)}, "beyond any machine"),
        ({"mass": entry(bounds=[3, 4])}, r"outside its bounds \[3, 4\]"),
        ({"mass": entry(basis="calibrated")}, "needs an interval"),
        ({"mass": 3}, "'mass': Input should be a valid dictionary"),
        ({"mass": ..., "torque": ...}, "missing parameter 'mass', 'torque'$"),
    ],
)
def test_bad_parameters_say_where_and_what(entries, message):
    with pytest.raises(LegwattError, match=message) as caught:
        load(**entries)
    assert str(caught.value).startswith("robot.toml")
    assert "\n" not in str(caught.value)


def test_replaced_returns_a_new_set_and_keeps_bounds():
    p = load(mass=entry(basis="assumed", reason="r", interval=[1, 3], bounds=[0, 9]))
    new = p.replaced("mass", 5.0).parameter("mass")
    assert (p["mass"], new.value, new.interval, new.basis) == (2.0, 5.0, (1.0, 5.0), "assumed")
    assert dict(p) == {"mass": 2.0, "torque": pytest.approx(0.002)}
    assert p.parameter("mass").spread == pytest.approx(1.0 / 1.96 / 2.0)
    assert p.parameter("torque").value_as_written == 2.0
    for name, value in (("mass", 10.0), ("mass", math.nan), ("torque", math.inf), ("mas", 1.0)):
        with pytest.raises(LegwattError, match=r"^robot.toml: "):
            p.replaced(name, value)


def own_motor(folder: Path, kind: str = "motor", **changes: str) -> Path:
    """A folder with the maxon RE 40 alone and other cells; None takes a column out."""
    with (PARTS / "motor.csv").open(encoding="utf-8", newline="") as file:
        row = next(r for r in csv.DictReader(file) if r["name"] == "maxon_148867")
    row = {k: v for k, v in (row | changes).items() if v is not None}
    with (folder / f"{kind}.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, row)
        writer.writeheader()
        writer.writerow(row)
    return folder


def loaded(folder: Path) -> Part:
    return load_parts(folder)["maxon_148867"]


def test_no_part_contradicts_itself_and_each_says_where_its_numbers_are_from():
    parts = load_parts()
    assert len(parts) == 196
    assert [line for p in parts.values() for line in odd(p)] == []
    assert all(len(p.source) > 10 and p.title for p in parts.values())
    assert {p.kind for p in parts.values()} == set(KINDS)
    assert all(p.note for p in parts.values() if p.filled)
    assert parts["maxon_148867"].filled == ("coulomb_share", "peak_current")
    assert parts["moteus_r4_11"].bases == {"on_resistance": "derived"}
    gear = parts["hd_csg_17_80"]  # 29 N*m rated, 35 on average, 56 again and again; 7300 rpm
    for name, text, says in (
        ("gear_life_torque", "36 N*m", "gear_life_torque exceeds gear_continuous_torque"),
        ("gear_mean_speed", "8000 rpm", "gear_mean_speed exceeds gear_max_speed"),
        ("gear_life_speed", "", "a life is not used without gear_life_speed"),
    ):
        changed = {name: read_entry(name, text, KINDS[gear.kind])} if text else {}
        left = {entry: number for entry, number in gear.printed.items() if entry != name}
        assert odd(gear.model_copy(update={"printed": left | changed})) == [says]
    printed = parts["maxon_148867"].printed
    constant = printed["torque_constant"]  # its speed and torque constants agree within 1 %
    for share, contradicts in ((0.92, False), (1.09, False), (0.88, True), (1.11, True)):
        x = share * constant.value
        other = printed | {"torque_constant": constant._replace(value=x, low=x, high=x)}
        motor = parts["maxon_148867"].model_copy(update={"printed": other})
        assert bool(odd(motor)) == contradicts


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"curent_of": "dc"}, "motor.csv: unknown column 'curent_of': did you mean 'current_of'"),
        ({"resistance_V": "0.3"}, "resistance: '0.3 V': expected a resistance"),
        ({"resistance_ohm": "-0.3"}, r"line 2 \(maxon_148867\): .* expected more than 0"),
        ({"basis": "datashet"}, "line 2: 'basis': 'datashet': did you mean 'datasheet'"),
        ({"peak_current_low_A": ""}, "peak_current: a range needs both columns"),
        ({"peak_current_A": "30"}, "peak_current: 30 A lies outside its range 12 to 24 A"),
    ],
)
def test_a_wrong_row_is_one_line(tmp_path, changes, says):
    with pytest.raises(LegwattError, match=says) as refused:
        loaded(own_motor(tmp_path, **changes))
    assert "\n" not in str(refused.value)


def test_folders(tmp_path):
    for folder, says in ((tmp_path / "none", "no such folder"), (tmp_path, "no parts")):
        with pytest.raises(LegwattError, match=says):
            load_parts(folder)
    path = own_motor(tmp_path) / "motor.csv"
    text = path.read_text("utf-8")
    path.write_text(text + text.splitlines()[1] + "\n", "utf-8")
    with pytest.raises(LegwattError, match="motor.csv: maxon_148867: another part has this name"):
        load_parts(tmp_path)


@pytest.fixture
def copy(tmp_path):
    return shutil.copytree(CATALOG, tmp_path / "catalog")


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("alternatives.toml", '"hypoid.ratio"', '"hypoid.rato"', "did you mean 'ratio'"),
        ("alternatives.toml", 'friction = "hypoid.friction"\n', "", "lacks its argument"),
        ("alternatives.toml", 'stage = "ph"', 'stage = "mp"', "named twice"),
        ("alternatives.toml", 'viscous = "pinion.viscous"\n', "", "used by no alternative"),
        ("alternatives.toml", 'stage = "ph"\n', "", "name the stage, too"),
        ("alternatives.toml", 'stage = "m"\n', "", r"entry \(transmission\) lacks the key 'stage'"),
        ("alternatives.toml", '"rotor_re40.inertia"', '"rotor_re40.coulomb"', "expected inertia"),
        ("alternatives.toml", r"^(\[+)rotor\b", r'\1"../up"', "expected a name of letters"),
        ("planetary.toml", r"value = [\d.]+\n", "value = 13\n", "ratios multiply to"),
    ],
)
def test_typos_give_one_clear_line(copy, file, old, new, message):
    changed, count = re.subn(old, new, (copy / file).read_text(), flags=re.M)
    assert count
    (copy / file).write_text(changed)
    with pytest.raises(LegwattError, match=message) as caught:
        load_catalog(copy)
    assert "\n" not in str(caught.value)


def test_edits_do_not_touch_the_original_of_four_alternatives():
    catalog = load_catalog()
    ratios = {name: chain.ratio for name, chain in catalog.chains().items()}
    assert ratios == pytest.approx(dict.fromkeys(ALTERNATIVES, 400.0), rel=1e-9)
    edited = catalog.replaced("rotor_re40.coulomb", 0.0)
    held = edited.chain("rotor").holding(np.array([4.0]))
    assert held.motor_torque[0] == pytest.approx(0.01)
    assert catalog.parameter("rotor_re40.coulomb").value > 0.0
    with pytest.raises(LegwattError, match="no alternative 'reversibel'.*'reversible'"):
        catalog.chain("reversibel")
    with pytest.raises(LegwattError, match="change them together"):
        catalog.replaced("planetary.ratio", 10.0).chain("irreversible")


RPM, DEGREE = 2.0 * math.pi / 60.0, math.pi / 180.0  # [rad/s], [rad]
MILLI = ("mm", "g", "ms", "mm/s", "mN*m", "mN*m*s/rad", "mW", "mJ", "mA", "mV", "mohm", "mH")
#: Every unit that is not its dimension's SI unit.
SI = {
    **dict.fromkeys((*MILLI, "mN*m/A", "mN*m/sqrt(W)"), 1 / 1000),
    **dict.fromkeys(("%", "cm", "cN*m", "N*cm", "%/K"), 1 / 100),
    **dict.fromkeys(("kN", "kN/m", "N/mm"), 1000.0),
    **{"us": 1 / 1000**2, "ns": 1 / 1000**3, "min": 60.0, "h": 3600.0, "m/min": 1 / 60},
    **{"deg": DEGREE, "deg/s": DEGREE, "rpm": RPM, "rpm/V": RPM, "N*m/deg": 1 / DEGREE},
    **{"g*cm^2": 1 / 1000 / 100**2, "kg*cm^2": 1 / 100**2, "g/cm^3": 100**3 / 1000},
    **{"mN*m/krpm": 1 / 1000 / (1000 * RPM), "mN*m/rpm": 1 / 1000 / RPM},
    **dict.fromkeys(("kg*cm", "kgf*cm"), 9.80665 / 100),
    **{"Wh": 3600.0, "Wh/kg": 3600.0, "V*s/rad": 1.0, "V/krpm": 1 / (1000 * RPM), "degC": 1.0},
}


def test_every_unit_has_the_factor_of_its_prefixes():
    for unit in UNITS:
        factor = to_si(1.0, unit) - to_si(0.0, unit)
        assert factor == pytest.approx(SI.get(unit, 1.0), rel=1e-12), unit
        assert (unit in SI) == (unit != si_unit(dimension(unit))), unit
        assert to_si(0.0, unit) == (273.15 if unit == "degC" else 0.0)
        assert from_si(to_si(3.0, unit), unit) == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("written", "kind", "si"),
    [
        (0, "velocity", 0.0),
        ("35 mNm", "torque", 0.035),
        ("579 g cm²", "inertia", 579e-7),
        ("2.5 mΩ", "resistance", 2.5e-3),
        ("25 °C", "temperature", 298.15),
        ("9:1", "ratio", 9.0),
        (240, "length", "240 has no unit; expected such as '1 m'"),
        ("5 kg", "length", "'5 kg': expected a length such as '1 m'"),
        ("5 mN*", "length", "unknown unit 'mN*': did you mean 'mN*m'"),
        (True, "ratio", "True is no finite number"),
    ],
)
def test_a_number_written_with_its_unit_is_si_or_refused(written, kind, si):
    if isinstance(si, float):
        assert quantity(written, kind) == pytest.approx(si)
    else:
        with pytest.raises(LegwattError, match=re.escape(si)):
            quantity(written, kind)
