"""Numbers that differ from the files' for one run, as ``--set`` and `Machine.with_values` say."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from actuators.checked import finite
from actuators.errors import LegwattError, closest, one_line
from actuators.loading.build import Catalog
from actuators.units import dimension, quantity, to_si
from pipeline.motion.footfall import LEAST_FEET
from pipeline.motion.gait import gait_of, gait_table
from pipeline.motion.gait_table import changed_table, gait_keys
from pipeline.robot.robot_file import RobotSpec, leg_list
from pipeline.robot.robot_tables import GAIT_NUMBERS, check_parameters

#: What a change of the table ``[gait]`` begins with.
GAIT: Final = "gait."
STANDING_FEET: Final = "standing.feet"
TOTAL_MASS: Final = "total_mass"


def with_changes(
    spec: RobotSpec, catalog: Catalog, changes: Mapping[str, object]
) -> tuple[RobotSpec, Catalog]:
    """Robot file and catalogue with changed numbers.

    `changes`: key to value, a number or its text, in the unit that the key's file writes.

    Raises:
        LegwattError: No such number, or none that can be; names it and the closest match.
    """
    for key, value in changes.items():
        try:
            if key.startswith(GAIT):
                table = changed_table(spec.gait, key.removeprefix(GAIT), value)
                spec = spec.model_copy(update={"gait": table})
                gait_table(spec)
            elif key == STANDING_FEET:
                standing = {"feet": _feet(spec, value)}
                spec = spec.model_copy(update={"standing": standing})
            else:
                spec, catalog = _with_number(spec, catalog, key, value)
        except LegwattError as error:
            reason = str(error).removeprefix(f"{spec.path}: ")
            raise LegwattError(f"{one_line(key)}={one_line(value)}: {reason}") from None
    if changes:  # two numbers that bind each other may change together
        check_parameters(spec.parameters, spec.robot.build, "changed numbers")
        for key in GAIT_NUMBERS.intersection(changes):
            _refuse_without_effect(spec, key)
    return spec, catalog


def _with_number(
    spec: RobotSpec, catalog: Catalog, key: str, value: object
) -> tuple[RobotSpec, Catalog]:
    """A number of the robot file or of an actuator, in the unit that its file writes."""
    numbers = {p.name: p for p in spec.parameters.rows()}
    numbers |= {f"{component}.{p.name}": p for component, p in catalog.rows()}
    if key not in numbers:
        hint = closest(key, [*gait_keys(), STANDING_FEET, *numbers])
        if not hint.startswith("did"):  # all names fill several screens
            hint = "parameters.csv of any run lists all names"
        raise LegwattError(f"there is no such number; {hint}")
    if key == TOTAL_MASS and not spec.robot.build:
        raise LegwattError(
            f"the bodies of this robot are those of {spec.urdf.name}, which it does not "
            "change; change masses there, or put a load on with gait.payload_mass='2 kg'"
        )
    unit = numbers[key].unit
    try:
        number = to_si(finite(float(value)), unit)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        number = quantity(value, dimension(unit))
    if key in spec.parameters:
        return spec.with_parameters({key: number}), catalog
    return spec, catalog.replaced(key, number)


def _feet(spec: RobotSpec, value: object) -> tuple[str, ...]:
    """Legs to stand on: ``all``, names in a text, or a list of them."""
    feet = [*spec.leg_names] if value == "all" else value
    if isinstance(feet, str):
        feet = [name.strip(" []\"'") for name in feet.split(",")]
    try:
        return leg_list(feet, [*spec.leg_names], STANDING_FEET)
    except LegwattError as error:
        example = ",".join(spec.leg_names[:LEAST_FEET])
        raise LegwattError(f"{error}; write such as {STANDING_FEET}={example}") from None


def _refuse_without_effect(spec: RobotSpec, key: str) -> None:
    """Refuse a number of the robot file that ``[gait]`` states in other words."""
    try:
        other = spec.with_parameters({key: 1.01 * spec.parameters[key]})
        one, two = ((g.period, *g.twist, *g.stride, g.lift) for g in map(gait_of, (spec, other)))
    except LegwattError:
        return  # numbers that contradict each other are in use
    if one == two:
        raise LegwattError(
            f"{key}: it changes nothing, the gait has numbers of its own in its place; change "
            "those of gait.stroke, gait.lift, gait.period, gait.speed that are stated"
        )
