"""Joints with actuators of their own: the robot file's table `[actuators]`.

    [actuators]
    folder = "our_actuators"            # actuator files, from the robot file; the catalogue's else
    alternative = "reversible"          # how the machine is built, where it is one of them
    source = "..."                      # who says that these are its motors

    [[actuators.joint]]
    joints = ["*_joint_1"]              # names, * and ? as in file names
    alternative = "rotor"               # where these joints are built otherwise
    [actuators.joint.parameters]        # numbers that differ at these joints
    ratio = {value = 160, unit = "1", basis = "datasheet", source = "..."}
    torque_constant = {value = 90, unit = "mN*m/A", basis = "datasheet", source = "..."}
    "harmonic_drive.load" = {value = 0.1, unit = "1", basis = "datasheet", source = "..."}

A name without a dot is the alternative's total ratio or its motor's; `component.parameter` is as in
the actuator files. A total ratio is met by the gear next to the motor, unless all gears' own ratios
are stated. Numbers hold in every alternative that has them, so that alternatives stay comparable;
joints built as different ones make an alternative more, `as_built`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from actuators.chain import Chain
from actuators.errors import ActuatorError, closest, one_line
from actuators.loading.alternatives import Alternative
from actuators.loading.build import Catalog
from actuators.parameters import Parameter, parameters_from_table
from actuators.units import dimension
from pipeline.errors import RobotFileError
from pipeline.machine.drivetrains import Actuators, Drivetrains
from pipeline.machine.joint import JointModel, joints_of
from pipeline.robot.robot_file import RobotSpec

#: The alternative of a machine whose joints are built as different ones.
AS_BUILT: Final = "as_built"
RATIO: Final = "ratio"
_KEYS: Final = ("folder", "alternative", "source", "joint")
_JOINT_KEYS: Final = ("joints", "alternative", "parameters")


@dataclass(frozen=True)
class OwnActuators:
    """What a robot file says of its joints' actuators.

    Attributes:
        where: Robot file and table, for messages.
        joints: Of the robot.
        alternative: As which the machine is built; empty where the file does not say.
        built: Joint to the alternative as which it alone is built.
        numbers: Joint to the numbers that it alone has.
        groups: The file's entries, in words, with their numbers.
        source: Who says that these are its motors; empty where nobody does.
    """

    where: str = ""
    joints: tuple[str, ...] = ()
    alternative: str = ""
    built: Mapping[str, str] = field(default_factory=dict)
    numbers: Mapping[str, Mapping[str, Parameter]] = field(default_factory=dict)
    groups: tuple[tuple[str, tuple[Parameter, ...]], ...] = ()
    source: str = ""

    @property
    def usual(self) -> str:
        """The alternative as which the whole machine is built; empty where nothing is said."""
        return AS_BUILT if self.built else self.alternative

    def __bool__(self) -> bool:
        return bool(self.alternative or self.built or self.numbers)

    def catalog(self, catalog: Catalog) -> Catalog:
        """The catalogue with the machine as it is built among its alternatives."""
        if not self.built:
            return catalog
        count = Counter(self._alternative(AS_BUILT, joint) for joint in self.joints)
        names = [name for name in catalog.alternatives if name in count]
        parts = [catalog.alternatives[name] for name in names]
        *_, motor = parts[0].elements
        shared = [set(a.stage_names) for a in parts]
        elements = tuple(
            e
            if e is motor or all(e.stage in stages for stages in shared)
            else e.model_copy(update={"stage": ""})
            for e in parts[0].elements
        )
        title = "As built: " + ", ".join(f"{name} at {count[name]} joints" for name in names)
        mixed = Alternative(AS_BUILT, title, parts[0].motor, parts[0].ratio, elements)
        return replace(
            catalog, alternatives=MappingProxyType({**catalog.alternatives, AS_BUILT: mixed})
        )

    def actuators(self, catalog: Catalog, alternative: str) -> Actuators:
        """One alternative with what single joints have of their own.

        Args:
            catalog: Components and alternatives.
            alternative: One of them, or `AS_BUILT` where joints are built differently.

        Raises:
            CatalogError: No such alternative.
            RobotFileError: An own number does not fit it.
        """
        if not self.numbers and not (self.built and alternative == AS_BUILT):
            return catalog.chain(alternative)
        made: dict[object, Chain] = {}
        joints: list[JointModel] = []
        for joint in self.joints:
            name, numbers = self._alternative(alternative, joint), self.numbers.get(joint, {})
            key = (name, *((n, id(p)) for n, p in numbers.items()))
            if key not in made:
                made[key] = self._chain(catalog, name, joint, numbers)
            joints += joints_of(made[key], (joint,))
        return Drivetrains(alternative, tuple(joints))

    def every(self, catalog: Catalog) -> dict[str, Actuators]:
        """Every alternative of a catalogue; see `actuators`."""
        return {name: self.actuators(catalog, name) for name in catalog.alternatives}

    def _alternative(self, name: str, joint: str) -> str:
        return self.built.get(joint, self.alternative) if name == AS_BUILT else name

    def _chain(
        self, catalog: Catalog, name: str, joint: str, numbers: Mapping[str, Parameter]
    ) -> Chain:
        if not numbers:
            return catalog.chain(name)
        try:
            return _with_numbers(catalog, name, numbers).chain(name)
        except ActuatorError as error:
            raise RobotFileError(f"{self.where}: joint '{joint}': {error}") from None


def actuator_folder(spec: RobotSpec) -> Path | None:
    """Folder of actuator files that a robot file names; None where it names none.

    Raises:
        RobotFileError: It is no text, or no such folder.
    """
    folder = spec.actuator_table.get("folder")
    if folder is None:
        return None
    where = f"{spec.path}: actuators.folder"
    if not isinstance(folder, str) or not folder or "\x00" in folder:
        raise RobotFileError(f"{where}: expected the name of a folder of actuator files")
    path = spec.path.parent / folder
    if not path.is_dir():
        raise RobotFileError(f"{where}: no folder '{one_line(path)}'")
    return path


def own_actuators(spec: RobotSpec, catalog: Catalog) -> OwnActuators:
    """The actuators that a robot file gives its joints.

    Args:
        spec: The robot file.
        catalog: Components and alternatives that it may name.

    Raises:
        RobotFileError: A key, joint, alternative or number is unknown, or a number cannot be; names
            it and offers the closest match.
    """
    table, where = spec.actuator_table, f"{spec.path}: actuators"
    _known(table, _KEYS, where)
    alternative, source = _alternative(table, catalog, where), table.get("source", "")
    if not isinstance(source, str):
        raise RobotFileError(f"{where}.source: expected a text")
    entries = table.get("joint", [])
    if not isinstance(entries, list) or not all(isinstance(e, Mapping) for e in entries):
        raise RobotFileError(f"{where}: joints are written [[actuators.joint]]")
    built: dict[str, str] = {}
    numbers: dict[str, dict[str, Parameter]] = {}
    groups = []
    for count, entry in enumerate(entries, start=1):
        place = f"{where}.joint {count}"
        _known(entry, _JOINT_KEYS, place)
        patterns, names = _joints(entry, spec.joints, place)
        own = _alternative(entry, catalog, place)
        given = _numbers(entry, catalog, place)
        for joint in names:
            if own:
                built[joint] = own
            if given:
                numbers[joint] = numbers.get(joint, {}) | given
        groups.append((f"joints {' '.join(patterns)}", tuple(given.values())))
    missing = [joint for joint in spec.joints if built and not alternative and joint not in built]
    if missing:
        raise RobotFileError(
            f"{where}: as what is joint '{missing[0]}' built? add actuators.alternative for all "
            "joints that no entry names"
        )
    if alternative and all(name == alternative for name in built.values()):
        built = {}  # as all others are
    if built and AS_BUILT in catalog.alternatives:
        raise RobotFileError(
            f"{where}: an alternative of the actuator files is called '{AS_BUILT}', as the machine "
            "whose joints differ; rename it"
        )
    out = OwnActuators(where, spec.joints, alternative, built, numbers, tuple(groups), source)
    out.every(out.catalog(catalog))  # what loads works
    return out


def _with_numbers(catalog: Catalog, name: str, numbers: Mapping[str, Parameter]) -> Catalog:
    """A catalogue with one joint's own numbers, its gears meeting the ratio asked for."""
    alternative = catalog.alternatives[name]
    stated = set()
    for key, number in numbers.items():
        reference = key
        if "." not in key:
            reference = alternative.ratio if key == RATIO else f"{alternative.motor}.{key}"
        stated.add(reference)
        catalog = catalog.replaced(
            reference,
            number.value,
            basis=number.basis,
            source=number.source,
            interval=number.interval,
            bounds=number.bounds,  # those of the file belong to another part
            reason=number.reason,
        )
    if RATIO not in numbers:
        return catalog
    gears = [e.arguments["ratio"] for e in alternative.elements if "ratio" in e.arguments]
    total = float(np.prod([catalog.parameter(gear).value for gear in gears]))
    for gear in reversed(gears):
        if gear not in stated:
            value = catalog.parameter(gear).value * numbers[RATIO].value / total
            source = f"the total ratio of {numbers[RATIO].value:g} over the other gears'"
            return catalog.replaced(
                gear, value, basis="derived", source=source, interval=None, bounds=None
            )
    return catalog


