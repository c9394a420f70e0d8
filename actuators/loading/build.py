"""From the catalogue's files to chains: components, alternatives, and edits of their parameters."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from actuators.arrays import Scalars
from actuators.chain import Chain
from actuators.checked import Table, Text, checked, read_toml
from actuators.elements.element import gearing
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


class _Written(Table):
    kind: Text
    title: str
    note: str = ""
    parameters: dict[str, object]


class Component(NamedTuple):
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
        """Return the parameter that `component.parameter` names; a LegwattError for none."""
        component, name = self._split(reference)
        return component.parameters.parameter(name)

    def rows(self) -> tuple[tuple[str, Parameter], ...]:
        """Return every parameter with its component's name."""
        return tuple((c.name, p) for c in self.components.values() for p in c.parameters.rows())

    def replaced(self, reference: str, value: float, **changes: Any) -> "Catalog":
        """Return a catalogue with another SI value; see `ParameterSet.replaced`."""
        component, name = self._split(reference)
        edited = component._replace(
            parameters=component.parameters.replaced(name, value, **changes)
        )
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
