"""Files held against a schema, and parameters: what is wrong stands in one line, with its place."""

from __future__ import annotations

import math
import tomllib
from typing import Annotated, Any, Literal

import pytest
from pydantic import Field

from actuators.checked import Number, Pair, Table, checked
from actuators.errors import LegwattError
from actuators.parameters import ParameterSet, parameters_from_table


class Spring(Table):
    stiffness: Annotated[Number, Field(gt=0)]
    range: Pair | None = None
    name: str = ""


class Robot(Table):
    kind: Literal["arm", "leg"]
    rigid: bool = False
    springs: dict[str, Spring] = Field(default={})
    spring: Annotated[tuple[Spring, ...], Field(strict=False)] = ()
    as_: Number = Field(default=0.0, alias="as")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("kind = 'lge'", "'kind': 'lge': did you mean 'leg'"),
        ("kind = 'arm'\nrigit = true", "unknown key 'rigit': did you mean 'rigid'"),
        ("kind = 'arm'\nas = nan", "'as': Input should be a finite number, not nan"),
        (
            "kind = 'arm'\n[[spring]]\nstiffness = 1\n[[spring]]\nname = 'knee'\nstiffness = -1",
            "'spring.2 (knee).stiffness': Input should be greater than 0",
        ),
    ],
)
def test_each_error_has_its_place_and_what_was_expected(text: str, words: str) -> None:
    with pytest.raises(LegwattError) as caught:
        checked(Robot, tomllib.loads(text), "robot.toml")
    assert str(caught.value).startswith("robot.toml: ")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


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
        ({"mass": entry(unit="kgg")}, "unknown unit 'kgg': did you mean 'kg'"),
        ({"mass": entry(value=1e12)}, "beyond any machine"),
        ({"mass": entry(bounds=[3, 4])}, r"outside its bounds \[3, 4\]"),
        ({"mass": entry(basis="calibrated")}, "needs an interval"),
        ({"mass": 3}, "'mass': Input should be a valid dictionary"),
        ({"mass": ..., "torque": ...}, "missing parameter 'mass', 'torque'$"),
    ],
)
def test_bad_parameters_say_where_and_what(entries: dict[str, Any], message: str) -> None:
    with pytest.raises(LegwattError, match=message) as caught:
        load(**entries)
    assert str(caught.value).startswith("robot.toml")
    assert "\n" not in str(caught.value)


def test_replaced_returns_a_new_set_and_keeps_bounds() -> None:
    p = load(mass=entry(basis="assumed", reason="r", interval=[1, 3], bounds=[0, 9]))
    new = p.replaced("mass", 5.0).parameter("mass")
    assert (p["mass"], new.value, new.interval, new.basis) == (2.0, 5.0, (1.0, 5.0), "assumed")
    assert dict(p) == {"mass": 2.0, "torque": pytest.approx(0.002)}
    assert p.parameter("mass").spread == pytest.approx(1.0 / 1.96 / 2.0)
    assert p.parameter("torque").value_as_written == 2.0
    for name, value in (("mass", 10.0), ("mass", math.nan), ("torque", math.inf), ("mas", 1.0)):
        with pytest.raises(LegwattError, match=r"^robot.toml: "):
            p.replaced(name, value)
