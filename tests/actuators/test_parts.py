"""Parts that can be bought: every file loads, none contradicts itself, wrong ones say where."""

from __future__ import annotations

from pathlib import Path

import pytest

from actuators.errors import ActuatorError
from actuators.loading.converted import converted
from actuators.loading.parts import KINDS, load_part, load_parts, odd

PARTS = load_parts()
RE_40 = PARTS["maxon_148867"]
TEXT = """title = "A motor"
basis = "datasheet"
source = "its sheet"

[printed]
torque_constant = "30 mN*m/A"
speed_constant = "318 rpm/V"
current_of = "dc"
resistance = "0.3 ohm"
resistance_of = "terminal"
supply_voltage = "24 V"
no_load_current = "0.1 A"
no_load_voltage = "24 V"
rotor_inertia = "140 g*cm^2"
continuous_current = "6 A"
peak_current = "20 A"
"""


@pytest.mark.parametrize(
    ("kind", "least"),
    [("motor", 30), ("strain_wave", 25), ("planetary", 20), ("self_locking", 6), ("driver", 8)],
)
def test_there_are_enough_of_every_kind(kind: str, least: int) -> None:
    assert sum(p.kind == kind for p in PARTS.values()) >= least


def test_no_part_contradicts_itself_and_each_says_where_its_numbers_are_from() -> None:
    assert [line for p in PARTS.values() for line in odd(p)] == []
    assert all(len(p.source) > 10 and p.title for p in PARTS.values())
    assert {p.kind for p in PARTS.values()} == set(KINDS)
    assert all(p.note for p in PARTS.values() if p.filled)


def test_a_motor_has_the_numbers_of_its_data_sheet() -> None:
    """RE 40: torque constant and resistance as maxon prints them, friction from no-load current."""
    x = {name: n.value for name, n in RE_40.printed.items()} | {"gear_ratio": 1.0, "shaft": 0.0}
    found = {name: value for name, (value, _) in converted(x).items()}
    assert found["motor.torque_constant"] == pytest.approx(0.0302)
    assert found["motor.resistance"] == pytest.approx(0.299)
    speed = 7580 * 3.141592653589793 / 30
    lost = found["rotor.coulomb"] + found["rotor.viscous"] * speed
    assert lost == pytest.approx(0.0302 * 0.137)
    assert RE_40.filled == ("coulomb_share", "peak_current")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("current_of", "curent_of", "no entry 'curent_of': did you mean 'current_of'"),
        ('"0.3 ohm"', '"0.3 V"', r"motor/own.toml: --resistance: '0.3 V'"),
        ('"0.3 ohm"', '"-0.3 ohm"', "expected more than 0"),
        ('"datasheet"', '"sheet"', "basis"),
        ('title = "A motor"\n', "", "title"),
        ("[printed]", "[printd]", "printed"),
    ],
)
def test_a_wrong_file_is_one_line(tmp_path: Path, old: str, new: str, says: str) -> None:
    (tmp_path / "motor").mkdir()
    path = tmp_path / "motor" / "own.toml"
    assert old in TEXT
    path.write_text(TEXT.replace(old, new), "utf-8")
    with pytest.raises(ActuatorError, match=says) as refused:
        load_part(path)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("318 rpm/V", "100 rpm/V", "--speed-constant"),
        ('"20 A"', '"2 A"', "peak current or torque is below"),
        ('peak_current = "20 A"\n', "", "missing: --peak-current or --peak-torque"),
    ],
)
def test_a_contradiction_is_said(tmp_path: Path, old: str, new: str, says: str) -> None:
    (tmp_path / "motor").mkdir()
    path = tmp_path / "motor" / "own.toml"
    path.write_text(TEXT, "utf-8")
    assert list(odd(load_part(path))) == []
    path.write_text(TEXT.replace(old, new), "utf-8")
    (line,) = odd(load_part(path))
    assert says in line


def test_folders(tmp_path: Path) -> None:
    for folder, says in ((tmp_path / "none", "no such folder"), (tmp_path, "no parts")):
        with pytest.raises(ActuatorError, match=says):
            load_parts(folder)
    (tmp_path / "moter").mkdir()
    (tmp_path / "moter" / "own.toml").write_text(TEXT, "utf-8")
    with pytest.raises(ActuatorError, match="unknown kind 'moter': did you mean 'motor'"):
        load_parts(tmp_path)
