"""Parameters with unit, basis, source and interval, from TOML; what numbers of laws may be."""

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final

from pydantic import AfterValidator, create_model

from actuators.checked import Number, Pair, Table, checked
from actuators.errors import LegwattError, closest, one_line
from actuators.text_file import read_toml_file
from actuators.units import dimension, from_si, si_unit, to_si

BASES: Final = ("published", "datasheet", "derived", "calibrated", "identified", "assumed")
UNCERTAIN_BASES: Final = ("calibrated", "identified", "assumed")
#: SI values beyond this overflow somewhere between here and the energies.
LARGEST: Final = 1e9
_SIGMAS_95: Final = 1.96

#: Rule of a number to what holds, which is false for NaN, and how it is said.
_RULES: Final[Mapping[str, tuple[Callable[[Any], Any], str]]] = {
    "": (lambda x: (x >= 0.0) & (x < math.inf), "must be finite and not negative"),
    "signed": (lambda x: (x > -math.inf) & (x < math.inf), "must be finite"),
    "positive": (lambda x: (x > 0.0) & (x < math.inf), "must be positive and finite"),
    "limit": (lambda x: x > 0.0, "must be > 0"),
    "share": (lambda x: (x >= 0.0) & (x < 1.0), "must be 0 or more and below 1"),
}

Interval = tuple[float, float]


