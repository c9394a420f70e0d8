"""Which column of a file goes where, decided from its header alone, and what is missing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from actuators.errors import LegwattError, closest, one_line
from actuators.units import dimension
from pipeline.logs.formats import Source, open_source
from pipeline.logs.log_format import (
    EFFORTS,
    JOINT_COLUMNS,
    TIME,
    Expected,
    Target,
    column_name,
    misspelt,
    parse_column,
    plotted,
    suggest_column,
)
from pipeline.logs.mapping import ColumnTable, LogTable, Mapping

POSITIONS: Final = ("position", "motor_position")
AS_NAMED: Final = ColumnTable()


@dataclass(frozen=True)
class ReadingPlan:
    """Which column of a file goes where; made from its header alone."""

    source: Source  #: The open file.
    expected: Expected  #: The robot's names and limits.
    mapping: Mapping  #: The mapping.
    rule: LogTable  #: What holds for this log.
    #: Target to column of the file and the mapping's rule for it.
    sources: dict[Target, tuple[str, ColumnTable]]
    ignored: tuple[str, ...]  #: Columns that mean nothing to the log format.
    misspelt: dict[str, str]  #: Those among them that are nearly one of it, and that one.

    @property
    def quantities(self) -> set[str]:
        """Quantities that the file has of anything."""
        return {t.quantity for t in self.sources}

    @property
    def channel(self) -> str:
        """The effort channel that is compared, as far as mapping and header say."""
        return self.mapping.effort or next((c for c in EFFORTS if c in self.quantities), "voltage")

    @property
    def columns(self) -> list[str]:
        """Columns to read from the file."""
        wanted = [column for column, _ in self.sources.values()]
        wanted += self.mapping.torque_enabled.values()
        wanted += [self.mapping.supply.column] if self.mapping.supply.column else []
        return list(dict.fromkeys(wanted))

    @property
    def derives_voltage(self) -> bool:
        """Whether voltage follows from the servo's law, goals and supply."""
        supply = self.mapping.supply
        return (
            self.mapping.controller.law == "duty"
            and self.rule.gain_per_rad is not None
            and (supply.column is not None or supply.voltage is not None)
            and all(self.has(joint, "goal_position") for joint in self.expected.joints)
        )

    @property
    def derives_torque(self) -> bool:
        """Whether torque follows from the servos' law, targets and gains."""
        efforts = self.quantities & {*EFFORTS}
        return (
            self.mapping.pd_gains is not None
            and "torque" not in efforts
            and (not efforts or self.mapping.effort == "torque")
            and "goal_position" in self.quantities
        )

    @property
    def of_supply(self) -> bool:
        """Whether the file tells the supply's power or current."""
        return bool(self.quantities & {"supply_power", "supply_current"})

    @property
    def supply_alone(self) -> bool:
        """Whether that is all that it tells of effort."""
        told = self.quantities & {*EFFORTS} or self.derives_torque or self.derives_voltage
        return self.of_supply and not told

    def has(self, owner: str, *quantities: str) -> bool:
        """Whether the file has one of some quantities of a joint."""
        return any(t.owner == owner and t.quantity in quantities for t in self.sources)

    def strangers(self, *quantities: str) -> bool:
        """Whether unused columns say one of these quantities of something that is no joint."""
        suffixes = {s for s, (q, _) in JOINT_COLUMNS.items() if q in quantities}
        return any(c.rpartition("__")[2] in suffixes for c in self.ignored)


