"""The alternatives as written in the catalogue: elements, laws and where arguments come from."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Final, Self

from pydantic import AfterValidator, ConfigDict, Field, Strict, model_validator

from actuators.chain import JOINT_STAGE, SUPPLY_STAGE
from actuators.checked import Table, Text, checked
from actuators.elements.element import Element
from actuators.elements.friction import Friction
from actuators.elements.holding_brake import HoldingBrake
from actuators.elements.hypoid import Hypoid
from actuators.elements.inertia import Inertia
from actuators.elements.position_torque import ParallelSpring
from actuators.elements.ratio import Ratio
from actuators.elements.second_motor import SecondMotor
from actuators.errors import CatalogError, closest, one_line
from actuators.loading.components import FRICTION

ALTERNATIVES_FILE: Final = "alternatives.toml"
#: Files and columns are called after alternatives.
NAME: Final = re.compile(r"[A-Za-z0-9_-]+")


@dataclass(frozen=True)
class Law:
    """What a law's arguments are."""

    element: Callable[..., Element]  #: Its class.
    #: Arguments it must have, with the dimension of each.
    needed: Mapping[str, str] = field(default_factory=dict)
    possible: Mapping[str, str] = field(default_factory=dict)  #: Arguments it may have, likewise.

    @property
    def arguments(self) -> Mapping[str, str]:
        """Every argument and its dimension."""
        return {**self.needed, **self.possible}


LAWS: Final[Mapping[str, Law]] = {
    "ratio": Law(Ratio, {"ratio": "ratio"}),
    "inertia": Law(Inertia, {"inertia": "inertia"}),
    "friction": Law(Friction, possible=FRICTION),
    "hypoid": Law(
        Hypoid,
        {
            "ratio": "ratio",
            "pinion_angle": "angle",
            "wheel_angle": "angle",
            "wheel_radius": "length",
            "friction": "ratio",
        },
    ),
    "parallel_spring": Law(ParallelSpring, {"stiffness": "rotational stiffness", "rest": "angle"}),
    "holding_brake": Law(
        HoldingBrake,
        {"static_torque": "torque"},
        {"released_power": "power", "engaged_power": "power"},
    ),
    "second_motor": Law(
        SecondMotor,
        {"torque_constant": "torque constant", "resistance": "resistance", "share": "ratio"},
    ),
}


class ElementEntry(Table):
    """One element of an alternative as written: what is none of its keys is a law's argument."""

    model_config = ConfigDict(extra="allow")
    expected = "name, law, arguments, and for the last element stage"
    __pydantic_extra__: dict[str, str] = Field(init=False)
    name: Text  #: The element's name.
    law: str  #: Key of the table of laws.
    stage: str = ""  #: Name of the shaft on its motor side, or empty.
    shaft: str = ""  #: Where that shaft is, in words, or empty.

    @property
    def arguments(self) -> Mapping[str, str]:
        """Argument to `component.parameter`."""
        return self.__pydantic_extra__

    @model_validator(mode="after")
    def _of_the_law(self) -> Self:
        """Arguments are those of the law, and a place in words is that of a stage."""
        if self.law not in LAWS:
            raise ValueError(f"unknown law '{one_line(self.law)}': {closest(self.law, list(LAWS))}")
        law = LAWS[self.law]
        for argument in self.arguments:
            if argument not in law.arguments:
                raise ValueError(
                    f"law '{self.law}' has no argument '{one_line(argument)}': "
                    f"{closest(argument, sorted(law.arguments))}"
                )
        lacking = sorted(set(law.needed) - set(self.arguments))
        if lacking:
            names = ", ".join(f"'{name}'" for name in lacking)
            raise ValueError(f"law '{self.law}' lacks its argument {names}")
        if self.shaft and not self.stage:
            raise ValueError("'shaft' says where a stage is; name the stage, too")
        return self


@dataclass(frozen=True)
class Alternative:
    """One alternative as written."""

    name: str  #: Its key, such as `reversible`.
    title: str  #: In words.
    motor: str  #: Component of the motor.
    ratio: str  #: `component.parameter` that the product of all ratios has to equal.
    elements: tuple[ElementEntry, ...]  #: From the joint to the motor.

    @property
    def stage_names(self) -> Mapping[str, str]:
        """Every stage from the joint to the supply in words, by its short name."""
        *inner, last = [e for e in self.elements if e.stage]
        names = {e.stage: e.shaft or f"motor side of {e.name}" for e in inner}
        return {
            JOINT_STAGE: "joint",
            **names,
            last.stage: last.shaft or "motor",
            SUPPLY_STAGE: "supply",
        }

    @property
    def references(self) -> tuple[str, ...]:
        """Every `component.parameter` it names outside its motor."""
        return (self.ratio, *(r for e in self.elements for r in e.arguments.values()))


def _stages_differ(elements: tuple[ElementEntry, ...]) -> tuple[ElementEntry, ...]:
    stages = [element.stage for element in elements if element.stage]
    if not elements:
        raise ValueError("is empty, expected at least one [[NAME.element]]")
    if len(set(stages)) != len(stages):
        raise ValueError(f"a stage is named twice among {', '.join(stages)}")
    if not elements[-1].stage:
        raise ValueError(
            f"must have the key 'stage' in its last entry ({one_line(elements[-1].name)}): "
            'the name of the motor\'s shaft, such as stage = "m"'
        )
    return elements


class _Written(Table):
    """An alternative as it stands in a file."""

    title: Text
    motor: str
    ratio: str
    element: Annotated[tuple[ElementEntry, ...], Strict(False), AfterValidator(_stages_differ)]


def read_alternative(name: str, entry: object) -> Alternative:
    """Return one alternative from its table.

    Args:
        name: Its key.
        entry: What stands under it.

    Raises:
        CatalogError: The name cannot be part of a file's, a key, law or argument is unknown or
            missing, or a stage is named twice.
    """
    if not NAME.fullmatch(name):
        raise CatalogError(
            f"{ALTERNATIVES_FILE} [{one_line(name)}]: expected a name of letters a to z, digits, "
            "'_' and '-'; tables and files are called after it"
        )
    written = checked(_Written, entry, f"{ALTERNATIVES_FILE} [{one_line(name)}]", CatalogError)
    return Alternative(name, written.title, written.motor, written.ratio, written.element)
