"""From the catalogue's files to chains: laws, components, drivetrain options, edits of numbers."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final, Self

import numpy as np
from pydantic import AfterValidator, ConfigDict, Field, Strict, model_validator

from actuators.arrays import Scalars
from actuators.chain import JOINT_STAGE, SUPPLY_STAGE, Chain
from actuators.checked import Table, Text, checked, read_toml
from actuators.elements.element import LAWS, gearing
from actuators.errors import LegwattError, known, one_line
from actuators.parameters import Parameter, ParameterSet, dimension, parameters_from_table, si_unit
from actuators.shaft import DCMotor

ALTERNATIVES_FILE: Final = "alternatives.toml"
#: Files and columns are called after alternatives.
NAME: Final = re.compile(r"[A-Za-z0-9_-]+")
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
    own = [element.stage for element in elements if element.stage]
    stages = [JOINT_STAGE, *own, SUPPLY_STAGE]
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


CATALOG: Final = Path(__file__).parents[1] / "catalog"
WINDING: Final = "winding"  # the motor's row among the losses
_RATIO_TOLERANCE: Final = 1e-9  # relative


class Component(Table):
    """One component file of the catalogue."""

    model_config = ConfigDict(arbitrary_types_allowed=True)
    name: str = Field(default="", exclude=True)  #: The file's stem.
    kind: Text  #: What it is; a `dc_motor` drives a chain.
    title: str  #: The same in words.
    note: str = ""
    parameters: ParameterSet


def _component(path: Path) -> Component:
    file, table = one_line(path.name), read_toml(path)
    if "parameters" in table:
        # What is needed, alternatives say: they name each number; one that none names is refused.
        motor = table.get("kind") == MOTOR_KIND
        numbers, optional = (MOTOR, {"mass"}) if motor else (NUMBERS, {*NUMBERS})
        own = parameters_from_table(table["parameters"], numbers, file, frozenset(optional))
        table["parameters"] = own
    return checked(Component, table, file).model_copy(update={"name": path.stem})


@dataclass(frozen=True)
class Catalog:
    """Components and the alternatives built from them, by name; edits return a new catalogue."""

    components: Mapping[str, Component]
    alternatives: Mapping[str, Alternative]  #: In the file's order.

    def parameter(self, reference: str) -> Parameter:
        """Return the parameter that `component.parameter` names; a LegwattError for none."""
        component, name = self._split(reference)
        return component.parameters.parameter(name)

    def rows(self) -> tuple[tuple[str, Parameter], ...]:
        """Return every parameter with its component's name."""
        return tuple((c.name, p) for c in self.components.values() for p in c.parameters.rows())

    def replaced(self, reference: str, value: float, **changes: Any) -> "Catalog":
        """Return a catalogue with another SI value; see `ParameterSet.replaced`."""
        component, name = self._split(reference)
        parameters = component.parameters.replaced(name, value, **changes)
        edited = component.model_copy(update={"parameters": parameters})
        return replace(self, components={**self.components, component.name: edited})

    def chain(self, name: str, values: Mapping[str, Scalars] | None = None) -> Chain:
        """Return the chain of an alternative.

        Args:
            name: Of the alternative.
            values: SI values in place of parameters, by `component.parameter`, one or (J,).

        Raises:
            LegwattError: No such alternative, its ratios do not multiply to what it promises, or a
                parameter is unphysical.
        """
        alternative, elements = (
            self.alternatives[known("no alternative", name, self.alternatives)],
            [],
        )
        own = values or {}
        try:
            promised = self._value("ratio", alternative.ratio, "ratio", own)
            for e in alternative.elements:
                law, where = LAWS[e.law], f"element '{one_line(e.name)}'"
                given = {
                    a: self._value(f"{where}: {a}", reference, law.stated()[a], own)
                    for a, reference in e.arguments.items()
                }
                elements.append(law(name=e.name, **given))
            stages = {e.stage: e.name for e in alternative.elements if e.stage}
            chain = Chain(name, tuple(elements), self._motor(alternative.motor, own), stages)
        except LegwattError as error:
            raise LegwattError(f"alternative '{name}': {error}") from None
        total = np.asarray(gearing(elements), dtype=float)
        if np.any(np.abs(total - promised) > _RATIO_TOLERANCE * np.abs(promised)):
            raise LegwattError(
                f"alternative '{name}': its ratios multiply to {total.flat[0]:.10g}, "
                f"'{alternative.ratio}' asks for {promised:.10g}: change them together"
            )
        return chain

    def _value(
        self, key: str, reference: str, expected: str, own: Mapping[str, Scalars]
    ) -> Scalars:
        parameter = self.parameter(reference)
        if (kind := dimension(parameter.unit)) != expected:
            raise LegwattError(
                f"{key} = '{reference}' is in '{parameter.unit}', a unit of {kind}; expected "
                f"{expected} such as '{si_unit(expected)}'"
            )
        return own.get(reference, parameter.value)

    def _motor(self, name: str, own: Mapping[str, Scalars]) -> DCMotor:
        motors = {c.name: c for c in self.components.values() if c.kind == MOTOR_KIND}
        rows = motors[known("no motor", name, motors)].parameters.rows()
        numbers: dict[str, Any] = {p.name: own.get(f"{name}.{p.name}", p.value) for p in rows}
        spreads = {f"{p.name}_spread": p.spread for p in rows[:2]}  # of k and R
        return DCMotor(name=WINDING, **numbers, **spreads)

    def chains(self) -> dict[str, Chain]:
        """Return the chain of every alternative, in order."""
        return {name: self.chain(name) for name in self.alternatives}

    def only(self, names: Iterable[str]) -> "Catalog":
        """Return a catalogue of some alternatives, in the file's order, and of what they use."""
        kept = set(names)
        alternatives = {n: a for n, a in self.alternatives.items() if n in kept}
        used = {a.motor for a in alternatives.values()}
        used |= {r.partition(".")[0] for a in alternatives.values() for r in a.references}
        components = {n: c for n, c in self.components.items() if n in used}
        return Catalog(components, alternatives)

    def _split(self, reference: str) -> tuple[Component, str]:
        """Return the component and the parameter's name of a reference."""
        component, dot, name = reference.partition(".")
        if not dot:
            raise LegwattError(f"'{one_line(reference)}': expected component.parameter")
        return self.components[known("no component", component, self.components)], name