@dataclass(frozen=True)
class Parameter:
    """One number with everything needed to judge it.

    Raises:
        LegwattError: On construction, where an attribute contradicts another.
    """

    name: str  #: Key in its set.
    value: float  #: Value in SI units.
    unit: str  #: Unit as written in the file.
    value_as_written: float  #: Value in `unit`.
    basis: str  #: One of `BASES`.
    source: str  #: Where the number comes from: table, data sheet, formula.
    #: Where the true value is thought to lie, SI; required by `UNCERTAIN_BASES`.
    interval: Interval | None = None
    bounds: Interval | None = None  #: Outside of these the value is refused, SI.
    reason: str = ""  #: Why this value, for an assumption.

    @property
    def spread(self) -> float:
        """Standard deviation over value, the interval taken for one of 95 %; 0 without one [1]."""
        if self.interval is None or self.value == 0.0:
            return 0.0
        low, high = self.interval
        return (high - low) / (2.0 * _SIGMAS_95 * abs(self.value))

    def __post_init__(self) -> None:
        if wrong := self._wrong():
            raise LegwattError(f"'{self.name}': {wrong}")

    def _wrong(self) -> str:
        """What contradicts; empty where nothing does."""
        if not math.isfinite(self.value):
            return f"{self.value} is not a finite number: give one"
        written = f"{self.value_as_written:g} {self.unit}"
        if abs(self.value) > LARGEST:
            return f"{written} is beyond any machine; check its unit"
        if self.basis not in BASES:
            return f"unknown basis {self.basis!r:.40}: {closest(self.basis, BASES)}"
        if not self.source.strip():
            return "no source: say where the number comes from"
        if self.basis in UNCERTAIN_BASES and self.interval is None:
            return f"basis '{self.basis}' needs an interval = [low, high]"
        if self.basis == "assumed" and not self.reason.strip():
            return "basis 'assumed' needs a reason"
        for kind, pair in (("interval", self.interval), ("bounds", self.bounds)):
            if pair is None:
                continue
            span = "[{:g}, {:g}]".format(*(from_si(x, self.unit) for x in pair))
            if not pair[0] <= pair[1]:
                return f"{kind} {span} runs backwards"
            if not pair[0] <= self.value <= pair[1]:
                return f"value {written} lies outside its {kind} {span}: correct one of them"
        return ""


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
        """Return the parameter with its unit, basis and source.

        Raises:
            LegwattError: No parameter has this name.
        """
        if name not in self._parameters:
            raise LegwattError(
                f"{self.where}: no parameter '{one_line(name)}': "
                f"{closest(str(name), list(self._parameters))}"
            )
        return self._parameters[name]

    def rows(self) -> tuple[Parameter, ...]:
        """Return the parameters in order, as rows of a table."""
        return tuple(self._parameters.values())

    def replaced(self, name: str, value: float, **changes: Any) -> "ParameterSet":
        """Return a set in which one parameter has another SI value.

        Args:
            name: Which parameter.
            value: Inside the parameter's bounds.
            **changes: New `basis`, `source`, `interval` (SI) and `reason`. Without them the
                parameter becomes an assumption whose interval spans the old one and the value.

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
        try:
            replacement = dataclasses.replace(old, **new)
        except LegwattError as error:
            raise LegwattError(f"{self.where}: {error}") from None
        rows = tuple(replacement if p.name == name else p for p in self.rows())
        return ParameterSet(rows, self.where)


class Numbers:
    """A dataclass of numbers, which must be finite and not negative unless a rule says otherwise.

    Raises:
        LegwattError: On construction, where a number breaks its rule for some joint.
    """

    rules: ClassVar[Mapping[str, str]] = {}  #: Name to `signed`, `positive`, `limit` or `share`.

    def __post_init__(self) -> None:
        where = getattr(self, "name", type(self).__name__)
        for name, value in vars(self).items():
            if not isinstance(value, str | tuple):
                holds, words = _RULES[self.rules.get(name, "")]
                require(holds(value), where, f"{name} {words}")


def require(condition: object, where: str, remedy: str) -> None:
    """Raise unless a condition of the element `where` holds for every joint.

    Raises:
        LegwattError: Says that the `remedy` must hold.
    """
    if condition is True:
        return
    import numpy as np  # for arrays alone: the command line starts without it

    if not np.all(np.asarray(condition)):
        raise LegwattError(f"element '{where}': {remedy}")


def read_toml(path: str | Path) -> dict[str, Any]:
    """Return the contents of a TOML file.

    Raises:
        LegwattError: The file is missing, unreadable or not TOML.
    """
    try:
        return read_toml_file(Path(path))
    except LegwattError as error:
        # The folder, too: it is what is wrong with `--actuators` when a file is not there.
        raise LegwattError(f"{one_line(path)}: {error}") from None


class _Written(Table):
    expected = "{value, unit, basis, source}"
    value: Number
    unit: str
    basis: str
    source: str
    interval: Pair | None = None
    bounds: Pair | None = None
    reason: str = ""


class _Names(Table):
    noun = "parameter"
    expected = "parameters by name"


def _parameter(name: str, expected: str, entry: _Written) -> Parameter:
    """One parameter in SI units, of the dimension that is expected."""
    unit = entry.unit
    try:
        found = dimension(unit)
        if found != expected:
            raise LegwattError(
                f"'{unit}' is a unit of {found}, expected {expected} such as '{si_unit(expected)}'"
            )
        si: dict[str, Any] = entry.model_dump() | {"value": to_si(entry.value, unit)}
        for kind in ("interval", "bounds"):
            if si[kind] is not None:
                si[kind] = tuple(to_si(x, unit) for x in si[kind])
        return Parameter(name=name, value_as_written=entry.value, **si)
    except LegwattError as error:
        raise ValueError(str(error).removeprefix(f"'{name}'").lstrip(": ")) from None


@cache
def _table(schema: tuple[tuple[str, str], ...], optional: frozenset[str]) -> type[_Names]:
    """The table of the parameters of a schema, which become `Parameter` as they are read."""
    fields: dict[str, Any] = {}
    for name, kind in schema:
        entry = Annotated[_Written, AfterValidator(partial(_parameter, name, kind))]
        fields[name] = (entry | None, None) if name in optional else (entry, ...)
    return create_model("_Named", __base__=_Names, **fields)


def parameters_from_table(
    table: object, schema: Mapping[str, str], where: str, optional: frozenset[str] = frozenset()
) -> ParameterSet:
    """Turn a TOML table of parameters into a set.

    Args:
        table: `{name: {value, unit, basis, source, interval, bounds, reason}}`; `interval` and
            `bounds` are `[low, high]` in the parameter's own unit.
        schema: Dimension of every expected name; it also gives the order.
        where: File and table, for messages.
        optional: Names of the schema that may be missing.

    Raises:
        LegwattError: A name or key that is unknown or missing, a value that is not a finite number
            of the right dimension, or attributes that contradict one another; all of them.
    """
    names = _table(tuple(schema.items()), optional)
    read = checked(names, table, where, LegwattError)
    rows = (getattr(read, name) for name in schema)
    return ParameterSet(tuple(row for row in rows if row is not None), where)
