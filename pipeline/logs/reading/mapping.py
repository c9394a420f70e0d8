"""The mapping file: how a foreign log's columns become those of the log format.

All tables are optional::

    effort = "voltage"                      # channel to compare
    locked = ["joint_4"]                    # joints that stood still on purpose

    [csv]
    delimiter = ";"
    decimal = ","

    [time]
    column = "t"                            # default time_s
    unit = "ms"
    sample_rate = {value = 500, unit = "Hz"}  # instead of a column

    [columns."enc_*"]                       # a star stands for any text, the same on both sides
    as = "*__position_rad"
    unit = "deg"                            # of the file; default that of the log format
    zero = 12.5                             # subtracted, in the file's unit
    scale = 1.0                             # dimensionless; with unit = "1" it brings to SI
    flip = true                             # the file's positive sense is the joint's negative

    [joints]                                # the log's name of a joint = the robot's name
    shoulder = "joint_1"

    [torque_enabled]                        # column that is zero where the drive is off
    joint_1 = "torque_on"

    [controller]
    gain_per_rad = 0.29                     # duty per position error
    law = "duty"                            # computes voltage where there is none
    torque_off_bridge = "open"              # or "shorted"; what the bridge does with the drive off

    [supply]
    voltage = {value = 24, unit = "V"}      # or column = "supply_voltage_V"

    [constants.ambient]
    value = 21
    unit = "degC"

    [keep]
    columns = ["load_raw"]

    [[logs]]                                # what holds for some of the logs only
    match = "*_kp100_*"
    gain_per_rad = 0.29
    condition = {gain = 100}
"""

from __future__ import annotations

import math
from collections.abc import Mapping as MappingType
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Final

from actuators.errors import UnitError, closest, one_line
from actuators.text_file import UnreadableTextError, read_toml_file
from actuators.units import dimension, from_si, to_si
from pipeline.logs.errors import MappingError
from pipeline.logs.reading.log import EFFORTS
from pipeline.logs.reading.table_file import CsvDialect

_TOP: Final = (
    *("effort", "locked", "csv", "time", "columns", "joints", "torque_enabled", "controller"),
    *("supply", "constants", "keep", "logs"),
)
_COLUMN: Final = ("as", "unit", "zero", "scale", "flip")
_BRIDGES: Final = ("open", "shorted")


@dataclass(frozen=True)
class ColumnRule:
    """How one column, or all that match a pattern, become a column of the log format.

    Attributes:
        pattern: Column of the file; one star stands for any text.
        target: Column of the log format; a star takes the same text.
        unit: Of the file; None for the log format's own.
        zero: Subtracted, in the file's unit.
        scale: Dimensionless factor, sign included.
    """

    pattern: str
    target: str
    unit: str | None = None
    zero: float = 0.0
    scale: float = 1.0

    def matched(self, column: str) -> str | None:
        """The column of the log format a column of the file becomes, or None."""
        if "*" not in self.pattern:
            return self.target if column == self.pattern else None
        head, tail = self.pattern.split("*", 1)
        if len(column) < len(head) + len(tail) or not (
            column.startswith(head) and column.endswith(tail)
        ):
            return None
        return self.target.replace("*", column[len(head) : len(column) - len(tail)])

    def affine(self, target_unit: str) -> tuple[float, float]:
        """Factor and offset that bring the file's numbers into the log's unit."""
        if self.unit in (None, "1", target_unit):
            factor, offset = 1.0, 0.0
        else:
            offset = from_si(to_si(0.0, str(self.unit)), target_unit)
            factor = from_si(to_si(1.0, str(self.unit)), target_unit) - offset
        return self.scale * factor, self.scale * (offset - factor * self.zero)


@dataclass(frozen=True)
class LogRule:
    """What holds for the logs whose file name matches."""

    match: str
    gain: float | None
    condition: MappingType[str, float | str]
    constants: MappingType[str, float]


