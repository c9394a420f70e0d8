"""Catalogue units and their SI factors; standard library only."""

import math
import re
from collections.abc import Mapping
from typing import Final

from actuators.errors import LegwattError, closest

_RPM: Final = math.pi / 30.0  # [rad/s]
_DEG: Final = math.pi / 180.0  # [rad]

#: Dimension to its units and their factors to SI; the first unit of each is the SI unit.
UNITS: Final[Mapping[str, Mapping[str, float]]] = {
    "ratio": {"1": 1.0, "%": 1e-2},
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3},
    "mass": {"kg": 1.0, "g": 1e-3},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "frequency": {"Hz": 1.0},
    "angle": {"rad": 1.0, "deg": _DEG},
    "angular velocity": {"rad/s": 1.0, "deg/s": _DEG, "rpm": _RPM},
    "angular acceleration": {"rad/s^2": 1.0},
    "velocity": {"m/s": 1.0, "mm/s": 1e-3, "m/min": 1.0 / 60.0},
    "acceleration": {"m/s^2": 1.0},
    "force": {"N": 1.0, "kN": 1e3},
    "torque": {"N*m": 1.0, "mN*m": 1e-3, "cN*m": 1e-2, "N*cm": 1e-2},
    "inertia": {"kg*m^2": 1.0, "g*cm^2": 1e-7, "kg*cm^2": 1e-4},
    "rotational stiffness": {"N*m/rad": 1.0, "N*m/deg": 1.0 / _DEG},
    "viscous friction": {
        "N*m*s/rad": 1.0,
        "mN*m*s/rad": 1e-3,
        "mN*m/krpm": 1e-3 / (1e3 * _RPM),
        "mN*m/rpm": 1e-3 / _RPM,
    },
    "torque per temperature": {"N*m/K": 1.0},
    "viscous friction per temperature": {"N*m*s/(rad*K)": 1.0},
    "stiffness": {"N/m": 1.0, "kN/m": 1e3, "N/mm": 1e3},
    "damping": {"N*s/m": 1.0},
    "density": {"kg/m^3": 1.0, "g/cm^3": 1e3},
    "power": {"W": 1.0, "mW": 1e-3},
    "energy": {"J": 1.0, "mJ": 1e-3, "Wh": 3600.0},
    "specific energy": {"J/kg": 1.0, "Wh/kg": 3600.0},
    "current": {"A": 1.0, "mA": 1e-3},
    "voltage": {"V": 1.0, "mV": 1e-3},
    "resistance": {"ohm": 1.0, "mohm": 1e-3},
    "inductance": {"H": 1.0, "mH": 1e-3},
    # A volt second per radian is a newton metre per ampere.
    "torque constant": {
        "N*m/A": 1.0,
        "mN*m/A": 1e-3,
        "V*s/rad": 1.0,
        "V/krpm": 1.0 / (1e3 * _RPM),
    },
    # Of a motor: speed without load per volt, and torque per square root of its copper loss.
    "speed constant": {"rad/(s*V)": 1.0, "rpm/V": _RPM},
    "motor constant": {"N*m/sqrt(W)": 1.0, "mN*m/sqrt(W)": 1e-3},
    "thermal resistance": {"K/W": 1.0},
    "temperature coefficient": {"1/K": 1.0, "%/K": 1e-2},
    "temperature": {"K": 1.0, "degC": 1.0},
}
#: A number and what follows it.
_QUANTITY: Final = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(\S.*)?")
_OFFSET: Final[Mapping[str, float]] = {"degC": 273.15}  # added after scaling [K]

_DIMENSION: Final = {unit: name for name, units in UNITS.items() for unit in units}
_FACTOR: Final = {unit: f for units in UNITS.values() for unit, f in units.items()}


def known_units() -> tuple[str, ...]:
    """Return every unit of the table, in its order."""
    return tuple(_DIMENSION)


def dimension(unit: str) -> str:
    """Return the dimension of a unit, such as `torque` for `mN*m`.

    Raises:
        LegwattError: The unit is not in the table; the message offers the closest one.
    """
    if not isinstance(unit, str) or unit not in _DIMENSION:
        raise LegwattError(f"unknown unit {unit!r:.40}: {closest(str(unit), known_units())}")
    return _DIMENSION[unit]


def si_unit(dimension_name: str) -> str:
    """Return the SI unit of a dimension, such as `N*m` for `torque`.

    Raises:
        LegwattError: The dimension is not in the table.
    """
    if dimension_name not in UNITS:
        hint = closest(str(dimension_name), [*UNITS])
        raise LegwattError(f"unknown dimension {dimension_name!r:.40}: {hint}")
    return next(iter(UNITS[dimension_name]))


def to_si(value: float, unit: str) -> float:
    """Return a value in SI units.

    Raises:
        LegwattError: The unit is not in the table.
    """
    dimension(unit)
    return value * _FACTOR[unit] + _OFFSET.get(unit, 0.0)


def quantity(written: object, dimension_name: str) -> float:
    """Return a number written with its unit in SI units; see `number_and_unit`."""
    return to_si(*number_and_unit(written, dimension_name))


def number_and_unit(written: object, dimension_name: str) -> tuple[float, str]:
    """Return a number and its unit as they are written, such as ``"240 mm"``.

    Args:
        written: Number and unit in one text; a bare number only for a ratio, or 0.
        dimension_name: Of the table, e.g. ``length``.

    Raises:
        LegwattError: No number, no unit, or a unit of another dimension; says what is expected.
    """
    number = isinstance(written, (int, float)) and not isinstance(written, bool)
    ratio = dimension_name == "ratio"
    example = "0.5" if ratio else f"'1 {si_unit(dimension_name)}'"
    if number and (ratio or written == 0):  # nothing is nothing in every unit
        written = f"{written!r} {si_unit(dimension_name)}"
    if not isinstance(written, str):
        raise LegwattError(f"{written!r:.40} has no unit; expected text such as {example}")
    match = _QUANTITY.fullmatch(written.strip())
    if match is None:
        raise LegwattError(f"{written!r:.40} is no number with a unit; expected such as {example}")
    value, unit = float(match[1]), match[2] or ("1" if ratio else "")
    if not unit:
        raise LegwattError(f"{written!r:.40} has no unit; expected such as {example}")
    if dimension(unit) != dimension_name:
        known = ", ".join(UNITS[dimension_name])
        raise LegwattError(f"{written!r:.40}: expected a {dimension_name} in one of {known}")
    if not math.isfinite(value):
        raise LegwattError(f"{written!r:.40} is not finite")
    return value, unit


def from_si(value: float, unit: str) -> float:
    """Return an SI value in a unit of the table; the inverse of `to_si`."""
    dimension(unit)
    return (value - _OFFSET.get(unit, 0.0)) / _FACTOR[unit]
