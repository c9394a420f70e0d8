import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actuators.errors import ParameterError
from actuators.parameters import parameters_from_table, read_toml

SCHEMA = {"mass": "mass", "torque": "torque"}


def entry(**changes):
    good = {"value": 2.0, "unit": "kg", "basis": "published", "source": "Table I"}
    return {k: v for k, v in (good | changes).items() if v is not ...}


def load(**entries):
    table = {"mass": entry(), "torque": entry(unit="mN*m")} | entries
    return parameters_from_table(table, SCHEMA, "robot.toml")


def test_values_are_si_and_rows_keep_what_was_written():
    p = load()
    assert p["torque"] == pytest.approx(0.002)
    assert p.parameter("torque").value_as_written == 2.0
    assert [r.name for r in p.rows()] == ["mass", "torque"]
    assert dict(p) == {"mass": 2.0, "torque": pytest.approx(0.002)}


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ({"mas": entry()}, "unknown parameter 'mas': did you mean 'mass'"),
        ({"mass": entry(valu=1)}, "unknown key 'valu': did you mean 'value'"),
        ({"mass": entry(basis=...)}, "missing key 'basis'"),
        ({"mass": entry(source=...)}, "missing key 'source'"),
        ({"mass": entry(source="  ")}, "no source"),
        ({"mass": entry(basis="guessed")}, "unknown basis"),
        ({"mass": entry(unit="N")}, "unit of force, expected mass such as 'kg'"),
        ({"mass": entry(unit="kgg")}, "unknown unit 'kgg': did you mean 'kg'"),
        ({"mass": entry(value="2")}, "must be a number"),
        ({"mass": entry(value="x" * 100)}, f"must be a number, not '{'x' * 39}$"),
        ({"mass": entry(value=True)}, "must be a number"),
        ({"mass": entry(value=math.nan)}, "finite"),
        ({"mass": entry(value=math.inf)}, "finite"),
        ({"mass": entry(value=10**400)}, "finite"),
        ({"mass": entry(bounds=[3, 4])}, r"outside its bounds \[3, 4\]"),
        ({"mass": entry(interval=[0, 1])}, r"outside its interval \[0, 1\]"),
        ({"mass": entry(interval=[3, 1])}, "runs backwards"),
        ({"mass": entry(interval=[1])}, r"must be \[low, high\]"),
        ({"mass": entry(basis="calibrated")}, "needs an interval"),
        ({"mass": entry(basis="identified")}, "needs an interval"),
        ({"mass": entry(basis="assumed", interval=[1, 3])}, "needs a reason"),
        ({"mass": 3.0}, "expected {value, unit, basis, source}"),
        ({"mass": entry(reason=3)}, "'mass.reason' must be text"),
    ],
)
def test_bad_entries_say_where_and_what(entries, message):
    with pytest.raises(ParameterError, match=message) as caught:
        load(**entries)
    assert str(caught.value).startswith("robot.toml")
    assert "\n" not in str(caught.value)


def test_missing_parameter_unless_optional():
    table = {"mass": entry()}
    with pytest.raises(ParameterError, match="missing parameter 'torque'"):
        parameters_from_table(table, SCHEMA, "x")
    assert list(parameters_from_table(table, SCHEMA, "x", frozenset({"torque"}))) == ["mass"]


def test_replaced_returns_a_new_set_and_keeps_bounds():
    p = load(mass=entry(basis="assumed", reason="r", interval=[1, 3], bounds=[0, 9]))
    new = p.replaced("mass", 5.0)
    assert (p["mass"], new["mass"]) == (2.0, 5.0)
    assert new.parameter("mass").interval == (1.0, 5.0)
    assert new.parameter("mass").basis == "assumed"
    fitted = p.replaced("mass", 5.0, basis="calibrated", source="fit", interval=(4.0, 6.0))
    assert fitted.parameter("mass").interval == (4.0, 6.0)
    for name, value in (("mass", 10.0), ("mass", math.nan), ("torque", math.inf), ("mas", 1.0)):
        with pytest.raises(ParameterError):
            p.replaced(name, value)


@given(st.binary(max_size=200))
def test_any_bytes_give_parameters_or_a_parameter_error(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "bytes.toml"
    path.write_bytes(content)
    with pytest.raises(ParameterError) as caught:
        parameters_from_table(read_toml(path), SCHEMA, "bytes.toml")
    assert "\n" not in str(caught.value)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6), inner),
    max_leaves=8,
)
KEYS = st.sampled_from(["value", "unit", "basis", "source", "interval", "bounds", "reason", "x"])
PLAUSIBLE = (
    JSON
    | st.sampled_from(["kg", "N*m", "assumed", "published", "calibrated"])
    | st.lists(st.floats(), min_size=2, max_size=2)
)


@given(st.dictionaries(KEYS, PLAUSIBLE))
def test_any_entry_is_valid_or_an_actuator_error(fields):
    try:
        p = load(mass=fields)
    except ParameterError as error:
        message = str(error)
    else:
        message = ""
        mass = p.parameter("mass")
        assert math.isfinite(mass.value)
        assert mass.basis not in ("calibrated", "identified", "assumed") or mass.interval
    assert "\n" not in message


def test_an_interval_tells_a_spread():
    p = load(mass=entry(basis="assumed", reason="guess", interval=[1.0, 3.0]))
    assert p.parameter("mass").spread == pytest.approx(1.0 / 1.96 / 2.0)
    assert p.parameter("torque").spread == 0.0
