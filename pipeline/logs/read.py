"""From a file to rows in the log format: names, units, signs; every defect is named.

Which column goes where, and what is missing, is decided by the header alone, before any row.
"""

from __future__ import annotations

import re
from collections.abc import Mapping as MappingType
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Final, TypeGuard

import numpy as np
import pandas as pd

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError, closest, known, one_line
from actuators.parameters import dimension, from_si, to_si
from pipeline.logs.formats import Source, open_source, sha256
from pipeline.logs.log import (
    BY_MODEL,
    COLUMNS,
    EFFORTS,
    OFF,
    POSITIONS,
    TIME,
    Column,
    Expected,
    Findings,
    Recording,
    column_name,
)
from pipeline.logs.mapping import CANNOT, LAW, ColumnTable, Mapping

AS_NAMED: Final = ColumnTable()
#: Similarity from which a column that is unused is taken for a slip of the pen.
_NEAR: Final = 0.85
#: Nothing a robot measures is larger in the log's units.
_LARGEST: Final = 1e9
#: Difference from a stated gear ratio, relative, from which the two positions contradict it.
_CONTRADICTS: Final = 0.05
#: How much a joint must move for its two positions to tell their ratio [rad].
_LEAST_MOTION: Final = 0.05
#: Numbers by name in the log format, each (N,).
Columns = dict[str, Any]


@dataclass(frozen=True)
class ReadingPlan:
    """Which column of a file goes where; made from its header alone."""

    source: Source  #: The open file.
    expected: Expected  #: The robot's names and limits.
    mapping: Mapping  #: The mapping.
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
    mapping, source = mapping or Mapping(), open_source(path)
    sources: dict[str, tuple[str, ColumnTable]] = {}
    ignored, owners, rules = dict[str, str](), set[str](), mapping.rules
    useless = dict.fromkeys(mapping.columns, "")  # patterns, and the unknown name that one gives
    for column in source.header:
        names = ((pattern, rule.renamed(pattern, column)) for pattern, rule in rules.items())
        pattern, own = next(((p, name) for p, name in names if name is not None), ("", column))
        rule = rules.get(pattern, AS_NAMED)
        owner, separator, quantity = own.rpartition("__")
        owners.add(owner)
        name = f"{mapping.joints.get(owner, owner)}{separator}{quantity}"
        target = expected.columns.get(name)
        if target is None:
            ignored[column] = name
            useless |= {pattern: name} if pattern in useless else {}
            continue
        if target.name in sources:
            raise LegwattError(
                f"{source.where}: '{one_line(column)}' and '{one_line(sources[target.name][0])}' "
                "both give the same channel; keep one"
            )
        useless.pop(pattern, None)
        _refuse_other_unit(rule.unit, target, f"{mapping.where}: column '{one_line(column)}'")
        sources[target.name] = column, rule
    for pattern, name in useless.items():
        fact = f"no column of {source.where} matches it; {closest(pattern, source.header)}"
        if name:
            fact = f"'{one_line(name)}' is none of the log format; "
            fact += closest(name, [*expected.columns])
        raise LegwattError(f"{mapping.where}: columns '{one_line(pattern)}': {fact}")
    for name, constant in mapping.constants.items():
        known("constants: no column", name, expected.columns, mapping.where)
        where = f"{mapping.where}: constants '{one_line(name)}'"
        _refuse_other_unit(constant.unit, expected.columns[name], where)
    plan = ReadingPlan(source, expected, mapping, sources, tuple(ignored))
    _refuse_unknown_names(plan, owners - {""})
    _refuse_missing(plan)
    _refuse_slips(plan, ignored)
    return plan


def _refuse_other_unit(unit: str | None, target: Column, where: str) -> None:
    if unit not in (None, "1") and dimension(str(unit)) != dimension(target.unit):
        raise LegwattError(
            f"{where}: '{unit}' is a unit of {dimension(str(unit))}, {target.quantity} needs one "
            f"of {dimension(target.unit)}"
        )


