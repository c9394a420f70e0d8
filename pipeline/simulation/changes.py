"""Numbers that differ from the files' for one run, by the keys that ``--set`` takes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import overload

import numpy as np

from actuators.errors import ActuatorError, closest, one_line
from actuators.loading.build import Catalog
from actuators.parameters import ParameterSet
from actuators.units import to_si
from pipeline.errors import GaitError, RobotFileError
from pipeline.motion.footfall import LEAST_FEET
from pipeline.motion.gait import gait_of, gait_table
from pipeline.motion.gait_table import changed_table, gait_keys
from pipeline.robot.robot_file import RobotSpec, leg_list
from pipeline.robot.robot_numbers import GAIT_NUMBERS, check_parameters

#: What a change of the table ``[gait]`` begins with.
GAIT = "gait."
STANDING_FEET = "standing.feet"
TOTAL_MASS = "total_mass"
#: Between these a ratio looks like a slip by a prefix of the unit, the value itself a little off.
_THOUSAND = (200.0, 5000.0)


@overload
def changed(
    spec: RobotSpec, catalog: Catalog, changes: Mapping[str, object]
) -> tuple[RobotSpec, Catalog, list[str]]: ...
@overload
def changed(
    spec: None, catalog: Catalog, changes: Mapping[str, object]
) -> tuple[None, Catalog, list[str]]: ...
def changed(
    spec: RobotSpec | None, catalog: Catalog, changes: Mapping[str, object]
) -> tuple[RobotSpec | None, Catalog, list[str]]:
    """Robot and actuators with changed numbers.

    Args:
        spec: Robot file; None for a bare URDF, which has no numbers of its own.
        catalog: Actuator components and alternatives.
        changes: Key to value, in the unit that the key's file writes; a number or its text.

    Returns:
        Both, and what a reader should know of the changes.

    Raises:
        RobotFileError: No such number, or none that can be; names it and the closest match.
    """
    remarks = []
    for key, value in changes.items():
        before = spec
        spec, catalog = _one(spec, catalog, key, value)
        if before is not None and spec is not None:
            remarks += _thousandfold(before.parameters, spec.parameters, key)
    if changes and spec is not None:
        # After all changes: two numbers that bind each other may be changed together.
        check_parameters(spec.parameters, spec.build, "--set")
        _refuse_unused(spec, changes)
    return spec, catalog, remarks


def _one(
    spec: RobotSpec | None, catalog: Catalog, key: str, value: object
) -> tuple[RobotSpec | None, Catalog]:
    """One change; numbers in the unit their file writes."""
    place = f"--set {one_line(key)}={one_line(value)}"
    if spec is not None and key.startswith(GAIT):
        return _other_gait(spec, key.removeprefix(GAIT), value, place), catalog
    if spec is not None and key == STANDING_FEET:
        names = [leg.name for leg in spec.legs]
        feet = names if value == "all" else value
        if isinstance(feet, str):
            feet = [name.strip(" []\"'") for name in feet.split(",")]
        try:
            return replace(spec, standing_feet=leg_list(feet, names, place)), catalog
        except RobotFileError as error:
            example = ",".join(names[:LEAST_FEET])
            raise RobotFileError(f"{error}; write such as {STANDING_FEET}={example}") from None
    references = [f"{component}.{p.name}" for component, p in catalog.rows()]
    numbers = spec.parameters if spec is not None else {}
    if key not in numbers and key not in references:
        known = [*([*gait_keys(), STANDING_FEET] if spec else []), *numbers, *references]
        raise RobotFileError(f"{place}: there is no such number; {_hint(key, known)}")
    if spec is not None and key == TOTAL_MASS and not spec.build:
        raise RobotFileError(
            f"{place}: the bodies of this robot are those of {spec.urdf.name}, which it does not "
            "change; change masses there, or put a load on with gait.payload_mass='2 kg'"
        )
    try:
        if spec is not None and key in spec.parameters:
            unit = spec.parameters.parameter(key).unit
            return spec.with_parameters({key: to_si(_number(place, value, unit), unit)}), catalog
        unit = catalog.parameter(key).unit
        return spec, catalog.replaced(key, to_si(_number(place, value, unit), unit))
    except ActuatorError as error:
        raise RobotFileError(f"{place}: {error}") from None


def _refuse_unused(spec: RobotSpec, keys: Iterable[str]) -> None:
    """Raise where a changed number of the gait changes nothing, since ``[gait]`` has its own."""
    for key in (key for key in keys if key in GAIT_NUMBERS):
        try:
            other = spec.with_parameters({key: 1.01 * spec.parameters[key]})
            same = _walked(spec) == _walked(other)
        except (GaitError, ActuatorError):
            continue  # numbers that contradict each other are in use
        if same:
            raise RobotFileError(
                f"--set {key}: it changes nothing, the gait has numbers of its own in its place; "
                "change those of gait.stroke, gait.lift, gait.period, gait.speed that are stated"
            )


def _walked(spec: RobotSpec) -> tuple[bytes, ...]:
    """What the gait's numbers make of the feet's motion."""
    gait = gait_of(spec)
    return tuple(np.asarray(x).tobytes() for x in (gait.period, gait.twist, gait.stride, gait.lift))


def _other_gait(spec: RobotSpec, key: str, value: object, place: str) -> RobotSpec:
    """The robot with one key of ``[gait]`` changed, its number with the unit in the text."""
    try:
        new = replace(spec, gait=changed_table(spec.gait, key, value))
        gait_table(new)
    except GaitError as error:
        raise RobotFileError(f"{place}: {str(error).removeprefix(f'{spec.path}: ')}") from None
    return new


def _thousandfold(before: ParameterSet, after: ParameterSet, key: str) -> list[str]:
    """Say when a change looks like another unit: about a thousand times more or less."""
    if key not in before or before[key] == 0 or after[key] == 0:
        return []
    ratio = abs(after[key] / before[key])
    if not (_THOUSAND[0] < max(ratio, 1 / ratio) < _THOUSAND[1]):
        return []
    old, new = before.parameter(key), after.parameter(key)
    return [
        f"{key} = {new.value_as_written:g} {new.unit} is about a thousand times "
        f"{'more' if ratio > 1 else 'less'} than the file's {old.value_as_written:g}; --set takes "
        f"it in {new.unit}"
    ]


def _hint(key: str, known: list[str]) -> str:
    hint = closest(key, known)
    # All names fill several screens; parameters.csv has them in order.
    return hint if hint.startswith("did") else "parameters.csv of any run lists all names"


def _number(place: str, value: object, unit: str) -> float:
    """A finite number, or its text in Python's and TOML's writing."""
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        bare = "" if unit == "1" else f" in {unit}, without the unit"
        raise RobotFileError(f"{place}: expected a number{bare}") from None
    if not math.isfinite(number):
        raise RobotFileError(f"{place}: expected a finite number")
    return number
