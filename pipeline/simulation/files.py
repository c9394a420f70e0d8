"""A machine as its files state it, with the numbers that differ for one run (``--set``).

Robot file or URDF, gait file, actuator files and model file are read once, by `read_files`; a
changed number is put among theirs by `stated`. Walking, logs and exports all begin here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from actuators.errors import LegwattError, closest, one_line
from actuators.loading.build import CATALOG, Catalog, load_catalog
from actuators.parameters import ParameterSet
from actuators.units import to_si
from pipeline.effects.model_file import ModelFile, read_model_file
from pipeline.machine.machine import MachineModel, machine_of_robot, machine_of_urdf
from pipeline.machine.own_actuators import (
    OwnActuators,
    actuator_folder,
    own_actuators,
    without_folder,
)
from pipeline.motion.footfall import LEAST_FEET
from pipeline.motion.gait import gait_of, gait_table
from pipeline.motion.gait_table import changed_table, gait_keys, spec_with_gait
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import DEFAULT_ROBOT, RobotSpec, leg_list
from pipeline.robot.robot_tables import GAIT_NUMBERS, check_parameters

#: What a change of the table ``[gait]`` begins with.
GAIT: Final = "gait."
STANDING_FEET: Final = "standing.feet"
TOTAL_MASS: Final = "total_mass"
#: Between these a ratio looks like a slip by a prefix of the unit, the value itself a little off.
_THOUSAND: Final = (200.0, 5000.0)


@dataclass(frozen=True)
class Files:
    """What a machine's files say, before numbers are changed."""

    robot: Path  #: Robot file, or the URDF of a robot on a fixed base.
    spec: RobotSpec | None = field(repr=False)  #: The robot file's contents; None for a URDF.
    catalog: Catalog = field(repr=False)  #: Actuator components and alternatives.
    #: Folder of the user's own actuator files; None for the project's catalogue.
    actuators: Path | None = None
    gait: Path | None = None  #: The gait file; None without one.
    model: ModelFile | None = None  #: Effects of the model file; None without one.
    model_path: Path | None = None  #: The model file; None without one.


@dataclass(frozen=True)
class Stated:
    """Robot and actuators with changed numbers."""

    spec: RobotSpec | None  #: The robot file's contents; None for a URDF.
    own: OwnActuators  #: The actuators, with what single joints have of their own.
    notes: tuple[str, ...] = ()  #: What a reader of the numbers should know of the changes.


def read_files(
    robot: Path | None = None,
    *,
    model: Path | None = None,
    gait: Path | None = None,
    actuators: Path | None = None,
    known: ModelFile | None = None,
) -> Files:
    """Read what names a machine; see `Files`.

    What is not given is the model file's, the robot file's or the project's; `known` is what a
    model file would hold, where none is named.

    Raises:
        LegwattError: The robot file or the gait file cannot be used. A catalogue file cannot be
            used. The model file cannot be used.
    """
    file = read_model_file(model, actuators) if model else known
    path = robot or (file.robot if file else DEFAULT_ROBOT)
    spec = None
    if path.suffix.lower() not in (".urdf", ".xml"):
        spec = spec_with_gait(path, gait)
        if actuators:
            spec = without_folder(spec)
        actuators = actuators or actuator_folder(spec)
    elif not path.is_file():
        fact = "is a folder" if path.is_dir() else "no such robot file"
        raise LegwattError(f"{path}: {fact}; name a robot file or URDF with --robot")
    elif gait is not None:
        raise LegwattError(
            f"{path}: a bare URDF walks no gait; write a robot file for --gait {gait}"
        )
    return Files(path, spec, load_catalog(actuators or CATALOG), actuators, gait, file, model)


def base_model(file: ModelFile, actuators: Path | None = None) -> MachineModel:
    """The machine of a model file before its edits, without a payload of its gait.

    `actuators`: folder of actuator files; the robot file's or the project's by default.

    Raises:
        LegwattError: The robot file or URDF cannot be used. The catalogue has no such alternative.
    """
    files = read_files(actuators=actuators, known=file)
    machine = stated(files, {})
    chain = machine.own.actuators(file.alternative) if file.alternative else None
    if machine.spec is None:
        return machine_of_urdf(files.robot, actuators=chain)
    return machine_of_robot(load_robot(machine.spec), chain)