def _alternative(table: Mapping[str, Any], catalog: Catalog, where: str) -> str:
    name = table.get("alternative", "")
    if not isinstance(name, str) or (name and name not in catalog.alternatives):
        hint = closest(str(name), list(catalog.alternatives))
        raise RobotFileError(f"{where}: no alternative '{one_line(name)}'; {hint}")
    return name


def _joints(
    entry: Mapping[str, Any], known: Sequence[str], where: str
) -> tuple[list[str], list[str]]:
    """Patterns of an entry and the joints they name."""
    patterns = entry.get("joints")
    texts = isinstance(patterns, list) and all(isinstance(p, str) for p in patterns)
    if not isinstance(patterns, list) or not patterns or not texts:
        raise RobotFileError(f'{where}: joints must be a list of names or patterns as "*_joint_1"')
    for pattern in patterns:
        if not any(fnmatchcase(joint, pattern) for joint in known):
            hint = closest(pattern, list(known))
            raise RobotFileError(f"{where}: no joint '{one_line(pattern)}'; {hint}")
    return patterns, [j for j in known if any(fnmatchcase(j, p) for p in patterns)]


def _numbers(entry: Mapping[str, Any], catalog: Catalog, where: str) -> dict[str, Parameter]:
    """The numbers of an entry by their names."""
    table = entry.get("parameters", {})
    if not isinstance(table, Mapping):
        raise RobotFileError(f"{where}: parameters must be a table, [actuators.joint.parameters]")
    schema = {}
    motors = [catalog.components[a.motor] for a in catalog.alternatives.values()]
    for alternative in catalog.alternatives.values():
        schema[RATIO] = dimension(catalog.parameter(alternative.ratio).unit)
    for component in motors:
        schema |= {p.name: dimension(p.unit) for p in component.parameters.rows()}
    schema |= {f"{c}.{p.name}": dimension(p.unit) for c, p in catalog.rows()}
    try:
        found = parameters_from_table(table, schema, f"{where}.parameters", frozenset(schema))
    except ActuatorError as error:
        raise RobotFileError(str(error)) from None
    return {p.name: p for p in found.rows()}


def _known(table: Mapping[str, Any], known: Sequence[str], where: str) -> None:
    for key in table:
        if key not in known:
            raise RobotFileError(f"{where}: unknown key '{one_line(key)}'; {closest(key, known)}")
