"""Which column of a file goes where, decided from its header alone, and what is missing."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from actuators.errors import UnitError, closest, one_line
from actuators.units import dimension
from pipeline.logs.errors import GapError, LogFormatError, WrongRobotError
from pipeline.logs.reading.expected import Expected
from pipeline.logs.reading.log import EFFORTS
from pipeline.logs.reading.log_format import (
    JOINT_COLUMNS,
    TIME,
    Target,
    misspelt,
    parse_column,
    suggest_column,
)
from pipeline.logs.reading.mapping import ColumnRule, LogRule, Mapping
from pipeline.logs.reading.table_file import TableFile, open_table

POSITIONS: Final = ("position", "motor_position")
_IDENTITY: Final = ColumnRule("", "")


@dataclass(frozen=True)
class Source:
    """A column of the file, the affine map that brings it into the log's unit, and its rule."""

    column: str
    factor: float
    offset: float
    rule: ColumnRule


@dataclass(frozen=True)
class ReadingPlan:
    """Which column of a file goes where; made from its header alone.

    Attributes:
        table: The open file.
        expected: The robot's names and limits.
        mapping: The mapping.
        rule: What holds for this log.
        sources: Target to column.
        ignored: Columns that mean nothing to the log format.
        misspelt: Those among them that are nearly one of it, and that one.
    """

    table: TableFile
    expected: Expected
    mapping: Mapping
    rule: LogRule
    sources: dict[Target, Source]
    ignored: tuple[str, ...]
    misspelt: dict[str, str]

    @property
    def channel(self) -> str:
        """The effort channel that is compared, as far as mapping and header say."""
        have = {t.quantity for t in self.sources}
        return self.mapping.effort or next((c for c in EFFORTS if c in have), "voltage")

    @property
    def columns(self) -> list[str]:
        """Columns to read from the file."""
        wanted = [source.column for source in self.sources.values()]
        wanted += self.mapping.torque_enabled.values()
        wanted += self.mapping.keep
        if self.mapping.supply_column:
            wanted.append(self.mapping.supply_column)
        return list(dict.fromkeys(wanted))


def plan_reading(path: Path, expected: Expected, mapping: Mapping | None = None) -> ReadingPlan:
    """Decide from the header which column goes where.

    Raises:
        GapError: Columns are missing, occur twice after mapping, or belong to another robot.
    """
    mapping = mapping or Mapping()
    table = open_table(path, mapping.dialect)
    sources: dict[Target, Source] = {}
    ignored: dict[str, str] = {}
    used_rules: set[ColumnRule] = set()
    for column in table.header:
        rule, name = _resolve(column, mapping)
        used_rules.add(rule)
        target = parse_column(name, expected, table.where)
        if target is None:
            if rule is not _IDENTITY and "*" not in rule.pattern:
                raise GapError(
                    f"{mapping.where}: column '{one_line(column)}' becomes '{one_line(name)}', "
                    f"which the log format does not know; "
                    f"{closest(name, _known_columns(expected))}"
                )
            ignored[column] = name
            continue
        if target in sources:
            raise LogFormatError(
                f"{table.where}: '{one_line(column)}' and '{one_line(sources[target].column)}' "
                "both give the same channel; keep one"
            )
        _check_unit(rule, target, mapping.where)
        sources[target] = Source(column, *rule.affine(target.unit), rule)
    useful = {_resolve(source.column, mapping)[0] for source in sources.values()}
    for rule in mapping.columns:
        if rule in used_rules and rule not in useful:
            column = next(c for c in table.header if _resolve(c, mapping)[0] == rule)
            name = _resolve(column, mapping)[1]
            raise GapError(
                f"{mapping.where}: column '{one_line(column)}' becomes '{one_line(name)}', "
                f"which the log format does not know; {closest(name, _known_columns(expected))}"
            )
        if rule not in used_rules:
            raise GapError(
                f"{mapping.where}: no column of {table.where} matches '{one_line(rule.pattern)}'; "
                f"{suggest_column(rule.pattern, table.header)}"
            )
    near = {
        column: meant
        for column, name in ignored.items()
        if column not in mapping.keep and (meant := misspelt(name, expected))
    }
    plan = ReadingPlan(
        table, expected, mapping, mapping.rule_for(path), sources, tuple(ignored), near
    )
    _check_misspelt(plan)
    _check_names(plan)
    _check_columns(plan)
    return plan


