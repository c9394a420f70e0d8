"""The mapping file: how a foreign log's columns become those of the log format.

All tables are optional; the README of `pipeline/logs` shows every key.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from collections.abc import Mapping as MappingType
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, PrivateAttr, Strict, model_validator

from actuators.checked import Names, Number, Table, Text, checked, finite, read_toml
from actuators.errors import LegwattError, closest, one_line
from actuators.units import dimension, from_si, to_si
from pipeline.logs.log_format import BASE_COLUMNS, EFFORTS, JOINT_COLUMNS
from pipeline.logs.reading.servo_law import PdGains

#: Beyond these a number is a slip, and some product of it overflows.
LARGEST = 1e12
_TOO_LARGE = f"must be a finite number below {LARGEST:g}"


def _must(holds: Callable[[Any], bool], words: str) -> AfterValidator:
    """A rule for a value, and what is said where it does not hold."""

    def check(value: Any) -> Any:
        if not holds(value):
            raise ValueError(words)
        return value

    return AfterValidator(check)


def _unit(expected: str | None, unit: str) -> str:
    """A known unit, of one dimension where one is expected."""
    try:
        found = dimension(unit)
    except LegwattError as error:
        raise ValueError(str(error)) from None
    if expected is not None and found != expected:
        raise ValueError(f"'{unit}' is a unit of {found}, expected {expected}")
    return unit


def _channel(name: str) -> str:
    if name not in EFFORTS:
        raise ValueError(f"= '{one_line(name)}': {closest(name, list(EFFORTS))}")
    return name


def _text_or_number(value: object) -> str | float:
    if not isinstance(value, str) and abs(finite(value)) > LARGEST:
        raise ValueError(_TOO_LARGE)
    return value if isinstance(value, str) else finite(value)


Small = Annotated[Number, _must(lambda x: abs(x) <= LARGEST, _TOO_LARGE)]
Factor = Annotated[Small, _must(lambda x: x != 0.0, "must not be zero")]
AnyUnit = Annotated[str, AfterValidator(partial(_unit, None))]
VoltageUnit = Annotated[str, AfterValidator(partial(_unit, "voltage"))]
TimeUnit = Annotated[str, AfterValidator(partial(_unit, "time"))]
Pattern = Annotated[Text, _must(lambda x: x.count("*") <= 1, "at most one star in a pattern")]
Delimiter = Annotated[
    str, _must(lambda x: x in (",", ";", "\t", " ", "|"), "must be one of , ; tab space |")
]


class QuantityTable(Table):
    """A number with its unit."""

    value: Small
    unit: AnyUnit

    @property
    def si(self) -> float:
        """The number in SI units."""
        return to_si(self.value, self.unit)


def _of(expected: str, quantity: QuantityTable) -> QuantityTable:
    _unit(expected, quantity.unit)
    return quantity


Voltage = Annotated[
    QuantityTable,
    AfterValidator(partial(_of, "voltage")),
    _must(lambda q: q.si > 0, "must be positive"),
]
Rate = Annotated[
    QuantityTable,
    AfterValidator(partial(_of, "frequency")),
    _must(lambda q: 0 < q.si < 1e9, "must be positive and below 1 GHz"),
]


class CsvTable(Table):
    """How the file separates its columns and its decimals."""

    delimiter: Delimiter = ","
    decimal: Literal[".", ","] = "."

    @model_validator(mode="after")
    def _differ(self) -> Self:
        if self.delimiter == self.decimal:
            raise ValueError(f"delimiter and decimal are both '{self.decimal}'")
        return self


class TimeTable(Table):
    """Where time comes from."""

    column: str | None = None
    unit: TimeUnit = "s"
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

    def renamed(self, pattern: str, column: str) -> str | None:
        """The column of the log format a column of the file becomes, or None."""
        target = self.target or pattern
        if "*" not in pattern:
            return target if column == pattern else None
        head, tail = pattern.split("*", 1)
        if len(column) < len(head) + len(tail) or not (
            column.startswith(head) and column.endswith(tail)
        ):
            return None
        return target.replace("*", column[len(head) : len(column) - len(tail)])

    def affine(self, target_unit: str) -> tuple[float, float]:
        """Factor and offset that bring the file's numbers into the log's unit."""
        factor, offset = 1.0, 0.0
        if self.unit not in (None, "1", target_unit):
            offset = from_si(to_si(0.0, str(self.unit)), target_unit)
            factor = from_si(to_si(1.0, str(self.unit)), target_unit) - offset
        scale = -self.scale if self.flip else self.scale
        return scale * factor, scale * (offset - factor * self.zero)


class ControllerTable(Table):
    """The drive's controller."""

    gain_per_rad: Small | None = None
    law: Literal["duty"] | None = None
    torque_off_bridge: Literal["open", "shorted"] | None = None


