"""From the catalogue's files to chains: components, alternatives, and edits of their parameters."""

import dataclasses
import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from actuators.arrays import Scalars
from actuators.chain import Chain
from actuators.checked import Table, Text, checked, read_toml
from actuators.elements.element import Element, gearing
from actuators.errors import LegwattError, known, one_line
from actuators.loading.alternatives import (
    ALTERNATIVES_FILE,
    LAWS,
    MOTOR,
    MOTOR_KIND,
    NAME,
    NUMBERS,
    Alternative,
)
from actuators.parameters import Parameter, ParameterSet, parameters_from_table
from actuators.shaft import DCMotor
from actuators.units import dimension, si_unit

CATALOG: Final = Path(__file__).parents[1] / "catalog"
WINDING: Final = "winding"  # the motor's row among the losses
_RATIO_TOLERANCE: Final = 1e-9  # relative
_logger: Final = logging.getLogger("legwatt")


class _Written(Table):
    kind: Text
    title: str
    note: str = ""
    parameters: dict[str, object]


@dataclass(frozen=True)
class Component:
    """One component file of the catalogue."""

    name: str  #: The file's stem.
    kind: str  #: What it is; a `dc_motor` drives a chain.
    title: str  #: The same in words.
    parameters: ParameterSet


def _component(path: Path) -> Component:
    file = one_line(path.name)
    written = checked(_Written, read_toml(path), file)
    # What is needed, alternatives say: they name each number, and one that none names is refused.
    motor = written.kind == MOTOR_KIND
    numbers, optional = (MOTOR, {"mass"}) if motor else (NUMBERS, {*NUMBERS})
    parameters = parameters_from_table(written.parameters, numbers, file, frozenset(optional))
    return Component(path.stem, written.kind, written.title, parameters)


@dataclass(frozen=True)
class Catalog:
    """Components and the alternatives built from them, by name; edits return a new catalogue."""

    components: Mapping[str, Component]
    alternatives: Mapping[str, Alternative]  #: In the file's order.

    def parameter(self, reference: str) -> Parameter:
        """Return the parameter that `component.parameter` names.

        Raises:
            LegwattError: No such component. The component has no such parameter.
        """
        component, name = self._split(reference)
        return component.parameters.parameter(name)

    def rows(self) -> tuple[tuple[str, Parameter], ...]:
        """Return every parameter with its component's name."""
        return tuple((c.name, p) for c in self.components.values() for p in c.parameters.rows())

    def replaced(self, reference: str, value: float, **changes: Any) -> "Catalog":
        """Return a catalogue in which `component.parameter` has another SI value.

        Changes and errors are those of `ParameterSet.replaced` and `parameter`.
        """
        component, name = self._split(reference)
        parameters = component.parameters.replaced(name, value, **changes)
        edited = dataclasses.replace(component, parameters=parameters)
        components = MappingProxyType({**self.components, component.name: edited})
        return dataclasses.replace(self, components=components)

    def chain(self, name: str, values: Mapping[str, Scalars] | None = None) -> Chain:
        """Return the chain of an alternative.

        Args:
            name: Of the alternative.
            values: SI values that stand in for parameters, by `component.parameter`: one for all
                joints or one per joint (J,).

        Raises:
            LegwattError: No such alternative, its ratios do not multiply to what it promises, or a
                parameter is unphysical.
        """
        alternative = self.alternatives[known("no alternative", name, self.alternatives)]
        own = values or {}
        try:
            promised = self._value("ratio", alternative.ratio, "ratio", own)
            elements = tuple(self._elements(alternative, own))
            stages = {e.stage: e.name for e in alternative.elements if e.stage}
            motor = self._motor(alternative.motor, own)
            chain = Chain(name, elements, motor, MappingProxyType(stages))
        except LegwattError as error:
            raise LegwattError(f"alternative '{name}': {error}") from None
        total = np.asarray(gearing(elements), dtype=float)
        if np.any(np.abs(total - promised) > _RATIO_TOLERANCE * np.abs(promised)):
            raise LegwattError(
                f"alternative '{name}': its ratios multiply to {total.flat[0]:.10g}, "
                f"'{alternative.ratio}' asks for {promised:.10g}: change them together"
            )
        return chain

    def _elements(self, alternative: Alternative, own: Mapping[str, Scalars]) -> Iterable[Element]:
        for e in alternative.elements:
            law, where = LAWS[e.law], f"element '{one_line(e.name)}'"
            each = e.arguments.items()
            given = {a: self._value(f"{where}: {a}", r, law.arguments[a], own) for a, r in each}
            yield law.element(name=e.name, **given)

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
        return Catalog(MappingProxyType(components), MappingProxyType(alternatives))

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
        LegwattError: A file cannot be read, or a parameter is wrong. There is no alternative, a
            component, law, argument or reference is unknown, an argument has the unit of another
            dimension, a ratio does not come out, or a component in use holds a parameter that no
            alternative names. A parameter is unphysical.
    """
    folder = Path(directory)
    contents = read_toml(folder / ALTERNATIVES_FILE)
    if not contents:
        raise LegwattError(f"{ALTERNATIVES_FILE}: no alternative, expected one table [NAME] each")
    files = sorted(p for p in folder.glob("*.toml") if p.name != ALTERNATIVES_FILE)
    components = {p.stem: _component(p) for p in files}
    alternatives = {name: _alternative(name, entry) for name, entry in contents.items()}
    catalog = Catalog(MappingProxyType(components), MappingProxyType(alternatives))
    catalog.chains()
    catalog = catalog.only(alternatives)
    # A parameter that no alternative names was forgotten where the law of an element takes it which
    # names others of the component; else it is left, and said so.
    used = {r for a in alternatives.values() for r in a.references}
    taken = {
        f"{reference.partition('.')[0]}.{argument}"
        for a in alternatives.values()
        for e in a.elements
        for reference in e.arguments.values()
        for argument in LAWS[e.law].arguments
    }
    for name, parameter in catalog.rows():
        if catalog.components[name].kind == MOTOR_KIND or f"{name}.{parameter.name}" in used:
            continue
        said = f"{name}.toml: parameter '{parameter.name}' is used by no alternative"
        if f"{name}.{parameter.name}" in taken:
            raise LegwattError(f"{said}: name it in {ALTERNATIVES_FILE} or remove it")
        _logger.warning("%s", said)
    return catalog


def _alternative(name: str, entry: object) -> Alternative:
    where = f"{ALTERNATIVES_FILE} [{one_line(name)}]"
    if not NAME.fullmatch(name):
        raise LegwattError(
            f"{where}: expected a name of letters a to z, digits, '_' and '-'; tables and files "
            "are called after it"
        )
    return checked(Alternative, entry, where)