def plan_reading(path: Path, expected: Expected, mapping: Mapping | None = None) -> ReadingPlan:
    """Decide from the header which column goes where.

    A LegwattError where columns are missing, occur twice after mapping, or belong to another robot.
    """
    mapping = mapping or Mapping()
    table = open_source(path, mapping.csv)
    sources: dict[Target, tuple[str, ColumnTable]] = {}
    ignored: dict[str, str] = {}
    first: dict[str, tuple[str, str]] = {}  # pattern to the first column it matches, and its name
    useful: set[str] = set()
    for column in table.header:
        pattern, rule, own = _rule(column, mapping)
        if not pattern and own == column and plotted(column) not in table.header:
            own = plotted(column)
        owner, separator, quantity = own.rpartition("__")
        name = f"{mapping.joints.get(owner, owner)}{separator}{quantity}"
        first.setdefault(pattern, (column, name))
        target = parse_column(name, expected, table.where)
        if target is None:
            if pattern in mapping.columns and "*" not in pattern:
                raise _unknown(column, name, expected, mapping)
            ignored[column] = name
            continue
        if target in sources:
            raise LegwattError(
                f"{table.where}: '{one_line(column)}' and '{one_line(sources[target][0])}' "
                "both give the same channel; keep one"
            )
        rule = _in_unit(rule, table, column, own, target)
        if rule.unit not in (None, "1", target.unit):
            found, wanted = dimension(str(rule.unit)), dimension(target.unit)
            if found != wanted:
                raise LegwattError(
                    f"{mapping.where}: columns '{one_line(pattern)}': '{rule.unit}' is a unit of "
                    f"{found}, {target.quantity} needs one of {wanted}"
                )
        sources[target] = column, rule
        useful.add(pattern)
    for pattern in mapping.columns:
        if pattern not in first:
            raise LegwattError(
                f"{mapping.where}: no column of {table.where} matches '{one_line(pattern)}'; "
                f"{suggest_column(pattern, table.header)}"
            )
        if pattern not in useful:
            raise _unknown(*first[pattern], expected, mapping)
    near = {
        column: meant
        for column, name in ignored.items()
        if column not in mapping.keep.columns and (meant := misspelt(name, expected))
    }
    rule_of_log = mapping.rule_for(path)
    plan = ReadingPlan(table, expected, mapping, rule_of_log, sources, tuple(ignored), near)
    # A slip of the pen that costs a channel would be left out without a word.
    for column, meant in plan.misspelt.items():
        if parse_column(meant, plan.expected, plan.source.where) not in plan.sources:
            raise LegwattError(
                f"{plan.source.where}: column '{one_line(column)}' is none of the log format and "
                f"would be ignored; did you mean '{meant}'? Rename it, or list it under keep in a "
                "mapping file"
            )
    _check_names(plan)
    where, rate = plan.source.where, plan.mapping.time.sample_rate
    has_time = plan.has("", "time")
    if not has_time and rate is None:
        raise LegwattError(
            f"{where}: no column {TIME}; {suggest_column(TIME, plan.source.header)}; or give "
            "sample_rate in a mapping file"
        )
    if has_time and rate is not None:
        raise LegwattError(
            f"{plan.mapping.where}: sample_rate is given and {where} has a column {TIME}; drop one"
        )
    _check_positions(plan)
    _check_efforts(plan)
    return plan


def _rule(column: str, mapping: Mapping) -> tuple[str, ColumnTable, str]:
    """Pattern and rule for a column, and its name in the log format, joints as the log has them."""
    in_unit = ColumnTable(unit=mapping.time.unit)
    if mapping.time.column == column:
        return "", in_unit, TIME
    found = "", AS_NAMED, column
    for pattern, rule in mapping.columns.items():
        name = rule.renamed(pattern, column)
        # A rule for one column outranks a pattern.
        if name is not None and (not found[0] or "*" not in pattern):
            found = pattern, rule, name
    if found[2] == TIME and not found[0]:
        return "", in_unit, TIME
    return found


def _in_unit(
    rule: ColumnTable, table: Source, column: str, name: str, target: Target
) -> ColumnTable:
    """The rule with the unit that the file's own row of units states, where the rule has none."""
    stated = table.units.get(column)
    if stated is None or rule.unit is not None or dimension(stated) != dimension(target.unit):
        return rule
    if column == name and stated != target.unit:
        raise LegwattError(
            f"{table.where}: column '{one_line(column)}' is in '{stated}' by the row of units, and "
            "in another by its name; rename it, or give its unit in a mapping file"
        )
    return rule.model_copy(update={"unit": stated})


def _unknown(column: str, name: str, expected: Expected, mapping: Mapping) -> LegwattError:
    known = [TIME, *(f"{j}__{suffix}" for j in expected.joints for suffix in JOINT_COLUMNS)]
    return LegwattError(
        f"{mapping.where}: column '{one_line(column)}' becomes '{one_line(name)}', which the log "
        f"format does not know; {closest(name, known)}"
    )


