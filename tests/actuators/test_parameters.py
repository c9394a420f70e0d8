"""Parameters with unit, basis and interval: whatever contradicts is one line."""

import math

import pytest

from actuators.errors import LegwattError
from actuators.parameters import parameters_from_table

SCHEMA = {"mass": "mass", "torque": "torque"}


def entry(**changes):
    good = {"value": 2.0, "unit": "kg", "basis": "published", "source": "Table I"}
    return {k: v for k, v in (good | changes).items() if v is not ...}


def load(**entries):
    table = {"mass": entry(), "torque": entry(unit="mNm")} | entries
    return parameters_from_table(table, SCHEMA, "robot.toml")


def test_values_are_si_and_rows_keep_what_was_written():
    p = load()
    assert p.parameter("torque").value_as_written == 2.0
    assert dict(p) == {"mass": 2.0, "torque": pytest.approx(0.002)}
    spread = load(mass=entry(interval=[1.0, 3.0])).parameter("mass").spread
    assert (p.parameter("mass").spread, spread) == (0.0, pytest.approx(1.0 / 1.96 / 2.0))


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ({"mas": entry()}, "unknown parameter 'mas': did you mean 'mass'"),
        ({"mass": entry(basis=...)}, "'mass': 'basis': Field required"),
        ({"mass": entry(basis="calibratd")}, "did you mean 'calibrated'"),
        ({"mass": entry(source="  ")}, "'source': is empty"),
        ({"mass": entry(unit="N")}, "unit of force, expected mass such as 'kg'"),
        ({"mass": entry(unit="kgg")}, "unknown unit 'kgg': did you mean 'kg'"),
        ({"mass": entry(value=math.nan)}, "finite"),
        ({"mass": entry(value=10**400)}, "'value': Input should be a valid number"),
        ({"mass": entry(value=1e12)}, "beyond any machine"),
        ({"mass": entry(bounds=[3, 4])}, r"outside its bounds \[3, 4\]"),
        ({"mass": entry(interval=[3, 1])}, "outside its interval"),
        ({"mass": entry(basis="calibrated")}, "needs an interval"),
        ({"mass": entry(basis="assumed", interval=[1, 3])}, "needs a reason"),
        ({"mass": 3}, "'mass': Input should be a valid dictionary"),
    ],
)
def test_bad_entries_say_where_and_what(entries, message):
    with pytest.raises(LegwattError, match=message) as caught:
        load(**entries)
    assert str(caught.value).startswith("robot.toml")
    assert "\n" not in str(caught.value)


def test_what_is_missing_is_named():
    with pytest.raises(LegwattError, match=r"^robot.toml: missing parameter 'mass', 'torque'$"):
        parameters_from_table({}, SCHEMA, "robot.toml")


def test_replaced_returns_a_new_set_and_keeps_bounds():
    p = load(mass=entry(basis="assumed", reason="r", interval=[1, 3], bounds=[0, 9]))
    new = p.replaced("mass", 5.0).parameter("mass")
    assert (p["mass"], new.value, new.interval, new.basis) == (2.0, 5.0, (1.0, 5.0), "assumed")
    for name, value in (("mass", 10.0), ("mass", math.nan), ("torque", math.inf), ("mas", 1.0)):
        with pytest.raises(LegwattError, match=r"^robot.toml: "):
            p.replaced(name, value)
