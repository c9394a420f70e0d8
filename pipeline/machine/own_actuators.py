"""Joints with actuators of their own: the robot file's table `[actuators]`, as urdf/README.md says.

A name without a dot is the alternative's total ratio or its motor's; `component.parameter` is as in
the actuator files. A total ratio is met by the gear next to the motor, unless all gears' own ratios
are stated. Numbers hold in every alternative that has them, so that alternatives stay comparable;
joints built as different ones make an alternative more, `as_built`.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fnmatch import filter as matching
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Final

import numpy as np
from pydantic import Field, Strict

from actuators.chain import Chain
from actuators.checked import Names, Table, Text, checked, read_toml
from actuators.errors import LegwattError, known, one_line
from actuators.loading.build import Catalog
from actuators.parameters import Parameter, dimension, parameters_from_table
from pipeline.machine.machine import Drivetrains, drivetrains_of
from pipeline.robot.robot_file import KNOWN, KNOWN_SCHEME, TABLE, RobotSpec

#: The alternative of a machine whose joints are built as different ones.
AS_BUILT: Final = "as_built"
RATIO: Final = "ratio"


class _Joint(Table):
    """An entry of `[[actuators.joint]]`."""

    joints: Annotated[Names, Field(min_length=1)]
    alternative: str = ""
    parameters: dict[str, Any] = Field(default_factory=dict)


class _Actuators(Table):
    """The table `[actuators]`."""

    folder: Text | None = None
    alternative: str = ""
    source: str = ""
    joint: Annotated[tuple[_Joint, ...], Strict(False)] = ()


@dataclass(frozen=True)
class OwnActuators:
    """Actuator files, and what a robot file says of its joints' actuators."""

    #: Components and alternatives, the machine as it is built among them.
    catalog: Catalog
    #: Alternatives with what single joints have of their own, by name.
    every: Mapping[str, Drivetrains]
    usual: str = ""  #: Alternative as which the machine is built; empty where nothing is said.
    #: Joint to the alternative as which it is built, where they differ; else empty.
    built: Mapping[str, str] = field(default_factory=dict)
    #: The file's entries, in words, with their numbers.
    groups: tuple[tuple[str, tuple[Parameter, ...]], ...] = ()
    stated: bool = False  #: Whether the robot file says anything of its motors.

    def actuators(self, alternative: str) -> Drivetrains:
        """One alternative."""
        return self.every[known("no alternative", alternative, self.every)]


def _table(spec: RobotSpec) -> _Actuators:
    return checked(_Actuators, spec.actuators, f"{spec.path}: actuators")


def actuator_folder(spec: RobotSpec) -> Path | None:
    """Folder of actuator files that a robot file names; None where it names none."""
    folder = _table(spec).folder
    if folder is None:
        return None
    if folder.startswith(KNOWN_SCHEME):
        robots, name = read_toml(TABLE), folder.removeprefix(KNOWN_SCHEME)
        return KNOWN / known("no known robot", name, robots, f"{spec.path}: actuators.folder")
    path = spec.path.parent / folder
    if not path.is_dir():
        raise LegwattError(f"{spec.path}: actuators.folder: no folder '{one_line(path)}'")
    return path


def own_actuators(spec: RobotSpec, catalog: Catalog) -> OwnActuators:
    """The actuators that a robot file gives its joints.

    Raises:
        LegwattError: A key, joint, alternative or number is unknown, or a number cannot be; names
            it and offers the closest match.
    """
    table, where = _table(spec), f"{spec.path}: actuators"
    alternatives = [*catalog.alternatives]
    if table.alternative:
        known("no alternative", table.alternative, alternatives, where)
    built = dict.fromkeys(spec.joints, table.alternative)
    numbers: dict[str, dict[str, Parameter]] = {joint: {} for joint in spec.joints}
    groups = []
    for count, entry in enumerate(table.joint, start=1):
        place = f"{where}.joint {count}"
        given = _numbers(entry.parameters, catalog, place)
        if entry.alternative:
            known("no alternative", entry.alternative, alternatives, place)
        for pattern in entry.joints:
            named = matching(spec.joints, pattern)
            for joint in named or [known("no joint", pattern, spec.joints, place)]:
                built[joint] = entry.alternative or built[joint]
                numbers[joint] |= given
        groups.append((f"joints {' '.join(entry.joints)}", tuple(given.values())))
    count_of = Counter(built.values())
    mixed = len(count_of) > 1
    if mixed and "" in count_of:
        joint = next(joint for joint, name in built.items() if not name)
        raise LegwattError(
            f"{where}: as what is joint '{joint}' built? add actuators.alternative for all "
            "joints that no entry names"
        )
    if mixed and AS_BUILT in alternatives:
        raise LegwattError(
            f"{where}: an alternative of the actuator files is called '{AS_BUILT}', as the machine "
            "with its joints' own is; rename it"
        )
    every = {n: drivetrains_of(chain, spec.joints) for n, chain in catalog.chains().items()}
    for name in alternatives if any(numbers.values()) else ():
        every[name] = _joints(name, dict.fromkeys(built, name), numbers, catalog, where)
    if mixed:
        every[AS_BUILT] = _joints(AS_BUILT, built, numbers, catalog, where)
        names = [name for name in alternatives if name in count_of]
        title = "As built: " + ", ".join(f"{name} at {count_of[name]} joints" for name in names)
        first = catalog.alternatives[names[0]].model_copy(update={"title": title})
        catalog = replace(
            catalog, alternatives=MappingProxyType({**catalog.alternatives, AS_BUILT: first})
        )
    usual = AS_BUILT if mixed else next(iter(built.values()), "")
    stated = bool(usual or any(numbers.values()) or table.source)
    return OwnActuators(catalog, every, usual, built if mixed else {}, tuple(groups), stated)