def _refuse_unknown_names(plan: ReadingPlan, owners: set[str]) -> None:
    """Refuse a name of the mapping that neither the file nor the robot has."""
    source, mapping, robot = plan.source, plan.mapping, plan.expected
    gains = mapping.pd_gains.named if mapping.pd_gains else ()
    columns = {"time": mapping.time.column} if mapping.time.column else {}
    columns |= {f"torque_enabled.{joint}": c for joint, c in mapping.torque_enabled.items()}
    for name in mapping.joints:
        known(f"joints: no column of {source.where} is of", name, owners, mapping.where)
    for what, column in columns.items():
        known(f"{what}: {source.where} has no column", column, source.header, mapping.where)
    for joint in (*mapping.torque_enabled, *mapping.joints.values(), *mapping.gear_ratio, *gains):
        known(f"no joint of {robot.robot}:", joint, robot.joints, mapping.where)


def _refuse_slips(plan: ReadingPlan, ignored: MappingType[str, str]) -> None:
    """Refuse columns a few letters off those of a column that is not there.

    A column that is left out for that would cost a channel, or a joint, without a word.
    """
    columns = plan.expected.columns
    missing = [name for name, target in columns.items() if target.name not in plan.sources]
    for column, name in ignored.items():
        digits = re.sub(r"\D", "", name)
        alike = [n for n in missing if "__" in name and re.sub(r"\D", "", n) == digits]
        if near := get_close_matches(name, alike, n=1, cutoff=_NEAR):
            raise LegwattError(
                f"{plan.source.where}: '{one_line(column)}' is none of the log format and would be "
                f"ignored; did you mean '{near[0]}'? Give name and unit in a mapping file"
            )


def _refuse_missing(plan: ReadingPlan) -> None:
    """Refuse a log without time, positions or efforts of this robot."""
    source, expected, mapping = plan.source, plan.expected, plan.mapping
    where, joints, there = source.where, expected.joints, {*plan.sources, *mapping.constants}
    if mapping.time.sample_rate is None and TIME not in plan.sources:
        raise LegwattError(
            f"{where}: no column {TIME}; {closest(TIME, source.header)} Name it under [time] in a "
            "mapping file, or give its sample_rate there; `gap mapping` writes a first one"
        )
    sides = [[column_name(joint, quantity) for quantity in POSITIONS] for joint in joints]
    wanted = [names[0] for names in sides if not {*names} & there]
    strangers = [c for c in plan.ignored if "__position" in c]
    if len(wanted) == len(joints) or (wanted and strangers):
        raise LegwattError(
            f"{where}: no column '{wanted[0]}', {closest(wanted[0], strangers or source.header)} "
            "The log of another robot? Else give the joint's name under [joints] of a mapping "
            "file, or where it stands under [constants]"
        )
    found = [c for c in EFFORTS if c in plan.quantities] + ["torque"] * plan.derives_torque
    if plan.supply_alone:
        return
    if not found:
        columns = ", ".join(column_name(joints[0], c) for c in EFFORTS)
        hint = "; or give the servos' gains under [pd_gains] in a mapping file"
        raise LegwattError(
            f"{where}: no effort channel; at least one of {columns} must be there"
            f"{hint * ('goal_position' in plan.quantities)}"
        )
    if mapping.effort is not None:
        known(f"effort is not in {where}:", mapping.effort, found, mapping.where)


