"""Parameters with unit, basis, source and interval, from TOML; what numbers of laws may be; units.

Units and their factors to SI are one row each of `units.csv`; the SI unit of a dimension is first.
A unit is known however it is spelt: ``mN*m``, ``mNm`` and ``mN·m``, ``g*cm^2`` and ``gcm²``,
``ohm`` and ``Ω``, ``rpm`` and ``rev/min``, and a ratio as ``9`` or ``9:1``.
"""

import csv
import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import field, fields
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

from pydantic import AfterValidator, model_validator

from actuators.checked import Number, Pair, Table, Text, checked
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


UNCERTAIN_BASES: Final = ("calibrated", "identified", "assumed")
#: SI values beyond this overflow somewhere between here and the energies.
LARGEST: Final = 1e9
_SIGMAS_95: Final = 1.96

#: Rule to what holds, which is false for NaN, and how it is said.
_RULES: Final[Mapping[str, tuple[Callable[[Any], Any], str]]] = {
    "": (lambda x: (x >= 0.0) & (x < math.inf), "must be finite and not negative"),
    "signed": (lambda x: (x > -math.inf) & (x < math.inf), "must be finite"),
    "positive": (lambda x: (x > 0.0) & (x < math.inf), "must be positive and finite"),
    "limit": (lambda x: x > 0.0, "must be > 0"),
    "share": (lambda x: (x >= 0.0) & (x < 1.0), "must be 0 or more and below 1"),
}


class _Written(Table):
    """A number as a file has it."""

    value: Number
    unit: Annotated[str, AfterValidator(lambda unit: spelt(unit) and unit)]
    basis: Literal["published", "datasheet", "derived", "calibrated", "identified", "assumed"]
    source: Text  #: Where the number comes from: table, data sheet, formula.
    #: Where the true value is thought to lie; required by `UNCERTAIN_BASES`.
    interval: Pair | None = None
    bounds: Pair | None = None  #: Outside of these the value is refused.
    reason: str = ""  #: Why this value, for an assumption.


class Parameter(_Written):
    """One number with everything needed to judge it; value, interval and bounds in SI units."""

    name: str  #: Key in its set.
    value_as_written: Number  #: Value in `unit`, as the file has it.

    @property
    def spread(self) -> float:
        """Standard deviation over value, the interval taken for one of 95 %; 0 without one [1]."""
        if self.interval is None or self.value == 0.0:
            return 0.0
        low, high = self.interval
        return (high - low) / (2.0 * _SIGMAS_95 * abs(self.value))

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        written = f"{self.value_as_written:g} {self.unit}"
        if abs(self.value) > LARGEST:
            raise ValueError(f"{written} is beyond any machine; check its unit")
        if self.basis in UNCERTAIN_BASES and self.interval is None:
            raise ValueError(f"basis '{self.basis}' needs an interval = [low, high]")
        if self.basis == "assumed" and not self.reason.strip():
            raise ValueError("basis 'assumed' needs a reason")
        for kind, pair in (("interval", self.interval), ("bounds", self.bounds)):
            if pair is not None and not pair[0] <= self.value <= pair[1]:
                span = "[{:g}, {:g}]".format(*(from_si(x, self.unit) for x in pair))
                raise ValueError(f"value {written} lies outside its {kind} {span}")
        return self


class ParameterSet(Mapping[str, float]):
    """An ordered, unchangeable set of parameters, of a file or component: SI values by name."""

    def __init__(self, parameters: tuple[Parameter, ...], where: str) -> None:
        self._parameters: Final = {p.name: p for p in parameters}
        self.where: Final = where

    def __getitem__(self, name: str) -> float:
        return self.parameter(name).value

    def __contains__(self, name: object) -> bool:
        return name in self._parameters  # of Mapping's own, a KeyError would be the message

    def __iter__(self) -> Iterator[str]:
        return iter(self._parameters)

    def __len__(self) -> int:
        return len(self._parameters)

    def parameter(self, name: str) -> Parameter:
        """Return the parameter with its unit, basis and source; a LegwattError where none is."""
        return self._parameters[known("no parameter", name, self._parameters, self.where)]

    def rows(self) -> tuple[Parameter, ...]:
        """Return the parameters in order, as rows of a table."""
        return tuple(self._parameters.values())

    def replaced(self, name: str, value: float, **changes: Any) -> "ParameterSet":
        """Return a set in which one parameter has another SI value, inside its bounds.

        `changes` are `basis`, `source`, `interval`, `bounds` (SI) and `reason`; without them it
        becomes an assumption whose interval spans the old one and the value.

        Raises:
            LegwattError: Unknown name, or a value or change that contradicts the rest.
        """
        old = self.parameter(name)
        spread = (old.value, value, *(old.interval or ()))
        new: dict[str, Any] = {
            "basis": "assumed",
            "source": "set in place of the file's value",
            "reason": f"replaces {old.value_as_written:g} {old.unit} ({old.basis})",
            "interval": (min(spread), max(spread)),
        }
        new |= changes
        new |= {"value": value, "value_as_written": from_si(value, old.unit)}
        replacement = checked(Parameter, {**vars(old), **new}, f"{self.where}: '{old.name}'")
        rows = tuple(replacement if p.name == name else p for p in self.rows())
        return ParameterSet(rows, self.where)


