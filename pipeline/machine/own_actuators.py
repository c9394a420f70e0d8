"""Joints with actuators of their own: the robot file's table `[actuators]`.

    [actuators]
    folder = "our_actuators"            # actuator files, from the robot file; the catalogue's else;
                                        # "known:solo12" is a folder of urdf/actuators
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

`motors_of` says whose motors a machine is computed with, and what they weigh.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Final

import numpy as np
from pydantic import Field, Strict

from actuators.chain import Chain
from actuators.checked import Names, Table, Text, checked
from actuators.errors import LegwattError, closest, one_line
from actuators.loading.build import Catalog
from actuators.parameters import Parameter, parameters_from_table
from actuators.units import dimension
from pipeline.machine.joint import Actuators, Drivetrains, JointModel, drivetrains_of, joints_of
from pipeline.robot.guess.motors import KNOWN_SCHEME, known_folder
from pipeline.robot.robot_file import RobotSpec

#: The alternative of a machine whose joints are built as different ones.
AS_BUILT: Final = "as_built"
RATIO: Final = "ratio"


class _Joint(Table):
    """An entry of `[[actuators.joint]]`."""

    joints: Annotated[Names, Field(min_length=1)]
    alternative: str = ""
    parameters: dict[str, Any] = Field(default_factory=dict)


class _Written(Table):
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
    where: str = ""  #: Robot file and table, for messages.
    joints: tuple[str, ...] = ()  #: Of the robot.
    alternative: str = ""  #: As which the machine is built; empty where the file does not say.
    #: Joint to the alternative as which it alone is built.
    built: Mapping[str, str] = field(default_factory=dict)
    #: Joint to the numbers that it alone has.
    numbers: Mapping[str, Mapping[str, Parameter]] = field(default_factory=dict)
    #: The file's entries, in words, with their numbers.
    groups: tuple[tuple[str, tuple[Parameter, ...]], ...] = ()
    source: str = ""  #: Who says that these are its motors; empty where nobody does.

    @property
    def usual(self) -> str:
        """The alternative as which the whole machine is built; empty where nothing is said."""
        return AS_BUILT if self.built else self.alternative

    def __bool__(self) -> bool:
        return bool(self.alternative or self.built or self.numbers)

    def _with_as_built(self) -> OwnActuators:
        """The same with the machine as it is built among the alternatives."""
        count = Counter(self._alternative(AS_BUILT, joint) for joint in self.joints)
        every = self.catalog.alternatives
        names = [name for name in every if name in count]
        parts = [every[name] for name in names]
        *_, motor = parts[0].elements
        shared = [set(a.stage_names) for a in parts]
        elements = tuple(
            e
            if e is motor or all(e.stage in stages for stages in shared)
            else e.model_copy(update={"stage": ""})
            for e in parts[0].elements
        )
        title = "As built: " + ", ".join(f"{name} at {count[name]} joints" for name in names)
        mixed = parts[0].model_copy(update={"title": title, "elements": elements})
        alternatives = MappingProxyType({**every, AS_BUILT: mixed})
        return replace(self, catalog=replace(self.catalog, alternatives=alternatives))

    @cached_property
    def _made(self) -> dict[str, Actuators]:
        return {}

    def actuators(self, alternative: str) -> Actuators:
        """One alternative with what single joints have of their own, built when first asked for.

        `alternative`: one of them, or `AS_BUILT` where joints are built differently.

        Raises:
            LegwattError: No such alternative. An own number does not fit it.
        """
        if alternative in self._made:
            return self._made[alternative]
        if not self.numbers and not (self.built and alternative == AS_BUILT):
            self._made[alternative] = self.catalog.chain(alternative)
            return self._made[alternative]
        made: dict[object, Chain] = {}
        joints: list[JointModel] = []
        for joint in self.joints:
            name, numbers = self._alternative(alternative, joint), self.numbers.get(joint, {})
            key = (name, *((n, id(p)) for n, p in numbers.items()))
            if key not in made:
                try:
                    made[key] = _with_numbers(self.catalog, name, numbers).chain(name)
                except LegwattError as error:
                    raise LegwattError(f"{self.where}: joint '{joint}': {error}") from None
            joints += joints_of(made[key], (joint,))
        self._made[alternative] = Drivetrains(alternative, tuple(joints))
        return self._made[alternative]

    def every(self, *names: str) -> dict[str, Actuators]:
        """Alternatives by name, all by default; see `actuators`."""
        return {name: self.actuators(name) for name in names or self.catalog.alternatives}

    def _alternative(self, name: str, joint: str) -> str:
        return self.built.get(joint, self.alternative) if name == AS_BUILT else name


def _written(spec: RobotSpec) -> _Written:
    return checked(_Written, spec.actuator_table, f"{spec.path}: actuators")


def actuator_folder(spec: RobotSpec) -> Path | None:
    """Folder of actuator files that a robot file names; None where it names none.

    Raises:
        LegwattError: It is no text, or no such folder.
    """
    folder = _written(spec).folder
    if folder is None:
        return None
    if folder.startswith(KNOWN_SCHEME):
        return known_folder(folder, f"{spec.path}: actuators.folder")
    path = spec.path.parent / folder
    if not path.is_dir():
        raise LegwattError(f"{spec.path}: actuators.folder: no folder '{one_line(path)}'")
    return path


def without_folder(spec: RobotSpec) -> RobotSpec:
    """The robot without its actuators where another folder is taken for theirs.

    Alternatives and numbers of ``[actuators]`` are of the folder that the table names; a table that
    names none speaks of whichever folder is taken, and stays.
    """
    return replace(spec, actuator_table={}) if _written(spec).folder is not None else spec


def own_actuators(spec: RobotSpec, catalog: Catalog) -> OwnActuators:
    """The actuators that a robot file gives its joints.

    Raises:
        LegwattError: A key, joint, alternative or number is unknown, or a number cannot be; names
            it and offers the closest match.
    """
    table, where = _written(spec), f"{spec.path}: actuators"
    alternative = table.alternative
    _known("alternative", alternative, [*catalog.alternatives, ""], where)
    built: dict[str, str] = {}
    numbers: dict[str, dict[str, Parameter]] = {}
    groups = []
    for count, entry in enumerate(table.joint, start=1):
        place = f"{where}.joint {count}"
        for pattern in entry.joints:
            if not any(fnmatchcase(joint, pattern) for joint in spec.joints):
                _known("joint", pattern, spec.joints, place)
        _known("alternative", entry.alternative, [*catalog.alternatives, ""], place)
        given = _numbers(entry.parameters, catalog, place)
        for joint in spec.joints:
            if any(fnmatchcase(joint, pattern) for pattern in entry.joints):
                if entry.alternative:
                    built[joint] = entry.alternative
                if given:
                    numbers[joint] = numbers.get(joint, {}) | given
        groups.append((f"joints {' '.join(entry.joints)}", tuple(given.values())))
    missing = [joint for joint in spec.joints if built and not alternative and joint not in built]
    if missing:
        raise LegwattError(
            f"{where}: as what is joint '{missing[0]}' built? add actuators.alternative for all "
            "joints that no entry names"
        )
    if alternative and all(name == alternative for name in built.values()):
        built = {}  # as all others are
    if built and AS_BUILT in catalog.alternatives:
        raise LegwattError(
            f"{where}: an alternative of the actuator files is called '{AS_BUILT}', as the machine "
            "whose joints differ; rename it"
        )
    out = OwnActuators(
        *(catalog, where, spec.joints, alternative, built, numbers, tuple(groups), table.source)
    )
    out = out._with_as_built() if built else out
    out.every()  # what loads works
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


def _known(what: str, name: str, known: Sequence[str], where: str) -> None:
    if name not in known:
        hint = closest(name, [k for k in known if k])
        raise LegwattError(f"{where}: no {what} '{one_line(name)}'; {hint}")


def _numbers(table: Mapping[str, Any], catalog: Catalog, where: str) -> dict[str, Parameter]:
    """The numbers of an entry by their names."""
    schema = {}
    for alternative in catalog.alternatives.values():
        schema[RATIO] = dimension(catalog.parameter(alternative.ratio).unit)
        motor = catalog.components[alternative.motor].parameters
        schema |= {p.name: dimension(p.unit) for p in motor.rows()}
    schema |= {f"{c}.{p.name}": dimension(p.unit) for c, p in catalog.rows()}
    try:
        found = parameters_from_table(table, schema, f"{where}.parameters", frozenset(schema))
    except LegwattError as error:
        raise LegwattError(str(error)) from None
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

    @property
    def too_heavy(self) -> bool:
        """Whether the motors alone weigh more than the robot whose joints they drive."""
        return self.total > self.robot


def motors_of(
    own: OwnActuators, joints: tuple[str, ...], robot: float, *names: str, stated: bool
) -> Motors:
    """The motors of a machine.

    `robot`: mass of the robot [kg]. `names`: alternatives that count where it is not said as which
    it is built; all by default. `stated`: whether the catalogue is the user's; what the robot file
    states is stated, too.
    """
    every = own.every(*names)
    usual = own.usual if own.usual in every else ""
    counted = {usual: every[usual]} if usual else every
    rows = [drivetrains_of(actuators, joints).joints for actuators in counted.values()]
    masses = np.array([[j.motor.mass if j.motor else 0.0 for j in row] for row in rows])
    ratios = [j.ratio for row in rows for j in row]
    built = {*own.built.values(), own.alternative} - {""} if usual == AS_BUILT else counted
    catalog = own.catalog
    titles = (catalog.components[catalog.alternatives[name].motor].title for name in built)
    return Motors(
        titles=tuple(dict.fromkeys(titles)),
        joints=len(joints),
        ratio=(min(ratios), max(ratios)),
        mass=(float(masses.min()), float(masses.max())),
        total=float(masses.sum(axis=1).max()) if (masses > 0).all() else 0.0,
        robot=robot,
        stated=stated or bool(own or own.source),
    )
