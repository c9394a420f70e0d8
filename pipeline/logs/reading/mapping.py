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
    late = 0.05                             # by which the column comes late [s]

    [joints]                                # the log's name of a joint = the robot's name
    shoulder = "joint_1"

    [gear_ratio]                            # motor turns per joint turn, signed
    joint_1 = 100

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

from collections.abc import Mapping as MappingType
from collections.abc import Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from actuators.checked import checked
from actuators.errors import closest, one_line
from actuators.text_file import UnreadableTextError, read_toml_file
from actuators.units import dimension, from_si, to_si
from pipeline.logs.errors import MappingError
from pipeline.logs.reading.log_format import BASE_COLUMNS, JOINT_COLUMNS
from pipeline.logs.reading.mapping_schema import ColumnTable, Constants, MappingTable
from pipeline.logs.reading.table_file import CsvDialect


@dataclass(frozen=True)
class ColumnRule:
    """How one column, or all that match a pattern, become a column of the log format.

    Attributes:
        pattern: Column of the file; one star stands for any text.
        target: Column of the log format; a star takes the same text.
        unit: Of the file; None for the log format's own.
        zero: Subtracted, in the file's unit.
        scale: Dimensionless factor, sign included.
        late: By which the column comes late [s].
    """

    pattern: str
    target: str
    unit: str | None = None
    zero: float = 0.0
    scale: float = 1.0
    late: float = 0.0

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

    def names(self, path: Path) -> bool:
        """Whether a log's file, with or without its ending, is one of those it holds for."""
        return any(fnmatchcase(name, self.match) for name in (path.stem, path.name))


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
    ratio: MappingType[str, float] = field(default_factory=dict)

    def rule_for(self, path: Path) -> LogRule:
        """What holds for one log: its file's name is matched against every `[[logs]]`."""
        gain, constants = self.gain, dict(self.constants)
        condition: dict[str, float | str] = {}
        for rule in self.logs:
            if rule.names(path):
                gain = rule.gain if rule.gain is not None else gain
                condition |= rule.condition
                constants |= rule.constants
        return LogRule(path.stem, gain, condition, constants)

    def refuse_unknown_logs(self, paths: Sequence[Path]) -> None:
        """Refuse a `[[logs]]` that names no log where one of the logs is named by none.

        Args:
            paths: Of the logs that are read together; files beside them count as known, too.

        Raises:
            MappingError: Names the entry, and the closest log.
        """
        unnamed = [p for p in paths if not any(rule.names(p) for rule in self.logs)]
        known = {*paths, *(p for folder in {p.parent for p in paths} for p in folder.iterdir())}
        for count, rule in enumerate(self.logs, start=1):
            if unnamed and not any(rule.names(path) for path in known):
                hint = closest(rule.match.strip("*?"), sorted(path.stem for path in unnamed))
                raise MappingError(
                    f"{self.where}: logs {count}: match = '{one_line(rule.match)}' names no log; "
                    f"{hint}"
                )


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
    read = checked(MappingTable, table, where, MappingError)
    return Mapping(
        where=where,
        effort=read.effort,
        locked=read.locked,
        dialect=CsvDialect(read.csv.delimiter, read.csv.decimal),
        time_column=read.time.column,
        time_unit=read.time.unit,
        sample_rate=read.time.sample_rate.si if read.time.sample_rate else None,
        columns=tuple(_column(name, column) for name, column in read.columns.items()),
        joints=read.joints,
        torque_enabled=read.torque_enabled,
        gain=read.controller.gain_per_rad,
        law=read.controller.law,
        torque_off_bridge=read.controller.torque_off_bridge,
        supply_voltage=read.supply.voltage.si if read.supply.voltage else None,
        supply_column=read.supply.column,
        supply_unit=read.supply.unit,
        constants=_constants(read.constants, where),
        keep=read.keep.columns,
        logs=tuple(
            LogRule(log.match, log.gain_per_rad, log.condition, _constants(log.constants, where))
            for log in read.logs
        ),
        ratio=read.gear_ratio,
    )


def _column(pattern: str, table: ColumnTable) -> ColumnRule:
    scale = -table.scale if table.flip else table.scale
    return ColumnRule(pattern, table.target or pattern, table.unit, table.zero, scale, table.late)


def _constants(table: Constants, where: str) -> dict[str, float]:
    """Constants in SI units; one that stands for a column has that column's dimension."""
    for name, quantity in table.items():
        _, unit = (JOINT_COLUMNS | BASE_COLUMNS).get(name.rpartition("__")[2], ("", quantity.unit))
        found, expected = dimension(quantity.unit), dimension(unit)
        if found != expected:
            raise MappingError(
                f"{where}: 'constants.{one_line(name)}.unit': '{quantity.unit}' is a unit of "
                f"{found}, expected {expected}"
            )
    return {name: quantity.si for name, quantity in table.items()}
