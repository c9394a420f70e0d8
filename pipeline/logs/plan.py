"""Which column of a file goes where, decided from its header alone, and what is missing."""

from __future__ import annotations

from collections.abc import Mapping as MappingType
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Final

from actuators.errors import LegwattError, closest, known, one_line
from actuators.units import dimension
from pipeline.logs.formats import Source, open_source
from pipeline.logs.log_format import EFFORTS, TIME, Expected, Target, column_name
from pipeline.logs.mapping import ColumnTable, LogTable, Mapping

POSITIONS: Final = ("position", "motor_position")
AS_NAMED: Final = ColumnTable()
#: Similarity from which a column that is unused is taken for a slip of the pen: of an owner, and of
#: a quantity, whose unit may be another.
_NEAR, _NEAR_QUANTITY = 0.85, 0.75


@dataclass(frozen=True)
class ReadingPlan:
    """Which column of a file goes where; made from its header alone."""

    source: Source  #: The open file.
    expected: Expected  #: The robot's names and limits.
    mapping: Mapping  #: The mapping.
    rule: LogTable  #: What holds for this log.
    #: Name in the log format to column of the file and the mapping's rule for it.
    sources: dict[str, tuple[str, ColumnTable]]
    ignored: tuple[str, ...]  #: Columns that mean nothing to the log format.

    @property
    def quantities(self) -> set[str]:
        """Quantities that the file has of anything."""
        return {self.expected.columns[name].quantity for name in self.sources}

    @property
    def channel(self) -> str:
        """The effort channel that is compared, as far as mapping and header say."""
        return self.mapping.effort or next((c for c in EFFORTS if c in self.quantities), "voltage")

    @property
    def derives_torque(self) -> bool:
        """Whether torque follows from the servos' law, targets and gains."""
        efforts = self.quantities & {*EFFORTS}
        wanted = "torque" not in efforts and (not efforts or self.mapping.effort == "torque")
        told = self.mapping.pd_gains is not None and "goal_position" in self.quantities
        return wanted and told

    @property
    def supply_alone(self) -> bool:
        """Whether the supply's power or current is all that it tells of effort."""
        of_joints = self.quantities & {*EFFORTS} or self.derives_torque
        return bool(self.quantities & {"supply_power", "supply_current"}) and not of_joints


def plan_reading(path: Path, expected: Expected, mapping: Mapping | None = None) -> ReadingPlan:
    """Decide from the header which column goes where.

    Raises:
        LegwattError: Columns are missing, occur twice after mapping, or belong to another robot.
    """
    mapping = mapping or Mapping()
    source = open_source(path)
    sources: dict[str, tuple[str, ColumnTable]] = {}
    ignored: dict[str, str] = {}
    becomes: dict[str, tuple[str, str]] = {}  # pattern to the first column, and what it becomes
    owners = set()
    for column in source.header:
        pattern, rule, own = _rule(column, mapping)
        owner, separator, quantity = own.rpartition("__")
        owners.add(owner)
        name = f"{mapping.joints.get(owner, owner)}{separator}{quantity}"
        target = expected.columns.get(name)
        if target is None:
            ignored[column] = name
            becomes.setdefault(pattern, (column, name))
            continue
        if target.name in sources:
            raise LegwattError(
                f"{source.where}: '{one_line(column)}' and '{one_line(sources[target.name][0])}' "
                "both give the same channel; keep one"
            )
        becomes[pattern] = column, ""
        sources[target.name] = column, _in_unit(rule, source, column, own, target, mapping.where)
    for pattern in mapping.columns:
        if pattern not in becomes:
            what = f"no column of {source.where} matches '{one_line(pattern)}'"
            raise LegwattError(f"{mapping.where}: {what}; {closest(pattern, source.header)}")
        column, name = becomes[pattern]
        if name:
            near = get_close_matches(name, expected.columns, n=1)
            raise LegwattError(
                f"{mapping.where}: column '{one_line(column)}' becomes '{one_line(name)}', which "
                "is none of the log format" + (f"; did you mean '{near[0]}'?" if near else "")
            )
    plan = ReadingPlan(source, expected, mapping, mapping.rule_for(path), sources, tuple(ignored))
    _refuse_unknown_names(plan, owners - {""})
    _refuse_slips(plan, source.where, ignored)
    _refuse_slips(plan, mapping.where, {name: name for name in plan.rule.constants})
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
    """The rule with the unit that the file's own row of units states, where the rule has none."""
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


