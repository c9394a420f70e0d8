"""From a file's columns to a `Log`: names resolved, units applied, every defect named."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from actuators.errors import UnitError, closest, one_line
from actuators.units import dimension, from_si
from pipeline.logs.errors import GapError, LogContentError, LogFormatError, WrongRobotError
from pipeline.logs.reading.expected import Expected
from pipeline.logs.reading.log import EFFORTS, Log
from pipeline.logs.reading.log_format import (
    JOINT_COLUMNS,
    TIME,
    Target,
    misspelt,
    parse_column,
    suggest_column,
)
from pipeline.logs.reading.mapping import ColumnRule, LogRule, Mapping
from pipeline.logs.reading.table_file import (
    TableFile,
    open_table,
    read_columns,
    sha256,
    stream_columns,
)

Array = NDArray[np.float64]
_IDENTITY: Final = ColumnRule("", "")
_LARGEST: Final = 1e9  # nothing a robot measures is larger in the log's units


@dataclass(frozen=True)
class _Source:
    """A column of the file and the affine map that brings it into the log's unit."""

    column: str
    factor: float
    offset: float


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
    sources: dict[Target, _Source]
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


def read_log(path: Path, expected: Expected, mapping: Mapping | None = None) -> Log:
    """Read one log whole.

    Args:
        path: CSV or Parquet.
        expected: Names, limits and ratios of the robot.
        mapping: For foreign columns.

    Raises:
        GapError: The file is unreadable, is not this robot's, or holds no usable measurement.
    """
    plan = plan_reading(path, expected, mapping)
    data = read_columns(plan.table, plan.columns)
    log = assemble(plan, data, first_row=0, digest=sha256(path))
    return log


def stream_log(
    path: Path,
    expected: Expected,
    mapping: Mapping | None = None,
    *,
    rows: int = 200_000,
    digest: str = "",
) -> Iterator[Log]:
    """Read a Parquet log in consecutive pieces of at most `rows` rows.

    Args:
        path: Parquet.
        expected: Names, limits and ratios of the robot.
        mapping: For foreign columns.
        rows: Of a piece.
        digest: SHA-256 of the file, where it is known.

    Raises:
        GapError: As for `read_log`; time is checked across pieces, too.
    """
    plan = plan_reading(path, expected, mapping)
    first, last = 0, -np.inf
    for data in stream_columns(plan.table, plan.columns, rows):
        log = assemble(plan, data, first_row=first, digest=digest)
        if log.time[0] <= last:
            raise LogContentError(
                f"{plan.table.where}: row {first + 2}: time {log.time[0]:.9g} s does not follow "
                f"{last:.9g} s; sort the rows by time"
            )
        first, last = first + len(log), float(log.time[-1])
        yield log


def plan_reading(path: Path, expected: Expected, mapping: Mapping | None = None) -> ReadingPlan:
    """Decide from the header which column goes where.

    Raises:
        GapError: Columns are missing, occur twice after mapping, or belong to another robot.
    """
    mapping = mapping or Mapping()
    table = open_table(path, mapping.dialect)
    sources: dict[Target, _Source] = {}
    ignored: dict[str, str] = {}
    used_rules: set[ColumnRule] = set()
    for column in table.header:
        rule, name = _resolve(column, mapping)
        used_rules.add(rule)
        target = parse_column(name, expected, table.where)
        if target is None:
            if rule is not _IDENTITY:
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
        sources[target] = _Source(column, *rule.affine(target.unit))
    for rule in mapping.columns:
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
        table, expected, mapping, mapping.rule_for(path.stem), sources, tuple(ignored), near
    )
    _check_misspelt(plan)
    _check_columns(plan)
    return plan


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
    owner, separator, quantity = name.rpartition("__")
    if separator and owner in mapping.joints:
        name = f"{mapping.joints[owner]}__{quantity}"
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
    table, expected, mapping = plan.table, plan.expected, plan.mapping
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
    with_position = [j for j in expected.joints if _position_quantity(have, j)]
    if not with_position:
        owners = {c.rpartition("__")[0] for c in table.header if "__position" in c}
        seen = one_line(", ".join(sorted(owners)) or ", ".join(table.header))
        raise WrongRobotError(
            f"{where}: none of the {len(expected.joints)} joints of {expected.robot} "
            f"('{expected.joints[0]}', ...) has a position; the log of another robot? "
            f"It has: {seen}"
        )
    for joint in expected.joints:
        if joint not in with_position:
            wanted = f"{joint}__position_rad"
            raise WrongRobotError(
                f"{where}: joint '{joint}' has no column '{wanted}'; "
                f"{suggest_column(wanted, table.header)}"
            )
        if {(joint, "position"), (joint, "motor_position")} <= have:
            raise LogFormatError(
                f"{where}: joint '{joint}' has a joint-side and a motor-side position; map one away"
            )
    sides = {_position_quantity(have, joint) for joint in expected.joints}
    if len(sides) > 1:
        raise LogFormatError(
            f"{where}: some joints have joint-side, some motor-side positions; give one kind"
        )
    if sides == {"motor_position"} and expected.ratio is None:
        raise LogFormatError(
            f"{where}: motor-side positions need the gear ratios; give actuators with --model, or "
            "scale the columns in a mapping file"
        )
    _check_efforts(plan, have)
    for what, column in (
        *((f"torque_enabled.{j}", c) for j, c in mapping.torque_enabled.items()),
        *(("keep", c) for c in mapping.keep),
        *((("supply", mapping.supply_column),) if mapping.supply_column else ()),
    ):
        if column not in table.header:
            raise GapError(
                f"{mapping.where}: {what}: column '{one_line(column)}' is not in {where}; "
                f"{suggest_column(column, table.header)}"
            )
    for joint in (*mapping.torque_enabled, *mapping.locked, *mapping.joints.values()):
        if joint not in expected.joints:
            raise GapError(
                f"{mapping.where}: '{one_line(joint)}' is no joint of {expected.robot}; "
                f"{closest(joint, expected.joints)}"
            )