def _joints(
    alternative: str,
    built: Mapping[str, str],
    numbers: Mapping[str, Mapping[str, Parameter]],
    catalog: Catalog,
    where: str,
) -> Drivetrains:
    """Drivetrains of joints built as alternatives, each with its numbers."""
    made: dict[object, Chain] = {}
    joints = []
    for joint, own in numbers.items():
        key = (built[joint], *((n, id(p)) for n, p in own.items()))
        try:
            if key not in made:
                made[key] = _with_numbers(catalog, built[joint], own).chain(built[joint])
        except LegwattError as error:
            raise LegwattError(f"{where}: joint '{joint}': {error}") from None
        joints.append(replace(made[key], name=joint))
    return Drivetrains(alternative, tuple(joints))


def _with_numbers(catalog: Catalog, name: str, numbers: Mapping[str, Parameter]) -> Catalog:
    """A catalogue with one joint's own numbers, its gears meeting the ratio asked for."""
    alternative = catalog.alternatives[name]
    total = {RATIO: alternative.ratio}
    stated = {
        key if "." in key else total.get(key, f"{alternative.motor}.{key}"): number
        for key, number in numbers.items()
    }
    for reference, own in stated.items():
        said = {n: getattr(own, n) for n in ("basis", "source", "interval", "bounds", "reason")}
        catalog = catalog.replaced(reference, own.value, **said)
    if RATIO not in numbers:
        return catalog
    gears = [e.arguments["ratio"] for e in alternative.elements if "ratio" in e.arguments]
    reached = float(np.prod([catalog.parameter(gear).value for gear in gears]))
    for gear in reversed([gear for gear in gears if gear not in stated][-1:]):
        value = catalog.parameter(gear).value * numbers[RATIO].value / reached
        source = f"the total ratio of {numbers[RATIO].value:g} over the other gears'"
        changes = {"basis": "derived", "source": source, "interval": None, "bounds": None}
        catalog = catalog.replaced(gear, value, **changes)
    return catalog


def _numbers(table: Mapping[str, Any], catalog: Catalog, where: str) -> dict[str, Parameter]:
    """The numbers of an entry by their names."""
    schema = {f"{c}.{p.name}": dimension(p.unit) for c, p in catalog.rows()}
    for alternative in catalog.alternatives.values():
        motor = catalog.components[alternative.motor].parameters
        schema |= {p.name: dimension(p.unit) for p in motor.rows()}
        schema[RATIO] = dimension(catalog.parameter(alternative.ratio).unit)
    found = parameters_from_table(table, schema, f"{where}.parameters", frozenset(schema))
    return {p.name: p for p in found.rows()}


@dataclass(frozen=True)
class Motors:
    """The motors of all joints, of all alternatives that count."""

    titles: tuple[str, ...]  #: Of the motors' files, each once.
    joints: int  #: How many joints have one.
    ratio: tuple[float, float]  #: Least and greatest motor speed over joint speed [1].
    #: Least and greatest mass of one motor [kg]; 0 where a file does not state it.
    mass: tuple[float, float]
    total: float  #: Greatest mass of all joints' motors [kg]; 0 where one is not stated.
    robot: float  #: Mass of the robot [kg].
    #: Whether robot file or command line say which motors these are; assumed otherwise.
    stated: bool
