"""What a catalogue may hold: laws with their numbers, and the alternatives built from them."""

import re
from collections.abc import Mapping
from typing import Annotated, Final, Self

from pydantic import AfterValidator, ConfigDict, Field, Strict, model_validator

from actuators.chain import JOINT_STAGE, SUPPLY_STAGE
from actuators.checked import Table, Text
from actuators.elements.element import Element, Friction, Inertia, Ratio
from actuators.elements.hypoid import Hypoid
from actuators.elements.position_torque import PositionTorque
from actuators.errors import known, one_line
from actuators.shaft import DCMotor

ALTERNATIVES_FILE: Final = "alternatives.toml"
#: Files and columns are called after alternatives.
NAME: Final = re.compile(r"[A-Za-z0-9_-]+")


LAWS: Final[Mapping[str, type[Element]]] = {
    "ratio": Ratio,
    "friction": Friction,
    "inertia": Inertia,
    "hypoid": Hypoid,
    "parallel_spring": PositionTorque,
}
#: The component that is the chain's motor.
MOTOR_KIND: Final = "dc_motor"
MOTOR: Final = DCMotor.stated()
#: Numbers of any other component, which are arguments of laws, with their dimensions.
NUMBERS: Final = {name: kind for law in LAWS.values() for name, kind in law.stated().items()}


class ElementEntry(Table):
    """One element of an alternative as written: what is none of its keys is a law's argument."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, str] = Field(init=False)
    name: Text
    law: Annotated[str, AfterValidator(lambda word: known("unknown law", word, LAWS))]
    stage: str = ""  #: Name of the shaft on its motor side, or empty.
    shaft: str = ""  #: Where that shaft is, in words, or empty.

    @property
    def arguments(self) -> Mapping[str, str]:
        """Argument to `component.parameter`."""
        return self.__pydantic_extra__

    @model_validator(mode="after")
    def _of_the_law(self) -> Self:
        law = LAWS[self.law]
        for argument in self.arguments:
            known(f"law '{self.law}' has no argument", argument, law.stated())
        if lacking := ", ".join(f"'{n}'" for n in law.needed() if n not in self.arguments):
            raise ValueError(f"law '{self.law}' lacks its argument {lacking}")
        if self.shaft and not self.stage:
            raise ValueError("'shaft' says where a stage is; name the stage, too")
        return self


def _stages_differ(elements: tuple[ElementEntry, ...]) -> tuple[ElementEntry, ...]:
    stages = [element.stage for element in elements if element.stage]
    if len(set(stages)) != len(stages):
        raise ValueError(f"a stage is named twice among {', '.join(stages)}")
    if not elements[-1].stage:
        raise ValueError(
            f"the last entry ({one_line(elements[-1].name)}) lacks the key 'stage': the name of "
            'the motor\'s shaft, such as stage = "m"'
        )
    return elements


class Alternative(Table):
    """One alternative as written."""

    model_config = ConfigDict(populate_by_name=False)
    title: Text
    motor: str  #: Component of the motor.
    ratio: str  #: `component.parameter` that the product of all ratios has to equal.
    #: From the joint to the motor.
    elements: Annotated[
        tuple[ElementEntry, ...],
        Strict(False),
        Field(alias="element", min_length=1),
        AfterValidator(_stages_differ),
    ]

    @property
    def stage_names(self) -> Mapping[str, str]:
        """Every stage from the joint to the supply in words, by its short name."""
        *inner, last = [e for e in self.elements if e.stage]
        names = {e.stage: e.shaft or f"motor side of {e.name}" for e in inner}
        names[last.stage] = last.shaft or "motor"
        return {JOINT_STAGE: "joint", **names, SUPPLY_STAGE: "supply"}

    @property
    def references(self) -> tuple[str, ...]:
        """Every `component.parameter` it names outside its motor."""
        return (self.ratio, *(r for e in self.elements for r in e.arguments.values()))
