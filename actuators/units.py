"""Units and their factors to SI, one row each of `units.csv`; the SI unit of a dimension is first.

A unit is known however it is spelt: ``mN*m``, ``mNm`` and ``mN·m``, ``g*cm^2`` and ``gcm²``,
``ohm`` and ``Ω``, ``rpm`` and ``rev/min``, and a ratio as ``9`` or ``9:1``.
"""

import csv
import math
import re
from pathlib import Path
from typing import Final

from actuators.errors import LegwattError, known

with Path(__file__).with_name("units.csv").open(encoding="utf-8", newline="") as _file:
    UNITS: Final = {row["unit"]: row for row in csv.DictReader(_file)}
_SPELT: Final = str.maketrans(
    {"Ω": "ohm", "µ": "u", "μ": "u", "²": "2", "³": "3"} | dict.fromkeys("*·.^() ", "")
)
_PLAIN: Final = {unit.translate(_SPELT): unit for unit in UNITS} | {
    **{":1": "1"},
    **dict.fromkeys(("rev/min", "r/min", "1/min", "min-1"), "rpm"),
}
_QUANTITY: Final = re.compile(
    r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?:(?![.,])\s*(.*?))?\s*"
)


def spelt(unit: str) -> str:
    """Return a unit as the table writes it, such as ``N*m`` for ``Nm``.

    Raises:
        LegwattError: The unit is not in the table; the message offers the closest one.
    """
    plain = str(unit).replace("°C", "degC").replace("°", "deg").translate(_SPELT)
    return _PLAIN[plain] if plain in _PLAIN else known("unknown unit", unit, UNITS)


def dimension(unit: str) -> str:
    """Return the dimension of a unit, such as ``torque`` for ``mN*m``; errors as `spelt`."""
    return UNITS[spelt(unit)]["dimension"]


def si_unit(dimension_name: str) -> str:
    """Return the SI unit of a dimension of the table, such as ``N*m`` for ``torque``."""
    return next(u for u, row in UNITS.items() if row["dimension"] == dimension_name)


def to_si(value: float, unit: str) -> float:
    """Return a value in SI units; errors as `spelt`."""
    row = UNITS[spelt(unit)]
    return value * float(row["factor"]) + float(row["offset"] or 0.0)


def from_si(value: float, unit: str) -> float:
    """Return an SI value in a unit of the table; the inverse of `to_si`."""
    row = UNITS[spelt(unit)]
    return (value - float(row["offset"] or 0.0)) / float(row["factor"])


def quantity(written: object, dimension_name: str) -> float:
    """Return a number written with its unit in SI units; see `number_and_unit`."""
    return to_si(*number_and_unit(written, dimension_name))


def number_and_unit(written: object, dimension_name: str) -> tuple[float, str]:
    """Return a number and its unit as written, such as ``"240 mm"``; bare only for a ratio, or 0.

    Raises:
        LegwattError: No number, no unit, or a unit of another dimension; says what is expected.
    """
    si = si_unit(dimension_name)
    bare = "" if dimension_name == "ratio" else f" {si}"
    match = _QUANTITY.fullmatch(str(written))
    value = math.nan if match is None or isinstance(written, bool) else float(match[1])
    unit = (match[2] if match else "") or ("" if bare and value else si)
    if not math.isfinite(value) or not unit:
        what = "has no unit" if math.isfinite(value) else "is no finite number with a unit"
        raise LegwattError(f"{written!r:.40} {what}; expected such as '1{bare}'")
    if dimension(unit) != dimension_name:
        raise LegwattError(f"{written!r:.40}: expected a {dimension_name} such as '1{bare}'")
    return value, unit