def number(dimension: str = "", rule: str = "", default: Any = 0.0, *, needed: bool = False) -> Any:
    """Declare a field of `Numbers`.

    Args:
        dimension: Of `actuators.parameters`, of a number that catalogues may state; else empty.
        rule: ``signed``, ``positive``, ``limit`` or ``share``; finite and not negative by default.
        default: Value; ``dataclasses.MISSING`` for none.
        needed: Whether a catalogue has to state it.
    """
    about = {"dimension": dimension, "rule": rule, "needed": needed}
    return field(default=default, metadata=about)


class Numbers:
    """A dataclass of numbers, each of which keeps, for all joints, the rule `number` declares."""

    def __post_init__(self) -> None:
        where = getattr(self, "name", type(self).__name__)
        for own in fields(self):  # type: ignore[arg-type]  # its subclasses are dataclasses
            if not isinstance(value := getattr(self, own.name), str | tuple):
                holds, words = _RULES[own.metadata.get("rule", "")]
                require(holds(value), where, f"{own.name} {words}")

    @classmethod
    def stated(cls) -> dict[str, str]:
        """Numbers that a catalogue may state, each with its dimension."""
        every = fields(cls)  # type: ignore[arg-type]
        return {f.name: dim for f in every if (dim := f.metadata.get("dimension"))}

    @classmethod
    def needed(cls) -> list[str]:
        """Those that it has to state."""
        return [f.name for f in fields(cls) if f.metadata.get("needed")]  # type: ignore[arg-type]


def require(condition: object, where: str, remedy: str) -> None:
    """Raise a LegwattError with a remedy unless a condition holds for all joints of an element."""
    if condition is True:
        return
    import numpy as np  # for arrays alone: the command line starts without it

    if not np.all(np.asarray(condition)):
        raise LegwattError(f"element '{where}': {remedy}")


def parameters_from_table(
    table: object, schema: Mapping[str, str], where: str, optional: frozenset[str] = frozenset()
) -> ParameterSet:
    """Turn a TOML table of parameters into a set.

    Args:
        table: `{name: {value, unit, basis, source, interval, bounds, reason}}`, in its own unit.
        schema: Dimension of every expected name; it also gives the order.
        where: File and table, for messages.
        optional: Names of the schema that may be missing.

    Raises:
        LegwattError: A name or key is unknown or missing, a value is no finite number of the right
            dimension, or attributes contradict one another.
    """
    if not isinstance(table, Mapping):
        raise LegwattError(f"{where}: must be a table of parameters by name")
    for name in table:
        known("unknown parameter", name, schema, where)
    if lacking := ", ".join(f"'{n}'" for n in schema if n not in table and n not in optional):
        raise LegwattError(f"{where}: missing parameter {lacking}")
    rows = (
        _parameter(name, kind, table[name], f"{where}: '{name}'")
        for name, kind in schema.items()
        if name in table
    )
    return ParameterSet(tuple(rows), where)


def _parameter(name: str, expected: str, entry: object, where: str) -> Parameter:
    """One parameter in SI units, of the dimension that is expected."""
    written = checked(_Written, entry, where)
    unit = written.unit
    if (found := dimension(unit)) != expected:
        si = si_unit(expected)
        raise LegwattError(
            f"{where}: '{unit}' is a unit of {found}, expected {expected} such as '{si}'"
        )
    given = {"interval": written.interval, "bounds": written.bounds}
    si_pairs = {k: pair and tuple(to_si(x, unit) for x in pair) for k, pair in given.items()}
    own = {"name": name, "value": to_si(written.value, unit), "value_as_written": written.value}
    return checked(Parameter, {**vars(written), **si_pairs, **own}, where)
