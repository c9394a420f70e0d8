"""What a sweep varies: axes as they are written, and the cases they make.

    speed=0.1:0.4:7 m/s       seven values, first and last included
    payload=0, 5, 10 kg       these values

Names are those of ``--set``; ``gait.`` may be left out.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np

from actuators.errors import LegwattError, closest, one_line
from pipeline.motion.gait_table import gait_keys
from pipeline.simulation.changes import GAIT, with_changes
from pipeline.simulation.machine import Machine
from reports.typeset import unit_suffix

#: Everyday words for keys of ``[gait]``.
WORDS: Final = {
    "payload": "gait.payload_mass",
    "slope": "gait.slope_forward",
    "duty": "gait.duty_factor",
    "step_height": "gait.lift",
}
MOST_CASES: Final = 100_000
#: Numbers, and the unit behind them.
_NUMBERS: Final = re.compile(r"((?:[-+0-9.,:eE ]|nan|inf)*(?:[0-9.]|nan|inf))\s*([A-Za-z%].*)")
_RANGE: Final = (
    "expected FIRST:LAST:COUNT, two finite numbers and a count from 2 to "
    f"{MOST_CASES}, such as 'speed=0.1:0.4:7 m/s'"
)

Value = float | str


@dataclass(frozen=True)
class Axis:
    """One number or choice that is varied."""

    key: str  #: As ``--set`` writes it.
    unit: str  #: Of the values; empty for pure numbers and words.
    values: tuple[Value, ...]  #: In their order.

    @property
    def header(self) -> str:
        """Of its column."""
        name = self.key.removeprefix(GAIT).replace(".", "__")
        suffix = unit_suffix(self.unit)
        return f"{name}_{suffix}" if suffix else name

    def change(self, value: Value) -> object:
        """A value as `Machine.with_values` takes it, units as the key's file has them."""
        return f"{value!r} {self.unit}" if self.unit and self.key.startswith(GAIT) else value


def _axis(text: str, machine: Machine) -> Axis:
    name, _, written = (part.strip() for part in text.partition("="))
    if not name or not written:
        raise ValueError("expected NAME=VALUES, such as 'speed=0.1:0.4:7 m/s'")
    key = WORDS.get(name, name)
    key = f"{GAIT}{key}" if f"{GAIT}{key}" in gait_keys() else key
    numbers, catalog = machine.robot.spec.parameters, machine.catalog
    if "." not in key and key not in numbers:
        known = [*WORDS, *(k.removeprefix(GAIT) for k in gait_keys()), *numbers]
        raise ValueError(f"there is no such number; {closest(name, known)}")
    match = _NUMBERS.fullmatch(written)
    body, unit = match.groups() if match else (written, "")
    if not key.startswith(GAIT):  # a number of the robot's or an actuator's file, in its unit
        own = (numbers if key in numbers else catalog).parameter(key).unit
        if unit not in ("", own):
            raise ValueError(f"its unit is {own}, not {unit}")
        unit = "" if own == "1" else own
    axis = Axis(key, unit, _values(body))
    for value in axis.values:  # each by itself is one that ``--set`` takes; together may not be
        try:
            changes = {**machine.changes, key: axis.change(value)}
            with_changes(machine.written, machine.written_catalog, changes)
        except LegwattError as error:
            raise ValueError(str(error).partition(": ")[2] or str(error)) from None
    return axis


def _values(body: str) -> tuple[Value, ...]:
    first, *others = (part.strip() for part in body.split(":"))
    if not others:
        values = tuple(_value(part.strip()) for part in body.split(","))
        if "" in values or len(set(values)) < len(values):
            raise ValueError("a value is empty or stands twice")
        if any(isinstance(value, float) and not math.isfinite(value) for value in values):
            raise ValueError("expected finite numbers")
        return values
    low, high = _value(first), _value(others[0])
    count = int(others[1]) if len(others) == 2 and others[1].isdecimal() else 0
    ends = isinstance(low, float) and isinstance(high, float) and math.isfinite(low + high)
    if not ends or not 2 <= count <= MOST_CASES or low == high:
        raise ValueError(_RANGE)
    return tuple(float(f"{v:.12g}") for v in np.linspace(float(low), float(high), count))


def _value(text: str) -> Value:
    try:
        return float(text)
    except ValueError:
        return text


def read_axes(texts: Iterable[str], machine: Machine) -> tuple[Axis, ...]:
    """The axes of each ``NAME=VALUES``, a number of the machine.

    Raises:
        LegwattError: None, one that cannot be read or that the machine does not have in this unit,
            or a number twice.
    """
    axes: dict[str, Axis] = {}
    for text in texts:
        try:
            axis = _axis(text, machine)
        except ValueError as error:
            raise LegwattError(f"vary {one_line(text)}: {error}") from None
        if axis.key in axes:
            raise LegwattError(f"vary {axis.key}: stands twice")
        axes[axis.key] = axis
    if not axes:
        raise LegwattError("nothing is varied: give NAME=VALUES")
    return tuple(axes.values())


def cases_of(axes: tuple[Axis, ...]) -> list[tuple[Value, ...]]:
    """Every combination of the values, in the order of the axes.

    Raises:
        LegwattError: There are too many.
    """
    total = math.prod(len(axis.values) for axis in axes)
    if total > MOST_CASES:
        raise LegwattError(f"{total} cases: expected at most {MOST_CASES}")
    return list(product(*(axis.values for axis in axes)))