def _position_quantity(have: set[tuple[str, str]], joint: str) -> str | None:
    for quantity in ("position", "motor_position"):
        if (joint, quantity) in have:
            return quantity
    return None


def _check_efforts(plan: ReadingPlan, have: set[tuple[str, str]]) -> None:
    """At least one effort channel, and each for all joints or none."""
    where, joints, mapping = plan.table.where, plan.expected.joints, plan.mapping
    found = [c for c in EFFORTS if any((j, c) in have for j in joints if j not in mapping.locked)]
    for channel in found:
        for joint in joints:
            if (joint, channel) not in have and joint not in mapping.locked:
                column = next(
                    f"{joint}__{s}" for s, (q, _) in JOINT_COLUMNS.items() if q == channel
                )
                raise WrongRobotError(
                    f"{where}: joint '{joint}' has no {channel} '{column}', other joints have; log "
                    "it, or list the joint under locked in a mapping file"
                )
    if not found and _derives_voltage(plan, have):
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


def _derives_voltage(plan: ReadingPlan, have: set[tuple[str, str]]) -> bool:
    mapping = plan.mapping
    return (
        mapping.law == "duty"
        and plan.rule.gain is not None
        and (mapping.supply_column is not None or mapping.supply_voltage is not None)
        and all((joint, "goal_position") in have for joint in plan.expected.joints)
    )


def assemble(plan: ReadingPlan, data: dict[str, Array], *, first_row: int, digest: str) -> Log:
    """Put columns in their places.

    Args:
        plan: From `plan_reading`.
        data: Column to numbers.
        first_row: Of these numbers in the file, for messages and for the time without a column.
        digest: SHA-256 of the file.

    Raises:
        LogContentError: Time does not run forward, or values that no robot measures.
    """
    where, expected, mapping = plan.table.where, plan.expected, plan.mapping
    n = next(iter(data.values())).size
    arrays: dict[str, Any] = {}
    force: dict[tuple[str, str], Array] = {}
    by_joint: dict[str, dict[str, Array]] = {}
    for target, source in plan.sources.items():
        values = data[source.column]
        _check_values(values, source.column, where, first_row)
        if (source.factor, source.offset) != (1.0, 0.0):
            values = source.factor * values + source.offset
            _check_values(values, source.column, f"{where} through {mapping.where}", first_row)
        if target.kind == "joint":
            by_joint.setdefault(target.quantity, {})[target.owner] = values
        elif target.kind == "foot":
            force[target.owner, target.quantity] = values
        else:
            arrays[target.quantity] = values
    for key, value in plan.rule.constants.items():
        constant = parse_column(key, expected, mapping.where)
        if constant is None or constant in plan.sources:
            continue
        column = np.full(n, from_si(value, constant.unit))
        if constant.kind == "joint":
            by_joint.setdefault(constant.quantity, {})[constant.owner] = column
        elif constant.kind == "base":
            arrays[constant.quantity] = column
    for quantity, columns in by_joint.items():
        block = np.full((n, len(expected.joints)), np.nan)
        for j, joint in enumerate(expected.joints):
            if joint in columns:
                block[:, j] = columns[joint]
        arrays[quantity] = block
    if mapping.sample_rate is not None:
        arrays["time"] = (first_row + np.arange(n)) / mapping.sample_rate
    _check_time(arrays["time"], where, first_row)
    side = "joint"
    if "motor_position" in arrays:
        side = "motor"
        arrays["position"] = arrays.pop("motor_position") / expected.ratio
    unused = _feet(arrays, force, expected)
    ignored = [s.column for t, s in plan.sources.items() if (t.owner, t.quantity) in unused]
    _drive(plan, data, arrays, n)
    return Log(
        name=plan.table.path.stem,
        joints=expected.joints,
        position_source=side,
        gain=plan.rule.gain,
        torque_off_bridge=mapping.torque_off_bridge,
        constants=dict(plan.rule.constants),
        condition=dict(plan.rule.condition),
        locked=tuple(mapping.locked),
        extra={column: data[column] for column in mapping.keep},
        ignored=(*plan.ignored, *ignored),
        misspelt=dict(plan.misspelt),
        chosen_effort=mapping.effort,
        sha256=digest,
        source=plan.table.path,
        **arrays,
    )


