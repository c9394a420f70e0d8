"""Tables held against a schema: every error at once, each with its place, all in one line."""

from __future__ import annotations

import math
import tomllib
from typing import Annotated, Literal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import AfterValidator, Field

from actuators.checked import Names, Number, Pair, Table, checked


def _positive(value: float) -> float:
    if value <= 0.0:
        raise ValueError("must be positive")
    return value


class Spring(Table):
    noun = "property"
    expected = "{stiffness, range}"
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
    with pytest.raises(KeyError) as caught:
        checked(Robot, tomllib.loads(text), "robot.toml", KeyError)
    (message,) = caught.value.args
    assert "\n" not in message
    assert message.startswith("robot.toml: ")
    return str(message).removeprefix("robot.toml: ")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("kind = 'lge'", "did you mean 'leg'"),
        ("kind = 'arm'\nrigit = true", "unknown key 'rigit': did you mean 'rigid'"),
        ("kind = 'arm'\nas = nan", "'as' must be a finite number"),
        ("kind = 'arm'\njoints = [1]", "'joints 1' must be text"),
        ("kind = 'arm'\nsprings.knee = 3", "'springs.knee' must be a table, expected {stiffness"),
        ("kind = 'arm'\n[springs.knee]", "'springs.knee': missing property 'stiffness'"),
        (
            "kind = 'arm'\n[[spring]]\nstiffness = 1\n[[spring]]\nname = 'knee'\nstiffness = -1",
            "'spring 2 (knee).stiffness' must be positive",
        ),
    ],
)
def test_each_error_has_its_place_and_what_was_expected(text: str, words: str) -> None:
    assert words in said(text)


def test_errors_of_a_table_are_told_together_up_to_what_one_reads() -> None:
    assert len(said("rigid = 1\n[springs.a]\n[springs.b]\nstiffness = 0").split("; ")) == 4
    many = "".join(f"[springs.s{k}]\nstiffness = 0\n" for k in range(20))
    message = said("kind = 'arm'\n" + many)
    assert 3 < message.count("must be positive") < 20
    assert len(message) < 450


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
        assert math.isfinite(checked(Robot, table, "robot.toml", KeyError).as_)
    except KeyError as error:
        message = error.args[0]
    assert "\n" not in message