class SupplyTable(Table):
    """The drive's supply."""

    voltage: Voltage | None = None
    column: str | None = None
    unit: VoltageUnit = "V"


class KeepTable(Table):
    """Columns that are kept and not interpreted."""

    columns: Names = ()


def _constants(table: dict[str, QuantityTable]) -> dict[str, QuantityTable]:
    """A constant that stands for a column has that column's dimension."""
    for name, quantity in table.items():
        _, unit = (JOINT_COLUMNS | BASE_COLUMNS).get(name.rpartition("__")[2], ("", quantity.unit))
        found, expected = dimension(quantity.unit), dimension(unit)
        if found != expected:
            raise ValueError(
                f"'constants.{one_line(name)}.unit': '{quantity.unit}' is a unit of {found}, "
                f"expected {expected}"
            )
    return table


class LogTable(Table):
    """What holds for some of the logs only."""

    match: Text
    gain_per_rad: Small | None = None
    condition: dict[str, Annotated[str | float, BeforeValidator(_text_or_number)]] = Field(
        default_factory=dict
    )
    constants: dict[str, QuantityTable] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _dimensions(self) -> Self:
        _constants(self.constants)
        return self

    def names(self, path: Path) -> bool:
        """Whether a log's file, with or without its ending, is one of those it holds for."""
        return any(fnmatchcase(name, self.match) for name in (path.stem, path.name))


_LISTED = BeforeValidator(
    _must(lambda x: isinstance(x, list), "must be written [[logs]] with two brackets").func
)


class Mapping(Table):
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
    pd_gains: PdGains | None = None
    supply: SupplyTable = SupplyTable()
    constants: dict[str, QuantityTable] = Field(default_factory=dict)
    keep: KeepTable = KeepTable()
    logs: Annotated[tuple[LogTable, ...], Strict(False), _LISTED] = ()
    _where: str = PrivateAttr("mapping")

    @model_validator(mode="after")
    def _stars(self) -> Self:
        for name, column in self.columns.items():
            if name.count("*") > 1:
                raise ValueError("at most one star in a pattern")
            if column.target is not None and "*" in column.target and "*" not in name:
                raise ValueError(f"columns.{name}: as = '{column.target}' has a star, it has none")
        _constants(self.constants)
        return self

    @property
    def where(self) -> str:
        """The file's name, for messages."""
        return self._where

    def rule_for(self, path: Path) -> LogTable:
        """What holds for one log: its file's name is matched against every `[[logs]]`."""
        gain, constants = self.controller.gain_per_rad, dict(self.constants)
        condition: dict[str, float | str] = {}
        for rule in self.logs:
            if rule.names(path):
                gain = rule.gain_per_rad if rule.gain_per_rad is not None else gain
                condition |= rule.condition
                constants |= rule.constants
        return LogTable.model_construct(
            match=path.stem, gain_per_rad=gain, condition=condition, constants=constants
        )

    def refuse_unknown_logs(self, paths: Sequence[Path]) -> None:
        """Refuse a `[[logs]]` that names no log where one of the logs is named by none.

        Files beside the logs count as known, too.

        Raises:
            LegwattError: Names the entry, and the closest log.
        """
        unnamed = [p for p in paths if not any(rule.names(p) for rule in self.logs)]
        known = {*paths, *(p for folder in {p.parent for p in paths} for p in folder.iterdir())}
        for count, rule in enumerate(self.logs, start=1):
            if unnamed and not any(rule.names(path) for path in known):
                hint = closest(rule.match.strip("*?"), sorted(path.stem for path in unnamed))
                raise LegwattError(
                    f"{self.where}: logs {count}: match = '{one_line(rule.match)}' names no log; "
                    f"{hint}"
                )


def load_mapping(path: Path) -> Mapping:
    """Load and check a mapping file.

    Raises:
        LegwattError: Missing file, malformed TOML, unknown key or unit, wrong type; one line.
    """
    try:
        table = read_toml(path)
    except LegwattError as error:
        raise LegwattError(f"{error}; give a mapping file") from None
    return parse_mapping(table, one_line(path.name))


def parse_mapping(table: MappingType[str, Any], where: str) -> Mapping:
    """Check the contents of a mapping file.

    Raises:
        LegwattError: Unknown key or unit, or a value of the wrong kind; one line.
    """
    mapping = checked(Mapping, table, where)
    mapping._where = where
    return mapping
