"""Numbers that differ from the files' for one run, as ``--set`` and `Machine.with_values` say."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from actuators.errors import LegwattError, closest, one_line
from actuators.loading.build import Catalog
from actuators.parameters import ParameterSet
from actuators.units import to_si
from pipeline.motion.footfall import LEAST_FEET
from pipeline.motion.gait import gait_of, gait_table
from pipeline.motion.gait_table import changed_table, gait_keys
from pipeline.robot.robot_file import RobotSpec, leg_list
from pipeline.robot.robot_tables import GAIT_NUMBERS, check_parameters

#: What a change of the table ``[gait]`` begins with.
GAIT: Final = "gait."
STANDING_FEET: Final = "standing.feet"
TOTAL_MASS: Final = "total_mass"
#: Between these a ratio looks like a slip by a prefix of the unit, the value itself a little off.
_THOUSAND: Final = (200.0, 5000.0)


def with_changes(
    spec: RobotSpec | None, catalog: Catalog, changes: Mapping[str, object]
) -> tuple[RobotSpec | None, Catalog, tuple[str, ...]]:
    """Robot file and catalogue with changed numbers, and what a reader should know of these.

    `changes`: key to value, a number or its text, in the unit that the key's file writes.

    Raises:
        LegwattError: No such number, or none that can be; names it and the closest match.
    """
    notes: list[str] = []
    for key, value in changes.items():
        before = spec
        spec, catalog = _changed(spec, catalog, key, value)
        if before is not None and spec is not None:
            notes += _thousandfold(before.parameters, spec.parameters, key)
    if spec is not None and changes:
        _refuse_contradictions(spec, changes)
    return spec, catalog, tuple(notes)


def _refuse_contradictions(spec: RobotSpec, changes: Mapping[str, object]) -> None:
    """After all changes: two numbers that bind each other may be changed together."""
    check_parameters(spec.parameters, spec.build, "changed numbers")
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
                f"{key}: it changes nothing, the gait has numbers of its own in its "
                "place; change those of gait.stroke, gait.lift, gait.period, gait.speed that "
                "are stated"
            )


def _changed(
    spec: RobotSpec | None, catalog: Catalog, key: str, value: object
) -> tuple[RobotSpec | None, Catalog]:
    """One change; numbers in the unit their file writes."""
    place = f"{one_line(key)}={one_line(value)}"
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
        f"file's {old.value_as_written:g}; a change is written in {new.unit}"
    ]
