"""Files held against a schema: what is wrong stands in one line, with its place."""

from __future__ import annotations

import math
import tomllib
from typing import Annotated, Literal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import AfterValidator, Field

from actuators.checked import Names, Number, Pair, Table, checked, read_bytes, read_toml
from actuators.errors import LegwattError


def _positive(value: float) -> float:
    if value <= 0.0:
        raise ValueError("must be positive")
    return value


class Spring(Table):
    stiffness: Annotated[Number, AfterValidator(_positive)]
    range: Pair | None = None
    name: str = ""


class Robot(Table):
    kind: Literal["arm", "leg"]
    rigid: bool = False
    joints: Names = ()
    springs: dict[str, Spring] = Field(default={})
    spring: Annotated[tuple[Spring, ...], Field(strict=False)] = ()
    as_: Number = Field(default=0.0, alias="as")


def said(text: str) -> str:
    with pytest.raises(LegwattError) as caught:
        checked(Robot, tomllib.loads(text), "robot.toml")
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith("robot.toml: ")
    return message.removeprefix("robot.toml: ")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("kind = 'lge'", "'kind': 'lge': did you mean 'leg'"),
        ("kind = 'arm'\nrigit = true", "unknown key 'rigit': did you mean 'rigid'"),
        ("kind = 'arm'\nas = nan", "'as': Input should be a finite number, not nan"),
        ("kind = 'arm'\njoints = [1]", "'joints.1': Input should be a valid string, not 1"),
        ("kind = 'arm'\nsprings.knee = 3", "'springs.knee': Input should be a valid dict"),
        ("kind = 'arm'\n[springs.knee]", "'springs.knee.stiffness': Field required"),
        (
            "kind = 'arm'\n[[spring]]\nstiffness = 1\n[[spring]]\nname = 'knee'\nstiffness = -1",
            "'spring.2 (knee).stiffness': must be positive",
        ),
    ],
)
def test_each_error_has_its_place_and_what_was_expected(text: str, words: str) -> None:
    assert words in said(text)


LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=6)
KEYS = st.sampled_from(["kind", "rigid", "joints", "springs", "spring", "as", "stiffness", "x"])
TABLES = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=4),
    max_leaves=10,
)


@settings(max_examples=25)
@given(TABLES)
def test_any_table_is_read_or_refused_in_one_line(table: object) -> None:
    message = ""
    try:
        assert math.isfinite(checked(Robot, table, "robot.toml").as_)
    except LegwattError as error:
        message = str(error)
    assert "\n" not in message


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("a = 1".encode("utf-16"), "line 1: byte 0xff is not UTF-8 text; save it as UTF-8"),
        (b"a = 1\nb = '\xe9'", "line 2: byte 0xe9 is not UTF-8 text"),
        (b"a = 1\na = 2\n", "malformed TOML: .*line 2"),
        (b"a = " + b"[" * 10_000, "malformed TOML: .*recursion"),
        (b"a = " + b"1" * 5_000, "malformed TOML: .*digits"),
    ],
)
def test_what_is_no_toml_is_told_with_its_file(tmp_path, content, message):
    path = tmp_path / "file.toml"
    path.write_bytes(content)
    with pytest.raises(LegwattError, match=f"file.toml: {message}") as caught:
        read_toml(path)
    assert "\n" not in str(caught.value)


def test_folders_devices_and_large_files_are_refused(tmp_path):
    path = tmp_path / "large"
    path.write_bytes(b" " * 2000)
    with pytest.raises(LegwattError, match="has more than 0.001 MB"):
        read_bytes(path, 1000)
    odd = {"is a folder": tmp_path, "no regular file": "/dev/null", "no such file": tmp_path / "x"}
    for fact, place in odd.items():
        with pytest.raises(LegwattError, match=fact):
            read_bytes(type(path)(place), 1000)
    with pytest.raises(LegwattError, match="cannot be read"):
        read_bytes(type(path)("a\0b"))