def _check_names(plan: ReadingPlan) -> None:
    """Refuse a name of the mapping that neither the file nor the robot has."""
    table, expected, mapping = plan.table, plan.expected, plan.mapping
    owners = {_target(column, mapping)[1].rpartition("__")[0] for column in table.header} - {""}
    for name in mapping.joints:
        if name not in owners:
            raise GapError(
                f"{mapping.where}: joints: no column of {table.where} is of '{one_line(name)}'; "
                f"{closest(name, sorted(owners))}"
            )
    for name in plan.rule.constants:
        constant = parse_column(name, expected, f"{mapping.where}: constants")
        meant = "" if constant else misspelt(name, expected)
        if meant:
            raise GapError(
                f"{mapping.where}: constants: '{one_line(name)}' is none of the log format; did "
                f"you mean '{meant}'?"
            )
    for what, column in (
        ("time", mapping.time_column),
        *((f"torque_enabled.{j}", c) for j, c in mapping.torque_enabled.items()),
        *(("keep", c) for c in mapping.keep),
        ("supply", mapping.supply_column),
    ):
        if column is not None and column not in table.header:
            raise GapError(
                f"{mapping.where}: {what}: column '{one_line(column)}' is not in {table.where}; "
                f"{suggest_column(column, table.header)}"
            )
    named = (*mapping.torque_enabled, *mapping.locked, *mapping.joints.values(), *mapping.ratio)
    for joint in named:
        if joint not in expected.joints:
            raise GapError(
                f"{mapping.where}: '{one_line(joint)}' is no joint of {expected.robot}; "
                f"{closest(joint, expected.joints)}"
            )


def _check_misspelt(plan: ReadingPlan) -> None:
    """Refuse a slip of the pen that costs a channel: it would be left out without a word."""
    for column, meant in plan.misspelt.items():
        if parse_column(meant, plan.expected, plan.table.where) in plan.sources:
            continue
        raise LogFormatError(
            f"{plan.table.where}: column '{one_line(column)}' is none of the log format and would "
            f"be ignored; did you mean '{meant}'? Rename it, or list it under keep in a mapping "
            "file"
        )


def _known_columns(expected: Expected) -> list[str]:
    return [TIME, *(f"{j}__{suffix}" for j in expected.joints for suffix in JOINT_COLUMNS)]


def _resolve(column: str, mapping: Mapping) -> tuple[ColumnRule, str]:
    """The rule for a column and its name in the log format."""
    found, name = _target(column, mapping)
    owner, separator, quantity = name.rpartition("__")
    if separator and owner in mapping.joints:
        name = f"{mapping.joints[owner]}__{quantity}"
    return found, name


def _target(column: str, mapping: Mapping) -> tuple[ColumnRule, str]:
    """The same, its joint called as the log calls it."""
    if mapping.time_column == column:
        return ColumnRule(column, TIME, mapping.time_unit), TIME
    found, name = _IDENTITY, column
    for rule in mapping.columns:
        target = rule.matched(column)
        # A rule for one column outranks a pattern.
        if target is not None and (found is _IDENTITY or "*" not in rule.pattern):
            found, name = rule, target
    if name == TIME and found is _IDENTITY and mapping.time_unit != "s":
        found = ColumnRule(column, TIME, mapping.time_unit)
    return found, name


def _check_unit(rule: ColumnRule, target: Target, where: str) -> None:
    if rule.unit in (None, "1"):
        return
    try:
        found, wanted = dimension(str(rule.unit)), dimension(target.unit)
    except UnitError as error:
        raise GapError(f"{where}: {one_line(error)}") from None
    if found != wanted:
        raise GapError(
            f"{where}: columns '{one_line(rule.pattern)}': '{rule.unit}' is a unit of {found}, "
            f"{target.quantity} needs one of {wanted}"
        )


