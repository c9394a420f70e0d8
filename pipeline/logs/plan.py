"""Which column of a file goes where, decided from its header alone, and what is missing."""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Final

from actuators.errors import LegwattError, closest, known, one_line
from actuators.units import dimension
from pipeline.logs.formats import Source, open_source
from pipeline.logs.log_format import (
    EFFORTS,
    TIME,
    Expected,
    Target,
    column_name,
    parse_column,
    plotted,
)
from pipeline.logs.mapping import ColumnTable, LogTable, Mapping

POSITIONS: Final = ("position", "motor_position")
AS_NAMED: Final = ColumnTable()
#: Similarity from which a column that is unused is taken for a slip of the pen.
_NEAR: Final = 0.85


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
        told = self.quantities & {*EFFORTS} or self.derives_torque
        return self.of_supply and not told


def plan_reading(path: Path, expected: Expected, mapping: Mapping | None = None) -> ReadingPlan:
    """Decide from the header which column goes where.

    Raises:
        LegwattError: Columns are missing, occur twice after mapping, or belong to another robot.
    """
    mapping = mapping or Mapping()
    source = open_source(path)
    sources: dict[Target, tuple[str, ColumnTable]] = {}
    ignored: dict[str, str] = {}
    becomes: dict[str, tuple[str, str]] = {}  # pattern to the first column, and what it becomes
    for column in source.header:
        pattern, rule, own = _rule(column, mapping)
        if not pattern and own == column and plotted(column) not in source.header:
            own = plotted(column)
        owner, separator, quantity = own.rpartition("__")
        name = f"{mapping.joints.get(owner, owner)}{separator}{quantity}"
        target = parse_column(name, expected, source.where)
        if target is None:
            ignored[column] = name
            becomes.setdefault(pattern, (column, name))
            continue
        if target in sources:
            raise LegwattError(
                f"{source.where}: '{one_line(column)}' and '{one_line(sources[target][0])}' "
                "both give the same channel; keep one"
            )
        becomes[pattern] = column, ""
        sources[target] = column, _in_unit(rule, source, column, own, target, mapping.where)
    for pattern in mapping.columns:
        if pattern not in becomes:
            what = f"no column of {source.where} matches '{one_line(pattern)}'"
            raise LegwattError(f"{mapping.where}: {what}; {closest(pattern, source.header)}")
        if (name := becomes[pattern][1]) and pattern:
            near = get_close_matches(name, expected.columns, n=1)
            raise LegwattError(
                f"{mapping.where}: column '{one_line(becomes[pattern][0])}' becomes "
                f"'{one_line(name)}', which is none of the log format"
                + (f"; did you mean '{near[0]}'?" if near else "")
            )
    rule_of_log = mapping.rule_for(path)
    plan = ReadingPlan(source, expected, mapping, rule_of_log, sources, tuple(ignored))
    _refuse_unknown_names(plan)
    _refuse_slips(plan, ignored)
    _refuse_missing(plan)
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
    rule: ColumnTable, source: Source, column: str, name: str, target: Target, where: str
) -> ColumnTable:
    """The rule with the unit that the file's own row of units states, where the rule has none.

    Raises:
        LegwattError: A unit of something else.
    """
    stated = source.units.get(column)
    if rule.unit is None and stated and dimension(stated) == dimension(target.unit):
        if column == name and stated != target.unit:
            raise LegwattError(
                f"{source.where}: column '{one_line(column)}' is in '{stated}' by the row of "
                "units, and in another by its name; rename it, or give its unit in a mapping file"
            )
        return rule.model_copy(update={"unit": stated})
    if rule.unit not in (None, "1") and dimension(str(rule.unit)) != dimension(target.unit):
        raise LegwattError(
            f"{where}: column '{one_line(column)}': '{rule.unit}' is a unit of "
            f"{dimension(str(rule.unit))}, {target.quantity} needs one of {dimension(target.unit)}"
        )
    return rule


