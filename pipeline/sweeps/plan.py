"""What a sweep varies: axes as they are written, and the cases they make.

    speed=0.1:0.4:7 m/s       seven values, first and last included
    payload=0, 5, 10 kg       these values
    lift=20:60 mm             a range, with a sample only

Names are those of ``--set``; ``gait.`` may be left out.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Final

import numpy as np
from scipy.stats import qmc

from actuators.checked import read_toml
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
    values: tuple[Value, ...]  #: In their order; the two ends of a range.
    ranged: bool = False  #: Whether everything between two ends is meant.

    @property
    def header(self) -> str:
        """Of its column."""
        name = self.key.removeprefix(GAIT).replace(".", "__")
        suffix = unit_suffix(self.unit)
        return f"{name}_{suffix}" if suffix else name

    def change(self, value: Value) -> object:
        """A value as `Machine.with_values` takes it, units as the key's file has them."""
        return f"{value!r} {self.unit}" if self.unit and self.key.startswith(GAIT) else value

    def at(self, share: float) -> Value:
        """The value at a share in [0, 1) of the axis."""
        if self.ranged:
            low, high = (float(value) for value in self.values)
            return low + share * (high - low)
        return self.values[int(share * len(self.values))]


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
    axis = Axis(key, unit, *_values(body))
    for value in axis.values:  # each by itself is one that ``--set`` takes; together may not be
        try:
            changes = {**machine.changes, key: axis.change(value)}
            with_changes(machine.written, machine.written_catalog, changes)
        except LegwattError as error:
            raise ValueError(str(error).partition(": ")[2] or str(error)) from None
    return axis


def _values(body: str) -> tuple[tuple[Value, ...], bool]:
    """Values, and whether they are the ends of a range."""
    parts = [part.strip() for part in body.split(":")]
    if len(parts) == 1:
        values = tuple(_value(part.strip()) for part in body.split(","))
        if "" in values or len(set(values)) < len(values):
            raise ValueError("a value is empty or stands twice")
        if any(isinstance(value, float) and not math.isfinite(value) for value in values):
            raise ValueError("expected finite numbers")
        return values, False
    low, high = (_value(part) for part in parts[:2])
    count = int(parts[2]) if len(parts) == 3 and parts[2].isdecimal() else 2 * (len(parts) == 2)
    ends = isinstance(low, float) and isinstance(high, float) and math.isfinite(low + high)
    if not ends or not 2 <= count <= MOST_CASES or low == high:
        raise ValueError(_RANGE)
    if len(parts) == 2:
        return (low, high), True
    return tuple(float(f"{v:.12g}") for v in np.linspace(float(low), float(high), count)), False


def _value(text: str) -> Value:
    try:
        return float(text)
    except ValueError:
        return text


def read_plan(path: Path) -> list[str]:
    """The axes of a TOML file with one table ``[vary]``, as ``--vary`` writes them.

    Raises:
        LegwattError: It cannot be read, or holds something else.
    """
    table = read_toml(path)
    vary = table.get("vary")
    told = vary.items() if [*table] == ["vary"] and isinstance(vary, Mapping) else ()
    if not told or not all(isinstance(values, str) for _, values in told):
        raise LegwattError(f'{path}: expected one table [vary] with lines NAME = "VALUES"')
    return [f"{name}={values}" for name, values in told]


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
        raise LegwattError("nothing is varied: give NAME=VALUES or a plan")
    return tuple(axes.values())


def cases_of(
    axes: tuple[Axis, ...], sample: int | None = None, seed: int = 1
) -> list[tuple[Value, ...]]:
    """The values of every case, in the order of the axes.

    Args:
        axes: What is varied.
        sample: Number of cases drawn (Sobol's sequence, of SciPy); every combination of the values
            by default.
        seed: Of the draw.

    Raises:
        LegwattError: A range without a sample, an unknown seed, or too many cases.
    """
    if seed < 0:
        raise LegwattError(f"seed {seed}: starts at 0")
    total = math.prod(len(axis.values) for axis in axes) if sample is None else sample
    if not 1 <= total <= MOST_CASES:
        raise LegwattError(f"{total} cases: expected 1 to {MOST_CASES}")
    if sample is None:
        if ranged := [axis.key for axis in axes if axis.ranged]:
            raise LegwattError(
                f"vary {ranged[0]}: a range needs a sample, or a number of values at its end"
            )
        return list(product(*(axis.values for axis in axes)))
    # A power of two keeps its balance.
    shares = qmc.Sobol(len(axes), rng=seed).random_base2(max(sample - 1, 1).bit_length())
    return [
        tuple(axis.at(float(share)) for axis, share in zip(axes, row, strict=True))
        for row in shares[:sample]
    ]