def read_log(path: Path, expected: Expected, mapping: Mapping | None = None) -> Recording:
    """Read one log: a file of the robot that is expected, with a mapping of its columns.

    Raises:
        LegwattError: The file is unreadable, is not this robot's, or holds no usable measurement.
    """
    plan = plan_reading(path, expected, mapping)
    mapping, found = plan.mapping, Findings(path.stem)
    wanted = [*(column for column, _ in plan.sources.values()), *mapping.torque_enabled.values()]
    data = plan.source.columns([*dict.fromkeys(wanted)])
    if plan.source.remark:
        found.note("", "file", "warning", plan.source.remark)
    frame = _in_si(plan, data)
    fresh = _fresh(frame[TIME], plan.source.where)
    if many := int((~fresh).sum()):
        text = f"{many} rows with the time of the row before were dropped"
        found.note("time_s", "repeated_times", "warning", text, many)
        data, frame = ({name: x[fresh] for name, x in old.items()} for old in (data, frame))
    feet, unused = _feet(frame, expected.feet)
    ratio = np.full(len(expected.joints), np.nan) if expected.ratio is None else expected.ratio
    named = zip(expected.joints, ratio.tolist(), strict=True)
    ratio = np.array([mapping.gear_ratio.get(joint, own) for joint, own in named])
    at_motor = _sides(frame, plan, ratio, found)
    left_out = _stand_still(frame, plan)
    derived = _drive(plan, data, frame, found)
    log = Recording(
        name=path.stem,
        frame=pd.DataFrame(frame, copy=False),
        joints=expected.joints,
        effort="",
        at_motor=at_motor,
        feet=feet,
        ratio=ratio,
        gain=mapping.controller.gain_per_rad,
        torque_off_bridge=mapping.controller.torque_off_bridge,
        left_out=left_out,
        derived=derived,
        findings=tuple(found),
        ignored=(*plan.ignored, *(plan.sources[name][0] for name in unused)),
        sha256=sha256(path),
        rules=plan.sources,
    )
    return replace(log, effort=mapping.effort or log.channels[0])


def _fresh(time: Array, where: str) -> Mask:
    """Rows (N,) with a time of their own; a LegwattError for times that are none or run back."""
    bad = ~np.isfinite(time)
    bad[1:] |= np.diff(time) < 0
    if bad.any():
        k = int(np.argmax(bad))
        raise LegwattError(
            f"{where}: row {k + 2}: time {time[k]:.9g} s is no number, or before that of the row "
            "above; drop the row, or sort the rows by time"
        )
    return np.diff(time, prepend=-np.inf) > 0


def _in_si(plan: ReadingPlan, data: MappingType[str, Array]) -> Columns:
    """Every column of the file, and constants that stand for one, (N,) in the log's unit."""
    columns, out, n = plan.expected.columns, Columns(), next(iter(data.values())).size
    if plan.mapping.time.sample_rate is not None:
        out[TIME] = np.arange(n) / plan.mapping.time.sample_rate
    # Time first: columns that are late are read off at other times.
    for name, (column, rule) in sorted(plan.sources.items(), key=lambda s: s[0] != TIME):
        if name in out:  # a rate outranks stamps
            continue
        factor, offset = rule.affine(columns[name].unit)
        values = data[column]
        if (factor, offset) != (1.0, 0.0):
            with np.errstate(over="ignore", invalid="ignore"):
                values = factor * values + offset
        if name != TIME:  # infinities and numbers that no sensor reads are empty cells
            values = np.where(np.abs(values) <= _LARGEST, values, np.nan)
        if rule.late and name != TIME:
            at = out[TIME] + rule.late
            values = np.interp(at, out[TIME], values, left=np.nan, right=np.nan)
        if columns[name].quantity == "temperature" and _live(values):  # cells between may be empty
            ok = np.isfinite(values)
            values = np.asarray(np.interp(out[TIME], out[TIME][ok], values[ok]))
        out[name] = values
    for name, quantity in plan.mapping.constants.items():
        target = columns[name]
        out.setdefault(
            target.name, np.full(n, from_si(to_si(quantity.value, quantity.unit), target.unit))
        )
    return out


def _live(x: Array | None) -> TypeGuard[Array]:
    """Whether a column is there and holds a number."""
    return x is not None and bool(np.isfinite(x).any())


