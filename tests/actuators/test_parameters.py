"""Parameters with unit, basis and interval, and TOML as editors leave it.

Whatever else stands there is one line.
"""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actuators.errors import LegwattError
from actuators.parameters import parameters_from_table, read_toml
from actuators.text_file import read_file, read_toml_file

SCHEMA = {"mass": "mass", "torque": "torque"}


def entry(**changes):
    good = {"value": 2.0, "unit": "kg", "basis": "published", "source": "Table I"}
    return {k: v for k, v in (good | changes).items() if v is not ...}


def load(**entries):
    table = {"mass": entry(), "torque": entry(unit="mN*m")} | entries
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
        ({"mass": entry(basis=...)}, "missing key 'basis'"),
        ({"mass": entry(basis="guessed")}, "unknown basis"),
        ({"mass": entry(source="  ")}, "no source"),
        ({"mass": entry(unit="N")}, "unit of force, expected mass such as 'kg'"),
        ({"mass": entry(unit="kgg")}, "unknown unit 'kgg': did you mean 'kg'"),
        ({"mass": entry(value=math.nan)}, "finite"),
        ({"mass": entry(value=10**400)}, "finite"),
        ({"mass": entry(bounds=[3, 4])}, r"outside its bounds \[3, 4\]"),
        ({"mass": entry(interval=[3, 1])}, "runs backwards"),
        ({"mass": entry(basis="calibrated")}, "needs an interval"),
        ({"mass": entry(basis="assumed", interval=[1, 3])}, "needs a reason"),
    ],
)
def test_bad_entries_say_where_and_what(entries, message):
    with pytest.raises(LegwattError, match=message) as caught:
        load(**entries)
    assert str(caught.value).startswith("robot.toml")
    assert "\n" not in str(caught.value)


def test_replaced_returns_a_new_set_and_keeps_bounds():
    p = load(mass=entry(basis="assumed", reason="r", interval=[1, 3], bounds=[0, 9]))
    new = p.replaced("mass", 5.0).parameter("mass")
    assert (p["mass"], new.value, new.interval, new.basis) == (2.0, 5.0, (1.0, 5.0), "assumed")
    for name, value in (("mass", 10.0), ("mass", math.nan), ("torque", math.inf), ("mas", 1.0)):
        with pytest.raises(LegwattError):
            p.replaced(name, value)


@settings(max_examples=30)
@given(st.binary(max_size=200))
def test_any_bytes_give_parameters_or_a_parameter_error(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "bytes.toml"
    path.write_bytes(content)
    with pytest.raises(LegwattError) as caught:
        parameters_from_table(read_toml(path), SCHEMA, "bytes.toml")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [b"\xef\xbb\xbfa = 1\r\n", b"a = 1\n", b"a = 1"])
def test_marks_and_line_ends_do_not_matter(tmp_path, content):
    path = tmp_path / "file.toml"
    path.write_bytes(content)
    assert read_toml_file(path) == {"a": 1}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("a = 1".encode("utf-16"), "is UTF-16 text; save it as UTF-8"),
        (b"a = 1\nb = '\xe9'", "line 2: byte 0xe9 is not UTF-8 text"),
        (b"a = 1\na = 2\n", "malformed TOML: .*line 2"),
        (b"a = " + b"[" * 10_000, "tables are nested too deeply"),
        (b"a = " + b"1" * 5_000, "a number has thousands of digits"),
    ],
)
def test_what_is_no_toml_is_told_with_its_line(tmp_path, content, message):
    path = tmp_path / "file.toml"
    path.write_bytes(content)
    with pytest.raises(LegwattError, match=message) as caught:
        read_toml_file(path)
    assert "\n" not in str(caught.value)


def test_folders_devices_and_large_files_are_refused_unread(tmp_path):
    path = tmp_path / "large"
    path.write_bytes(b" " * 2000)
    with pytest.raises(LegwattError, match="has 0.002 MB, expected at most 0.001 MB"):
        read_file(path, 1000)
    for place, fact in ((tmp_path, "is a folder"), ("/dev/null", "no regular file")):
        with pytest.raises(LegwattError, match=fact):
            read_file(type(path)(place), 1000)