@dataclass(frozen=True)
class Mapping:
    """A mapping file after loading; see the module's text for its keys."""

    where: str = "mapping"
    effort: str | None = None
    locked: tuple[str, ...] = ()
    dialect: CsvDialect = field(default_factory=CsvDialect)
    time_column: str | None = None
    time_unit: str = "s"
    sample_rate: float | None = None
    columns: tuple[ColumnRule, ...] = ()
    joints: MappingType[str, str] = field(default_factory=dict)
    torque_enabled: MappingType[str, str] = field(default_factory=dict)
    gain: float | None = None
    law: str | None = None
    torque_off_bridge: str | None = None
    supply_voltage: float | None = None
    supply_column: str | None = None
    supply_unit: str = "V"
    constants: MappingType[str, float] = field(default_factory=dict)
    keep: tuple[str, ...] = ()
    logs: tuple[LogRule, ...] = ()

    def rule_for(self, log_name: str) -> LogRule:
        """What holds for one log: its file's stem is matched against every `[[logs]]`."""
        gain, constants = self.gain, dict(self.constants)
        condition: dict[str, float | str] = {}
        for rule in self.logs:
            if fnmatchcase(log_name, rule.match):
                gain = rule.gain if rule.gain is not None else gain
                condition |= rule.condition
                constants |= rule.constants
        return LogRule(log_name, gain, condition, constants)


def load_mapping(path: Path) -> Mapping:
    """Load and check a mapping file.

    Raises:
        MappingError: Missing file, malformed TOML, unknown key or unit, wrong type; one line.
    """
    where = one_line(path.name)
    try:
        table = read_toml_file(path)
    except UnreadableTextError as error:
        raise MappingError(f"{where}: {error}; give a mapping file") from None
    return parse_mapping(table, where)


def parse_mapping(table: MappingType[str, Any], where: str) -> Mapping:
    """Check the contents of a mapping file.

    Raises:
        MappingError: Unknown key or unit, or a value of the wrong kind; one line.
    """
    top = _Table(table, where)
    top.only(_TOP)
    effort = top.text("effort")
    if effort is not None and effort not in EFFORTS:
        raise MappingError(f"{where}: effort = '{one_line(effort)}'; {closest(effort, [*EFFORTS])}")
    time = top.table("time")
    time.only(("column", "unit", "sample_rate"))
    unit = time.unit("unit", "time") or "s"
    rate = time.quantity("sample_rate", "frequency")
    if rate is not None and not 0 < rate < 1e9:
        raise MappingError(f"{time.where}: sample_rate must be positive and below 1 GHz")
    if rate is not None and time.text("column") is not None:
        raise MappingError(f"{time.where}: give column or sample_rate, not both")
    csv = top.table("csv")
    csv.only(("delimiter", "decimal"))
    delimiter, decimal = csv.text("delimiter") or ",", csv.text("decimal") or "."
    if delimiter not in (",", ";", "\t", " ", "|") or decimal not in (".", ","):
        raise MappingError(
            f"{csv.where}: delimiter must be one of , ; tab space | and decimal . or ,"
        )
    if delimiter == decimal:
        raise MappingError(f"{csv.where}: delimiter and decimal are both '{decimal}'")
    controller = top.table("controller")
    controller.only(("gain_per_rad", "law", "torque_off_bridge"))
    bridge = controller.text("torque_off_bridge")
    if bridge is not None and bridge not in _BRIDGES:
        raise MappingError(
            f"{controller.where}: torque_off_bridge = '{one_line(bridge)}'; "
            f"{closest(bridge, _BRIDGES)}"
        )
    law = controller.text("law")
    if law not in (None, "duty"):
        raise MappingError(f"{controller.where}: law = '{one_line(law)}'; known: duty")
    supply = top.table("supply")
    supply.only(("voltage", "column", "unit"))
    keep = top.table("keep")
    keep.only(("columns",))
    columns = top.table("columns")
    return Mapping(
        where=where,
        effort=effort,
        locked=top.texts("locked"),
        dialect=CsvDialect(delimiter, decimal),
        time_column=time.text("column"),
        time_unit=unit,
        sample_rate=rate,
        columns=tuple(_column(key, columns.table(key)) for key in columns.values),
        joints=top.table("joints").all_texts(),
        torque_enabled=top.table("torque_enabled").all_texts(),
        gain=controller.number("gain_per_rad"),
        law=law,
        torque_off_bridge=bridge,
        supply_voltage=supply.quantity("voltage", "voltage"),
        supply_column=supply.text("column"),
        supply_unit=supply.unit("unit", "voltage") or "V",
        constants=_constants(top.table("constants")),
        keep=keep.texts("columns"),
        logs=_logs(top),
    )