def _check_names(plan: ReadingPlan) -> None:
    """Refuse a name of the mapping that neither the file nor the robot has."""
    table, expected, mapping = plan.source, plan.expected, plan.mapping
    owners = {_rule(column, mapping)[2].rpartition("__")[0] for column in table.header} - {""}
    for name in mapping.joints:
        if name not in owners:
            raise LegwattError(
                f"{mapping.where}: joints: no column of {table.where} is of '{one_line(name)}'; "
                f"{closest(name, sorted(owners))}"
            )
    for name in plan.rule.constants:
        known = parse_column(name, expected, f"{mapping.where}: constants")
        if not known and (meant := misspelt(name, expected)):
            raise LegwattError(
                f"{mapping.where}: constants: '{one_line(name)}' is none of the log format; did "
                f"you mean '{meant}'?"
            )
    for what, column in (
        ("time", mapping.time.column),
        *((f"torque_enabled.{j}", c) for j, c in mapping.torque_enabled.items()),
        *(("keep", c) for c in mapping.keep.columns),
        ("supply", mapping.supply.column),
    ):
        if column is not None and column not in table.header:
            raise LegwattError(
                f"{mapping.where}: {what}: column '{one_line(column)}' is not in {table.where}; "
                f"{suggest_column(column, table.header)}"
            )
    if mapping.pd_gains is not None:
        try:
            mapping.pd_gains.by_joint(expected.joints)
        except ValueError as error:
            raise LegwattError(f"{mapping.where}: {error}") from None
    named = (*mapping.torque_enabled, *mapping.locked, *mapping.joints.values())
    for joint in (*named, *mapping.gear_ratio):
        if joint not in expected.joints:
            raise LegwattError(
                f"{mapping.where}: '{one_line(joint)}' is no joint of {expected.robot}; "
                f"{closest(joint, expected.joints)}"
            )


def _check_positions(plan: ReadingPlan) -> None:
    """At least one joint with a position, and none whose columns may hide under another name."""
    table, expected, where = plan.source, plan.expected, plan.source.where
    without = [j for j in expected.joints if not plan.has(j, *POSITIONS)]
    if len(without) == len(expected.joints):
        owners = {c.rpartition("__")[0] for c in table.header if "__position" in c}
        seen = one_line(", ".join(sorted(owners)) or ", ".join(table.header))
        raise LegwattError(
            f"{where}: none of the {len(expected.joints)} joints of {expected.robot} "
            f"('{expected.joints[0]}', ...) has a position; the log of another robot? "
            f"It has: {seen}"
        )
    for joint in without:
        wanted = column_name(joint, "position")
        hidden = plan.has(joint, *EFFORTS) or plan.strangers(*POSITIONS)
        if hidden and wanted not in plan.rule.constants:
            raise LegwattError(
                f"{where}: joint '{joint}' has no column '{wanted}'; "
                f"{suggest_column(wanted, table.header)}"
            )


def _check_efforts(plan: ReadingPlan) -> None:
    """At least one effort channel, and each for all joints or none."""
    where, mapping = plan.source.where, plan.mapping
    open_ = [j for j in plan.expected.joints if j not in mapping.locked]
    found = [c for c in EFFORTS if any(plan.has(j, c) for j in open_)]
    for channel in (c for c in found if plan.strangers(c)):
        for joint in open_:
            if plan.has(joint, *POSITIONS) and not plan.has(joint, channel):
                column = column_name(joint, channel)
                raise LegwattError(
                    f"{where}: joint '{joint}' has no {channel} '{column}', other joints have; "
                    f"{suggest_column(column, plan.source.header)}; log it, or list the joint "
                    "under locked in a mapping file"
                )
    if not found and plan.derives_voltage:
        found = ["voltage"]
    if plan.derives_torque:
        found = ["torque", *found]
    if plan.supply_alone:
        return
    if not found:
        columns = ", ".join(column_name(plan.expected.joints[0], c) for c in EFFORTS)
        goals = "goal_position" in plan.quantities
        hint = "; or give the servos' gains under [pd_gains] in a mapping file" if goals else ""
        raise LegwattError(
            f"{where}: no effort channel; at least one of {columns} must be there{hint}"
        )
    if mapping.effort is not None and mapping.effort not in found:
        raise LegwattError(
            f"{mapping.where}: effort = '{mapping.effort}' is not in {where}; "
            f"{closest(mapping.effort, found)}"
        )