def load_catalog(directory: str | Path = CATALOG) -> Catalog:
    """Load a catalogue: every component file of a directory and its `alternatives.toml`.

    Every alternative is built once, so that a catalogue that loads is one that works. A component
    that no alternative names is read and left out: an alternative can be taken out by itself.

    Raises:
        LegwattError: A file, parameter or reference is wrong, a ratio does not come out, or a law
            takes a parameter of a component in use that no alternative names.
    """
    folder = Path(directory)
    contents = read_toml(folder / ALTERNATIVES_FILE)
    if not contents:
        raise LegwattError(f"{ALTERNATIVES_FILE}: no alternative, expected one table [NAME] each")
    files = sorted(p for p in folder.glob("*.toml") if p.name != ALTERNATIVES_FILE)
    components, alternatives = {p.stem: _component(p) for p in files}, {}
    for name, entry in contents.items():
        where = f"{ALTERNATIVES_FILE} [{one_line(name)}]"
        if not NAME.fullmatch(name):
            raise LegwattError(
                f"{where}: expected a name of letters a to z, digits, '_' and '-'; tables and "
                "files are called after it"
            )
        alternatives[name] = checked(Alternative, entry, where)
    catalog = Catalog(components, alternatives)
    catalog.chains()
    # What an element's law takes, and others of the component are named for, was forgotten.
    used = {r for a in alternatives.values() for r in a.references}
    for element in (e for a in alternatives.values() for e in a.elements):
        for part in {reference.partition(".")[0] for reference in element.arguments.values()}:
            taken = [n for n in components[part].parameters if n in LAWS[element.law].stated()]
            if lost := [name for name in taken if f"{part}.{name}" not in used]:
                raise LegwattError(
                    f"{part}.toml: parameter '{lost[0]}' is used by no alternative: name it in "
                    f"{ALTERNATIVES_FILE} or remove it"
                )
    return catalog.only(alternatives)
