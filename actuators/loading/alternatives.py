"""What a catalogue may hold: laws with their numbers, and the alternatives built from them."""

import re
from collections.abc import Callable, Mapping
from typing import Annotated, Final, NamedTuple, Self

from pydantic import AfterValidator, ConfigDict, Field, Strict, model_validator

from actuators.chain import JOINT_STAGE, SUPPLY_STAGE
from actuators.checked import Table, Text
from actuators.elements.element import Element, Friction, Inertia, Ratio
from actuators.elements.holding_brake import HoldingBrake
from actuators.elements.hypoid import Hypoid
from actuators.elements.position_torque import PositionTorque
from actuators.errors import known, one_line

ALTERNATIVES_FILE: Final = "alternatives.toml"
#: Files and columns are called after alternatives.
NAME: Final = re.compile(r"[A-Za-z0-9_-]+")


class Law(NamedTuple):
    """An element's class, and its arguments with the dimension of each."""

    element: Callable[..., Element]
    needed: Mapping[str, str] = {}
    possible: Mapping[str, str] = {}

    @property
    def arguments(self) -> dict[str, str]:
        """Every argument and its dimension."""
        return {**self.needed, **self.possible}


_FRICTION: Final = {
    "coulomb": "torque",
    "load": "ratio",
    "viscous": "viscous friction",
    "skew": "torque",
    "excess": "torque",
    "stribeck_speed": "angular velocity",
    "when_driving": "ratio",
    "when_driven": "ratio",
}
_TEETH: Final = {
    "pinion_angle": "angle",
    "wheel_angle": "angle",
    "wheel_radius": "length",
    "friction": "ratio",
}
_COIL: Final = {"released_power": "power", "engaged_power": "power"}
_CONVERSION: Final = {"torque_constant": "torque constant", "resistance": "resistance"}
LAWS: Final[Mapping[str, Law]] = {
    "ratio": Law(Ratio, {"ratio": "ratio"}),
    "friction": Law(Friction, possible=_FRICTION),
    "inertia": Law(Inertia, {"inertia": "inertia"}),
    "hypoid": Law(Hypoid, {"ratio": "ratio", **_TEETH}),
    "parallel_spring": Law(PositionTorque, {"stiffness": "rotational stiffness", "rest": "angle"}),
    "holding_brake": Law(HoldingBrake, {"static_torque": "torque"}, _COIL),
}
#: The component that is the chain's motor, and its numbers with their dimensions.
MOTOR_KIND: Final = "dc_motor"
MOTOR: Final = {
    **_CONVERSION,
    "max_speed": "angular velocity",
    "supply_voltage": "voltage",
    "continuous_current": "current",
    "peak_current": "current",
    "mass": "mass",
}
#: Numbers of any other component, which are arguments of laws, with their dimensions.
NUMBERS: Final = {name: kind for law in LAWS.values() for name, kind in law.arguments.items()}


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
            known(f"law '{self.law}' has no argument", argument, law.arguments)
        if lacking := ", ".join(f"'{n}'" for n in law.needed if n not in self.arguments):
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
