"""Which column of a file goes where, decided from its header alone, and what is missing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from actuators.errors import LegwattError, known, one_line
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

    Raises:
        LegwattError: Columns are missing, occur twice after mapping, or belong to another robot.
    """
    mapping = mapping or Mapping()
    source = open_source(path, mapping.csv)
    sources: dict[Target, tuple[str, ColumnTable]] = {}
    ignored: dict[str, str] = {}
    matched: dict[str, tuple[str, str]] = {}  # pattern to the first column, and what it becomes
    useful: set[str] = set()
    for column in source.header:
        pattern, rule, own = _rule(column, mapping)
        if not pattern and own == column and plotted(column) not in source.header:
            own = plotted(column)
        owner, separator, quantity = own.rpartition("__")
        name = f"{mapping.joints.get(owner, owner)}{separator}{quantity}"
        matched.setdefault(pattern, (column, name))
        target = parse_column(name, expected, source.where)
        if target is None:
            ignored[column] = name
            continue
        if target in sources:
            raise LegwattError(
                f"{source.where}: '{one_line(column)}' and '{one_line(sources[target][0])}' "
                "both give the same channel; keep one"
            )
        rule = _in_unit(rule, source, column, own, target)
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
        if pattern not in matched:
            raise LegwattError(
                f"{mapping.where}: no column of {source.where} matches '{one_line(pattern)}'; "
                f"{suggest_column(pattern, source.header)}"
            )
        if pattern not in useful:
            column, name = matched[pattern]
            every = [TIME, *(f"{j}__{suffix}" for j in expected.joints for suffix in JOINT_COLUMNS)]
            what = f"column '{one_line(column)}' becomes no column of the log format:"
            known(what, name, every, mapping.where)
    near = {
        column: meant
        for column, name in ignored.items()
        if column not in mapping.keep.columns and (meant := misspelt(name, expected))
    }
    plan = ReadingPlan(
        source, expected, mapping, mapping.rule_for(path), sources, tuple(ignored), near
    )
    # A slip of the pen that costs a channel would be left out without a word.
    for column, meant in near.items():
        if parse_column(meant, expected, source.where) not in sources:
            raise LegwattError(
                f"{source.where}: column '{one_line(column)}' is none of the log format and "
                f"would be ignored; did you mean '{meant}'? Rename it, or list it under keep in a "
                "mapping file"
            )
    _check_names(plan)
    rate, has_time = mapping.time.sample_rate, plan.has("", "time")
    if has_time and rate is not None:
        raise LegwattError(
            f"{mapping.where}: sample_rate is given and {source.where} has {TIME}; drop one"
        )
    if not has_time and rate is None:
        raise LegwattError(
            f"{source.where}: no column {TIME}; {suggest_column(TIME, source.header)}; or give "
            "sample_rate in a mapping file"
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
    return ("", in_unit, TIME) if found[2] == TIME and not found[0] else found


def _in_unit(
    rule: ColumnTable, source: Source, column: str, name: str, target: Target
) -> ColumnTable:
    """The rule with the unit that the file's own row of units states, where the rule has none."""
    stated = source.units.get(column)
    if stated is None or rule.unit is not None or dimension(stated) != dimension(target.unit):
        return rule
    if column == name and stated != target.unit:
        raise LegwattError(
            f"{source.where}: column '{one_line(column)}' is in '{stated}' by the row of units, "
            "and in another by its name; rename it, or give its unit in a mapping file"
        )
    return rule.model_copy(update={"unit": stated})


def _check_names(plan: ReadingPlan) -> None:
    """Refuse a name of the mapping that neither the file nor the robot has."""
    source, expected, mapping = plan.source, plan.expected, plan.mapping
    owners = {_rule(column, mapping)[2].rpartition("__")[0] for column in source.header} - {""}
    for name in mapping.joints:
        known(f"joints: no column of {source.where} is of", name, sorted(owners), mapping.where)
    for name in plan.rule.constants:
        if not parse_column(name, expected, mapping.where) and (meant := misspelt(name, expected)):
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
        if column is not None:
            known(f"{what}: {source.where} has no column", column, source.header, mapping.where)
    if mapping.pd_gains is not None:
        try:
            mapping.pd_gains.arrays(expected.joints)
        except ValueError as error:
            raise LegwattError(f"{mapping.where}: {error}") from None
    named = (*mapping.torque_enabled, *mapping.locked, *mapping.joints.values())
    for joint in (*named, *mapping.gear_ratio):
        known(f"no joint of {expected.robot}:", joint, expected.joints, mapping.where)


def _check_positions(plan: ReadingPlan) -> None:
    """At least one joint with a position, and none whose columns may hide under another name."""
    source, expected = plan.source, plan.expected
    without = [j for j in expected.joints if not plan.has(j, *POSITIONS)]
    if len(without) == len(expected.joints):
        owners = {c.rpartition("__")[0] for c in source.header if "__position" in c}
        seen = one_line(", ".join(sorted(owners)) or ", ".join(source.header))
        raise LegwattError(
            f"{source.where}: none of the {len(expected.joints)} joints of {expected.robot} "
            f"('{expected.joints[0]}', ...) has a position; the log of another robot? "
            f"It has: {seen}"
        )
    for joint in without:
        wanted = column_name(joint, "position")
        hidden = plan.has(joint, *EFFORTS) or plan.strangers(*POSITIONS)
        if hidden and wanted not in plan.rule.constants:
            raise LegwattError(
                f"{source.where}: joint '{joint}' has no column '{wanted}'; "
                f"{suggest_column(wanted, source.header)}"
            )


def _check_efforts(plan: ReadingPlan) -> None:
    """At least one effort channel, and none whose columns may hide under another name."""
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
    found += ["voltage"] if not found and plan.derives_voltage else []
    found += ["torque"] if plan.derives_torque else []
    if not found and not plan.supply_alone:
        columns = ", ".join(column_name(plan.expected.joints[0], c) for c in EFFORTS)
        goals = "goal_position" in plan.quantities
        hint = "; or give the servos' gains under [pd_gains] in a mapping file" if goals else ""
        raise LegwattError(
            f"{where}: no effort channel; at least one of {columns} must be there{hint}"
        )
    if mapping.effort is not None and not plan.supply_alone:
        known(f"effort is not in {where}:", mapping.effort, found, mapping.where)