def _sides(frame: Columns, plan: ReadingPlan, ratios: Array, found: Findings) -> bool:
    """Bring positions to the joint's side; True where every one was measured at the motor.

    Two positions tell a gear ratio (J,) that is not known, or another one.
    """
    names = [tuple(column_name(joint, q) for q in POSITIONS) for joint in plan.expected.joints]
    at_motor = not any(place in frame for place, _ in names)
    for (place, column), ratio in zip(names, ratios.tolist(), strict=True):
        motor, here = frame.pop(column, None), frame.get(place)
        if not _live(motor):
            continue
        own = here if _live(here) else np.full_like(motor, np.nan)
        both = np.isfinite(motor) & np.isfinite(own)
        told = both.sum() > 1 and np.ptp(own[both]) > _LEAST_MOTION
        seen = float(np.polyfit(own[both], motor[both], 1)[0]) if told else ratio
        if told and not abs(seen / ratio - 1.0) <= _CONTRADICTS:
            detail = f"gear ratio {seen:.6g} by the two positions, {ratio:.6g} by the files"
            found.note(column, "side", "warning", detail, seen)
            ratio = seen
        elif np.isnan(ratio):
            raise LegwattError(
                f"{plan.source.where}: {column} is at the motor and no gear ratio is known; give "
                "actuators, or the ratio under [gear_ratio] in a mapping file, 1 where it is "
                "divided by it already"
            )
        frame[column if _live(here) else place] = motor / ratio
    return at_motor


def _stand_still(frame: Columns, plan: ReadingPlan) -> dict[str, str]:
    """Put joints that the log does not know at a place; joints that are left out, and why."""
    expected, why = plan.expected, dict[str, str]()
    live = {name for name, x in frame.items() if _live(x)}
    for k, joint in enumerate(expected.joints):
        if (name := column_name(joint, "position")) not in live:
            place = float(np.clip(0.0, expected.lower[k], expected.upper[k]))
            frame[name] = np.full(frame[TIME].size, place)
            why[joint] = (
                f"nothing tells where it stood: taken as still at {place:.4g} rad; a mapping "
                f"file can state {name} under [constants]"
            )
        elif not (plan.derives_torque or live & {column_name(joint, c) for c in EFFORTS}):
            why[joint] = "nothing tells its effort: its motion is used, it is not compared"
    return why


def _feet(frame: Columns, feet: tuple[str, ...]) -> tuple[tuple[str, ...], list[str]]:
    """Take out forces and contacts that not every foot has; the feet, and what is unused.

    Some feet alone do not tell who carries the robot, and lateral forces alone not who stands.
    """
    suffixes = [column.suffix for column in COLUMNS if column.owner == "foot"]
    whole = {s for s in suffixes if all(f"{foot}__{s}" in frame for foot in feet)}
    whole = whole if "force_z_N" in whole else whole & {"contact"}
    unused = [f"{foot}__{s}" for s in suffixes if s not in whole for foot in feet]
    unused = [name for name in unused if frame.pop(name, None) is not None]
    return feet if whole else (), unused


def _drive(
    plan: ReadingPlan, data: MappingType[str, Array], frame: Columns, found: Findings
) -> dict[str, str]:
    """Put rows with a drive off, and efforts by the servos' law, in place; the formulas."""
    gains, joints, derived = plan.mapping.pd_gains, plan.expected.joints, dict[str, str]()
    for joint, column in plan.mapping.torque_enabled.items():
        frame[f"{joint}__{OFF}"] = ~(data[column] > 0.5)
    if gains is not None and plan.derives_torque:
        derived["torque"] = LAW
        wanted = ("position", "velocity", "goal_position", "goal_velocity", "goal_torque")
        for joint in joints:
            named = {q: column_name(joint, q) for q in wanted}
            logged = {q: frame[name] for q, name in named.items() if name in frame}
            torque = gains.torque(joint, logged, frame[TIME])
            off = frame.get(f"{joint}__{OFF}", False)
            frame[column_name(joint, "torque")] = np.where(off, 0.0, torque)
        found.note("", "file", "warning", f"the torque {CANNOT}")
    if plan.supply_alone:
        derived["torque"] = BY_MODEL
        none = np.full(frame[TIME].size, np.nan)
        frame |= {column_name(joint, "torque"): none for joint in joints}
    return derived