def _refuse_unknown_names(plan: ReadingPlan, owners: set[str]) -> None:
    """Refuse a name of the mapping that neither the file nor the robot has."""
    source, joints, mapping = plan.source, plan.expected.joints, plan.mapping
    for name in mapping.joints:
        known(f"joints: no column of {source.where} is of", name, owners, mapping.where)
    columns = {"time": mapping.time.column} if mapping.time.column else {}
    columns |= {f"torque_enabled.{joint}": c for joint, c in mapping.torque_enabled.items()}
    for what, column in columns.items():
        known(f"{what}: {source.where} has no column", column, source.header, mapping.where)
    for joint in (*mapping.torque_enabled, *mapping.joints.values(), *mapping.gear_ratio):
        known(f"no joint of {plan.expected.robot}:", joint, joints, mapping.where)
    if mapping.pd_gains is not None:
        try:
            for key in ("kp", "kd", "limit"):
                mapping.pd_gains.of(key, joints)
        except ValueError as error:
            raise LegwattError(f"{mapping.where}: {error}") from None


def _refuse_slips(plan: ReadingPlan, where: str, names: MappingType[str, str]) -> None:
    """Refuse names one or two letters, or a unit, off those of a column that is not there.

    A column that is left out for that would cost a channel, or a joint, without a word.
    """
    columns = plan.expected.columns
    missing = [name for name, target in columns.items() if target.name not in plan.sources]
    for column, name in names.items():
        owner, separator, quantity = name.lower().rpartition("__")
        for other in missing if separator and name not in columns else ():
            its, _, known_as = other.lower().rpartition("__")
            if owner != its and quantity != known_as:
                continue
            one, two, near = owner, its, _NEAR
            if its == owner:
                one, two, near = quantity, known_as, _NEAR_QUANTITY
            same = [c for c in one if c.isdigit()] == [c for c in two if c.isdigit()]
            if same and get_close_matches(one, [two], cutoff=near):
                raise LegwattError(
                    f"{where}: '{one_line(column)}' is none of the log format and would be "
                    f"ignored; did you mean '{other}'? Give name and unit in a mapping file"
                )


def _refuse_missing(plan: ReadingPlan) -> None:
    """Refuse a log without time, positions or efforts of this robot."""
    source, expected, mapping = plan.source, plan.expected, plan.mapping
    where, rate = source.where, mapping.time.sample_rate
    if "time" in plan.quantities and rate is not None:
        raise LegwattError(
            f"{mapping.where}: sample_rate is given and {where} has {TIME}; drop one"
        )
    if "time" not in plan.quantities and rate is None:
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
    stated = {name.rpartition("__")[0] for name in plan.rule.constants}
    without = [
        joint
        for joint in expected.joints
        if joint not in stated and not {column_name(joint, q) for q in POSITIONS} & {*plan.sources}
    ]
    strangers = [c for c in plan.ignored if c.endswith("position_rad")]
    if strangers and without:
        wanted = column_name(without[0], "position")
        raise LegwattError(
            f"{where}: no column '{wanted}', {closest(wanted, strangers)} Give the joint's name "
            "under [joints] of a mapping file, or where it stands under [constants]"
        )
    found = [c for c in EFFORTS if c in plan.quantities] + ["torque"] * plan.derives_torque
    if not found and not plan.supply_alone:
        columns = ", ".join(column_name(expected.joints[0], c) for c in EFFORTS)
        goals = "goal_position" in plan.quantities
        hint = "; or give the servos' gains under [pd_gains] in a mapping file" if goals else ""
        raise LegwattError(
            f"{where}: no effort channel; at least one of {columns} must be there{hint}"
        )
    if mapping.effort is not None and not plan.supply_alone:
        known(f"effort is not in {where}:", mapping.effort, found, mapping.where)