def _refuse_unknown_names(plan: ReadingPlan) -> None:
    """Refuse a name of the mapping that neither the file nor the robot has."""
    source, expected, mapping = plan.source, plan.expected, plan.mapping
    owners = {_rule(column, mapping)[2].rpartition("__")[0] for column in source.header} - {""}
    for name in mapping.joints:
        known(f"joints: no column of {source.where} is of", name, sorted(owners), mapping.where)
    for what, column in (
        ("time", mapping.time.column),
        *((f"torque_enabled.{j}", c) for j, c in mapping.torque_enabled.items()),
        *(("keep", c) for c in mapping.keep.columns),
        ("supply", mapping.supply.column),
    ):
        if column is not None:
            known(f"{what}: {source.where} has no column", column, source.header, mapping.where)
    for joint in (*mapping.torque_enabled, *mapping.joints.values(), *mapping.gear_ratio):
        known(f"no joint of {expected.robot}:", joint, expected.joints, mapping.where)
    try:
        for key in ("kp", "kd", "limit") if mapping.pd_gains is not None else ():
            assert mapping.pd_gains is not None
            mapping.pd_gains.of(key, expected.joints)
    except ValueError as error:
        raise LegwattError(f"{mapping.where}: {error}") from None


def _refuse_slips(plan: ReadingPlan, ignored: dict[str, str]) -> None:
    """Refuse names one or two letters off those of a column that is not there.

    A column that is left out for that would cost a channel, or a joint, without a word.
    """
    source, mapping, expected = plan.source, plan.mapping, plan.expected.columns
    missing = [name for name, target in expected.items() if target not in plan.sources]
    keys = {name: name for name in plan.rule.constants}
    for where, names in ((source.where, ignored), (mapping.where, keys)):
        for column, name in names.items():
            if column in mapping.keep.columns or name in expected or "__" not in name:
                continue
            owner, _, quantity = name.lower().rpartition("__")
            for other in missing:
                its, _, known_as = other.lower().rpartition("__")
                one, two = (quantity, known_as) if its == owner else (owner, its)
                digits = [c for c in one if c.isdigit()] == [c for c in two if c.isdigit()]
                same = its == owner or known_as == quantity
                if same and digits and get_close_matches(one, [two], cutoff=_NEAR):
                    raise LegwattError(
                        f"{where}: '{one_line(column)}' is none of the log format and would be "
                        f"ignored; did you mean '{other}'? Rename it, or list it under keep in a "
                        "mapping file"
                    )


def _refuse_missing(plan: ReadingPlan) -> None:
    """Refuse a log without time, positions or efforts of this robot."""
    source, expected, mapping = plan.source, plan.expected, plan.mapping
    where, has_time = source.where, "time" in plan.quantities
    if has_time and mapping.time.sample_rate is not None:
        raise LegwattError(
            f"{mapping.where}: sample_rate is given and {where} has {TIME}; drop one"
        )
    if not has_time and mapping.time.sample_rate is None:
        raise LegwattError(
            f"{where}: no column {TIME}; {closest(TIME, source.header)} Name it under [time] in a "
            "mapping file, or give its sample_rate there"
        )
    if not plan.quantities & {*POSITIONS}:
        owners = {c.rpartition("__")[0] for c in source.header if "__position" in c}
        raise LegwattError(
            f"{where}: none of the {len(expected.joints)} joints of {expected.robot} "
            f"('{expected.joints[0]}', ...) has a position; the log of another robot? It has: "
            f"{one_line(', '.join(sorted(owners) or source.header))}"
        )
    told = {t.owner for t in plan.sources if t.quantity in POSITIONS}
    told |= {name.rpartition("__")[0] for name in plan.rule.constants}
    strangers = [c for c in plan.ignored if c.endswith("position_rad")]
    strangers = [c for c in strangers if c not in mapping.keep.columns]
    if strangers and (without := [joint for joint in expected.joints if joint not in told]):
        wanted = column_name(without[0], "position")
        raise LegwattError(
            f"{where}: no column '{wanted}', {closest(wanted, strangers)} Give the joint's name "
            "under [joints] of a mapping file, or where it stands under [constants]"
        )
    found = [c for c in EFFORTS if c in plan.quantities]
    found += ["torque"] if plan.derives_torque else []
    if not found and not plan.supply_alone:
        columns = ", ".join(column_name(expected.joints[0], c) for c in EFFORTS)
        goals = "goal_position" in plan.quantities
        hint = "; or give the servos' gains under [pd_gains] in a mapping file" if goals else ""
        raise LegwattError(
            f"{where}: no effort channel; at least one of {columns} must be there{hint}"
        )
    if mapping.effort is not None and not plan.supply_alone:
        known(f"effort is not in {where}:", mapping.effort, found, mapping.where)