def _check_columns(plan: ReadingPlan) -> None:
    table, mapping = plan.table, plan.mapping
    where = table.where
    have = {(t.owner, t.quantity) for t in plan.sources}
    if ("", "time") not in have and mapping.sample_rate is None:
        raise LogFormatError(
            f"{where}: no column {TIME}; {suggest_column(TIME, table.header)}; or give "
            "sample_rate in a mapping file"
        )
    if ("", "time") in have and mapping.sample_rate is not None:
        raise LogFormatError(
            f"{mapping.where}: sample_rate is given and {where} has a column {TIME}; drop one"
        )
    _check_positions(plan, have)
    _check_efforts(plan, have)


def _check_positions(plan: ReadingPlan, have: set[tuple[str, str]]) -> None:
    """At least one joint with a position, and none whose columns may hide under another name."""
    table, expected = plan.table, plan.expected
    where = table.where
    sides = {j: {q for o, q in have if o == j and q in POSITIONS} for j in expected.joints}
    if not any(sides.values()):
        owners = {c.rpartition("__")[0] for c in table.header if "__position" in c}
        seen = one_line(", ".join(sorted(owners)) or ", ".join(table.header))
        raise WrongRobotError(
            f"{where}: none of the {len(expected.joints)} joints of {expected.robot} "
            f"('{expected.joints[0]}', ...) has a position; the log of another robot? "
            f"It has: {seen}"
        )
    for joint in expected.joints:
        if sides[joint] or f"{joint}__position_rad" in plan.rule.constants:
            continue
        measured = [c for c in EFFORTS if (joint, c) in have]
        if measured or _strangers(plan, POSITIONS):
            wanted = f"{joint}__position_rad"
            raise WrongRobotError(
                f"{where}: joint '{joint}' has no column '{wanted}'; "
                f"{suggest_column(wanted, table.header)}"
            )


def _strangers(plan: ReadingPlan, quantities: Collection[str]) -> list[str]:
    """Unused columns that say one of these quantities of something that is no joint."""
    suffixes = {s for s, (q, _) in JOINT_COLUMNS.items() if q in quantities}
    return [c for c in plan.ignored if c.rpartition("__")[2] in suffixes]


def _check_efforts(plan: ReadingPlan, have: set[tuple[str, str]]) -> None:
    """At least one effort channel, and each for all joints or none."""
    where, joints, mapping = plan.table.where, plan.expected.joints, plan.mapping
    found = [c for c in EFFORTS if any((j, c) in have for j in joints if j not in mapping.locked)]
    for channel in found:
        for joint in joints:
            if (
                (joint, channel) in have
                or joint in mapping.locked
                or (joint, "position")
                not in (have | {(j, "position") for j, q in have if q == "motor_position"})
            ):
                continue
            if _strangers(plan, (channel,)):
                column = next(
                    f"{joint}__{s}" for s, (q, _) in JOINT_COLUMNS.items() if q == channel
                )
                raise WrongRobotError(
                    f"{where}: joint '{joint}' has no {channel} '{column}', other joints have; "
                    f"{suggest_column(column, plan.table.header)}; log it, or list the joint "
                    "under locked in a mapping file"
                )
    if not found and derives_voltage(plan, have):
        found = ["voltage"]
    if not found:
        columns = [
            f"{joints[0]}__{suffix}"
            for suffix, (name, _) in JOINT_COLUMNS.items()
            if name in EFFORTS
        ]
        raise LogFormatError(
            f"{where}: no effort channel; at least one of {', '.join(columns)} must be there"
        )
    if mapping.effort is not None and mapping.effort not in found:
        raise LogFormatError(
            f"{mapping.where}: effort = '{mapping.effort}' is not in {where}; "
            f"{closest(mapping.effort, found)}"
        )


def derives_voltage(plan: ReadingPlan, have: set[tuple[str, str]]) -> bool:
    """Whether voltage follows from the servo's law, goals and supply."""
    mapping = plan.mapping
    return (
        mapping.law == "duty"
        and plan.rule.gain is not None
        and (mapping.supply_column is not None or mapping.supply_voltage is not None)
        and all((joint, "goal_position") in have for joint in plan.expected.joints)
    )