def stated(files: Files, changes: Mapping[str, object]) -> Stated:
    """Robot and actuators with changed numbers.

    `changes`: key to value, a number or its text, in the unit that the key's file writes.

    Raises:
        LegwattError: No such number, or none that can be; names it and the closest match.
    """
    spec, catalog, notes = files.spec, files.catalog, []
    for key, value in changes.items():
        before = spec
        spec, catalog = _changed(spec, catalog, key, value)
        if before is not None and spec is not None:
            notes += _thousandfold(before.parameters, spec.parameters, key)
    if spec is None:
        return Stated(None, OwnActuators(catalog))
    if changes:
        # After all changes: two numbers that bind each other may be changed together.
        check_parameters(spec.parameters, spec.build, "--set")
        for key in (key for key in changes if key in GAIT_NUMBERS):
            try:
                other = spec.with_parameters({key: 1.01 * spec.parameters[key]})
                gaits = gait_of(spec), gait_of(other)
            except LegwattError:
                continue  # numbers that contradict each other are in use
            # All of the feet's motion: a number that changes nothing is replaced in ``[gait]``.
            of = [(g.period, *g.twist, *g.stride, *g.lift) for g in gaits]
            if of[0] == of[1]:
                raise LegwattError(
                    f"--set {key}: it changes nothing, the gait has numbers of its own in its "
                    "place; change those of gait.stroke, gait.lift, gait.period, gait.speed that "
                    "are stated"
                )
    return Stated(spec, own_actuators(spec, catalog), tuple(notes))


def _changed(
    spec: RobotSpec | None, catalog: Catalog, key: str, value: object
) -> tuple[RobotSpec | None, Catalog]:
    """One change; numbers in the unit their file writes."""
    place = f"--set {one_line(key)}={one_line(value)}"
    if spec is not None and key.startswith(GAIT):
        try:
            new = replace(spec, gait=changed_table(spec.gait, key.removeprefix(GAIT), value))
            gait_table(new)
        except LegwattError as error:
            raise LegwattError(f"{place}: {str(error).removeprefix(f'{spec.path}: ')}") from None
        return new, catalog
    if spec is not None and key == STANDING_FEET:
        return _other_feet(spec, value, place), catalog
    numbers = {p.name: p for p in spec.parameters.rows()} if spec is not None else {}
    numbers |= {f"{component}.{p.name}": p for component, p in catalog.rows()}
    if key not in numbers:
        known = [*([*gait_keys(), STANDING_FEET] if spec else []), *numbers]
        hint = closest(key, known)
        if not hint.startswith("did"):  # all names fill several screens
            hint = "parameters.csv of any run lists all names"
        raise LegwattError(f"{place}: there is no such number; {hint}")
    if spec is not None and key == TOTAL_MASS and not spec.build:
        raise LegwattError(
            f"{place}: the bodies of this robot are those of {spec.urdf.name}, which it does not "
            "change; change masses there, or put a load on with gait.payload_mass='2 kg'"
        )
    unit = numbers[key].unit
    try:
        written = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        bare = "" if unit == "1" else f" in {unit}, without the unit"
        raise LegwattError(f"{place}: expected a number{bare}") from None
    if not math.isfinite(written):
        raise LegwattError(f"{place}: expected a finite number")
    try:
        number = to_si(written, unit)
        if spec is not None and key in spec.parameters:
            return spec.with_parameters({key: number}), catalog
        return spec, catalog.replaced(key, number)
    except LegwattError as error:
        raise LegwattError(f"{place}: {error}") from None


def _other_feet(spec: RobotSpec, value: object, place: str) -> RobotSpec:
    """The robot standing on other feet: ``all``, names in a text, or a list of them."""
    names = [leg.name for leg in spec.legs]
    feet = names if value == "all" else value
    if isinstance(feet, str):
        feet = [name.strip(" []\"'") for name in feet.split(",")]
    try:
        return replace(spec, standing_feet=leg_list(feet, names, place))
    except LegwattError as error:
        example = ",".join(names[:LEAST_FEET])
        raise LegwattError(f"{error}; write such as {STANDING_FEET}={example}") from None


def _thousandfold(before: ParameterSet, after: ParameterSet, key: str) -> list[str]:
    """Say when a change looks like another unit: about a thousand times more or less."""
    if key not in before or before[key] == 0 or after[key] == 0:
        return []
    least, most = sorted((abs(before[key]), abs(after[key])))
    if not (_THOUSAND[0] < most / least < _THOUSAND[1]):
        return []
    old, new = before.parameter(key), after.parameter(key)
    word = "more" if abs(after[key]) == most else "less"
    return [
        f"{key} = {new.value_as_written:g} {new.unit} is about a thousand times {word} than the "
        f"file's {old.value_as_written:g}; --set takes it in {new.unit}"
    ]