def _column(pattern: str, table: _Table) -> ColumnRule:
    table.only(_COLUMN)
    target = table.text("as") or pattern
    if pattern.count("*") > 1 or target.count("*") != min(1, target.count("*")):
        raise MappingError(f"{table.where}: at most one star in a pattern")
    if "*" in target and "*" not in pattern:
        raise MappingError(f"{table.where}: as = '{one_line(target)}' has a star, the column none")
    unit = table.unit("unit", None)
    scale = table.number("scale")
    scale = 1.0 if scale is None else scale
    if scale == 0:
        raise MappingError(f"{table.where}: scale must not be zero")
    flip = table.truth("flip")
    return ColumnRule(pattern, target, unit, table.number("zero") or 0.0, -scale if flip else scale)


def _constants(table: _Table) -> dict[str, float]:
    out = {}
    for key in table.values:
        value = table.quantity(key, None)
        assert value is not None
        out[key] = value
    return out


def _logs(top: _Table) -> tuple[LogRule, ...]:
    entries = top.values.get("logs", [])
    if not isinstance(entries, list):
        raise MappingError(f"{top.where}: write [[logs]] with two brackets")
    rules = []
    for k, entry in enumerate(entries, start=1):
        if not isinstance(entry, dict):
            raise MappingError(f"{top.where}: write [[logs]] with two brackets")
        table = _Table(entry, f"{top.where}: logs {k}")
        table.only(("match", "gain_per_rad", "condition", "constants"))
        match = table.text("match")
        if match is None:
            raise MappingError(f"{table.where}: match is missing; give a pattern of file names")
        condition = table.table("condition")
        for key, value in condition.values.items():
            if not isinstance(value, str):
                condition.number(key)
        rules.append(
            LogRule(
                match,
                table.number("gain_per_rad"),
                {k: v if isinstance(v, str) else float(v) for k, v in condition.values.items()},
                _constants(table.table("constants")),
            )
        )
    return tuple(rules)


class _Table:
    """A TOML table whose getters check kind and unit."""

    def __init__(self, values: MappingType[str, Any], where: str) -> None:
        self.values = values
        self.where = where

    def only(self, known: tuple[str, ...]) -> None:
        for key in self.values:
            if key not in known:
                raise MappingError(
                    f"{self.where}: unknown key '{one_line(key)}'; {closest(key, known)}"
                )

    def table(self, key: str) -> _Table:
        value = self.values.get(key, {})
        if not isinstance(value, dict):
            raise MappingError(f"{self.where}: [{one_line(key)}] must be a table")
        return _Table(value, f"{self.where}: {one_line(key)}")

    def text(self, key: str) -> str | None:
        value = self.values.get(key)
        if value is not None and not isinstance(value, str):
            raise MappingError(f"{self.where}: {one_line(key)} must be text in quotation marks")
        return value

    def texts(self, key: str) -> tuple[str, ...]:
        value = self.values.get(key, [])
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise MappingError(f"{self.where}: {one_line(key)} must be a list of names")
        return tuple(value)

    def all_texts(self) -> dict[str, str]:
        return {key: self.text(key) or "" for key in self.values}

    def truth(self, key: str) -> bool:
        value = self.values.get(key, False)
        if not isinstance(value, bool):
            raise MappingError(f"{self.where}: {one_line(key)} must be true or false")
        return value

    def number(self, key: str) -> float | None:
        value = self.values.get(key)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise MappingError(f"{self.where}: {one_line(key)} must be a number")
        if not math.isfinite(value) or abs(value) > 1e12:
            raise MappingError(f"{self.where}: {one_line(key)} must be a finite number below 1e12")
        return float(value)

    def unit(self, key: str, expected: str | None) -> str | None:
        unit = self.text(key)
        if unit is None:
            return None
        try:
            found = dimension(unit)
        except UnitError as error:
            raise MappingError(f"{self.where}: {one_line(error)}") from None
        if expected is not None and found != expected:
            raise MappingError(f"{self.where}: '{unit}' is a unit of {found}, expected {expected}")
        return unit

    def quantity(self, key: str, expected: str | None) -> float | None:
        if key not in self.values:
            return None
        table = self.table(key)
        table.only(("value", "unit"))
        value, unit = table.number("value"), table.unit("unit", expected)
        if value is None or unit is None:
            raise MappingError(f"{table.where}: write {{value = ..., unit = ...}}")
        return to_si(value, unit)