def _check_values(values: Array, column: str, where: str, first_row: int) -> None:
    bad = np.abs(values) > _LARGEST  # infinities too; NaN is an empty cell
    if column != TIME and bad.any():
        row = int(np.argmax(bad))
        raise LogContentError(
            f"{where}: row {first_row + row + 2}, column '{one_line(column)}' holds "
            f"{values[row]:g}; no sensor reads that, leave the cell empty"
        )


def _check_time(time: Array, where: str, first_row: int) -> None:
    bad = ~np.isfinite(time)
    if bad.any():
        row = first_row + int(np.argmax(bad)) + 2
        raise LogContentError(f"{where}: row {row}: time is empty or not finite; drop the row")
    step = np.diff(time)
    if (step <= 0).any():
        k = int(np.argmax(step <= 0))
        fact = "repeats" if step[k] == 0 else f"comes after {time[k]:.9g} s"
        raise LogContentError(
            f"{where}: row {first_row + k + 3}: time {time[k + 1]:.9g} s {fact}; "
            "sort the rows by time and drop repeats"
        )


def _feet(
    arrays: dict[str, Any], force: dict[tuple[str, str], Array], expected: Expected
) -> set[tuple[str, str]]:
    """Foot forces and contacts, where every foot has them; what was not measured is NaN.

    Returns:
        Leg and quantity of what cannot be used: some feet alone do not tell who carries the robot,
        and lateral forces alone do not tell who stands.
    """
    feet = expected.feet
    unused = set(force)
    if feet and all((foot, "force_z") in force for foot in feet):
        # Where lateral sensors are missing at some feet, those of the others fit no sum of forces.
        axes = [axis for axis in "xyz" if all((foot, f"force_{axis}") in force for foot in feet)]
        block = np.full((arrays["time"].size, len(feet), 3), np.nan)
        for i, foot in enumerate(feet):
            for axis in axes:
                block[:, i, "xyz".index(axis)] = force[foot, f"force_{axis}"]
        arrays["feet"], arrays["foot_force"] = feet, block
        unused -= {(foot, f"force_{axis}") for foot in feet for axis in axes}
    if feet and all((foot, "contact") in force for foot in feet):
        arrays["feet"] = feet
        arrays["contact"] = np.stack([force[foot, "contact"] > 0.5 for foot in feet], axis=1)
        unused -= {(foot, "contact") for foot in feet}
    return unused


def _drive(plan: ReadingPlan, data: dict[str, Array], arrays: dict[str, Any], n: int) -> None:
    """Supply, switched-off rows and the voltage of the servo's own law."""
    mapping, joints = plan.mapping, plan.expected.joints
    if mapping.supply_column:
        rule = ColumnRule(mapping.supply_column, "", mapping.supply_unit)
        factor, offset = rule.affine("V")
        arrays["supply"] = factor * data[mapping.supply_column] + offset
    elif mapping.supply_voltage is not None:
        arrays["supply"] = np.full(n, mapping.supply_voltage)
    if mapping.torque_enabled:
        off = np.zeros((n, len(joints)), dtype=np.bool_)
        for joint, column in mapping.torque_enabled.items():
            off[:, joints.index(joint)] = ~(data[column] > 0.5)
        arrays["torque_off"] = off
    have = {(t.owner, t.quantity) for t in plan.sources}
    if "voltage" not in arrays and _derives_voltage(plan, have):
        # U = U_supply * clip(k (goal - position), -1, 1): the servo's duty, averaged over its PWM.
        duty = np.clip(plan.rule.gain * (arrays["goal_position"] - arrays["position"]), -1.0, 1.0)
        arrays["voltage"] = arrays["supply"][:, None] * duty
        if "torque_off" in arrays:
            arrays["voltage"][arrays["torque_off"]] = np.nan
        arrays["derived"] = {"voltage": "supply x clip(gain x (goal - position), -1, 1)"}
    valid = np.isfinite(arrays["position"])
    effort = mapping.effort or next((c for c in EFFORTS if c in arrays), None)
    if effort is not None:
        valid &= np.isfinite(arrays[effort])
    if "torque_off" in arrays:
        valid &= ~arrays["torque_off"]
    arrays["valid"] = valid
