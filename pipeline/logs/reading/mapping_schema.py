"""What may stand in a mapping file, table by table; `mapping.py` says what it means."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, Strict, model_validator

from actuators.checked import Names, Number, Table, Text, finite
from actuators.errors import UnitError, closest, one_line
from actuators.units import dimension, to_si
from pipeline.logs.reading.log import EFFORTS

#: Beyond these a number is a slip, and some product of it overflows.
LARGEST = 1e12


def _small(value: float) -> float:
    if abs(value) > LARGEST:
        raise ValueError(f"must be a finite number below {LARGEST:g}")
    return value


def _not_zero(value: float) -> float:
    if value == 0.0:
        raise ValueError("must not be zero")
    return value


def _unit(expected: str | None, unit: str) -> str:
    """A unit of the table, of one dimension where one is expected.

    Raises:
        ValueError: It is unknown or another's.
    """
    try:
        found = dimension(unit)
    except UnitError as error:
        raise ValueError(str(error)) from None
    if expected is not None and found != expected:
        raise ValueError(f"'{unit}' is a unit of {found}, expected {expected}")
    return unit


def _channel(name: str) -> str:
    if name not in EFFORTS:
        raise ValueError(f"= '{one_line(name)}': {closest(name, list(EFFORTS))}")
    return name


def _text_or_number(value: object) -> str | float:
    return value if isinstance(value, str) else _small(finite(value))


def _one_star(name: str) -> str:
    if name.count("*") > 1:
        raise ValueError("at most one star in a pattern")
    return name


def _delimiter(text: str) -> str:
    if text not in (",", ";", "\t", " ", "|"):
        raise ValueError("must be one of , ; tab space |")
    return text


def _listed(value: object) -> object:
    if not isinstance(value, list):
        raise ValueError("must be written [[logs]] with two brackets")
    return value


Small = Annotated[Number, AfterValidator(_small)]
Factor = Annotated[Small, AfterValidator(_not_zero)]
AnyUnit = Annotated[str, AfterValidator(partial(_unit, None))]
Pattern = Annotated[Text, AfterValidator(_one_star)]


class QuantityTable(Table):
    """A number with its unit."""

    expected = "{value = ..., unit = ...}"
    value: Small
    unit: AnyUnit

    @property
    def si(self) -> float:
        """The number in SI units."""
        return to_si(self.value, self.unit)


def _of(expected: str, quantity: QuantityTable) -> QuantityTable:
    _unit(expected, quantity.unit)
    return quantity


def _positive(quantity: QuantityTable) -> QuantityTable:
    if not quantity.si > 0:
        raise ValueError("must be positive")
    return quantity


def _sampling(rate: QuantityTable) -> QuantityTable:
    if not 0 < rate.si < 1e9:
        raise ValueError("must be positive and below 1 GHz")
    return rate


Voltage = Annotated[
    QuantityTable, AfterValidator(partial(_of, "voltage")), AfterValidator(_positive)
]
Rate = Annotated[
    QuantityTable, AfterValidator(partial(_of, "frequency")), AfterValidator(_sampling)
]


class CsvTable(Table):
    """How the file separates its columns and its decimals."""

    delimiter: Annotated[str, AfterValidator(_delimiter)] = ","
    decimal: Literal[".", ","] = "."

    @model_validator(mode="after")
    def _differ(self) -> Self:
        if self.delimiter == self.decimal:
            raise ValueError(f"delimiter and decimal are both '{self.decimal}'")
        return self


class TimeTable(Table):
    """Where time comes from."""

    column: str | None = None
    unit: Annotated[str, AfterValidator(partial(_unit, "time"))] = "s"
    sample_rate: Rate | None = None

    @model_validator(mode="after")
    def _one(self) -> Self:
        if self.sample_rate is not None and self.column is not None:
            raise ValueError("give column or sample_rate, not both")
        return self


class ColumnTable(Table):
    """How one column, or all that match a pattern, become columns of the log format."""

    target: Pattern | None = Field(default=None, alias="as")
    unit: AnyUnit | None = None
    zero: Small = 0.0
    scale: Factor = 1.0
    flip: bool = False
    late: Small = 0.0


class ControllerTable(Table):
    """The drive's controller."""

    gain_per_rad: Small | None = None
    law: Literal["duty"] | None = None
    torque_off_bridge: Literal["open", "shorted"] | None = None


class SupplyTable(Table):
    """The drive's supply."""

    voltage: Voltage | None = None
    column: str | None = None
    unit: Annotated[str, AfterValidator(partial(_unit, "voltage"))] = "V"


class KeepTable(Table):
    """Columns that are kept and not interpreted."""

    columns: Names = ()


Constants = dict[str, QuantityTable]


class LogTable(Table):
    """What holds for some of the logs only."""

    match: Text
    gain_per_rad: Small | None = None
    condition: dict[str, Annotated[str | float, BeforeValidator(_text_or_number)]] = Field(
        default_factory=dict
    )
    constants: Constants = Field(default_factory=dict)


class MappingTable(Table):
    """The whole file."""

    effort: Annotated[str, AfterValidator(_channel)] | None = None
    locked: Names = ()
    csv: CsvTable = CsvTable()
    time: TimeTable = TimeTable()
    columns: dict[str, ColumnTable] = Field(default_factory=dict)
    joints: dict[str, str] = Field(default_factory=dict)
    torque_enabled: dict[str, str] = Field(default_factory=dict)
    gear_ratio: dict[str, Factor] = Field(default_factory=dict)
    controller: ControllerTable = ControllerTable()
    supply: SupplyTable = SupplyTable()
    constants: Constants = Field(default_factory=dict)
    keep: KeepTable = KeepTable()
    logs: Annotated[tuple[LogTable, ...], Strict(False), BeforeValidator(_listed)] = ()

    @model_validator(mode="after")
    def _stars(self) -> Self:
        for name, column in self.columns.items():
            _one_star(name)
            if column.target is not None and "*" in column.target and "*" not in name:
                raise ValueError(f"columns.{name}: as = '{column.target}' has a star, it has none")
        return self
