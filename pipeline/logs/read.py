"""From a file's columns to rows in the log format: names, units, signs; every defect is named."""

from __future__ import annotations

from collections.abc import Mapping as MappingType
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError, one_line
from actuators.units import from_si
from pipeline.logs.formats import sha256
from pipeline.logs.log_format import EFFORTS, FOOT_COLUMNS, TIME, Expected, column_name
from pipeline.logs.mapping import CANNOT, Mapping
from pipeline.logs.plan import ReadingPlan, plan_reading
from pipeline.logs.recording import BY_MODEL, OFF, Findings, Recording

#: Nothing a robot measures is larger in the log's units.
_LARGEST: Final = 1e9
#: Difference from a stated gear ratio, relative, from which the two positions contradict it.
_CONTRADICTS: Final = 0.05
#: How much a joint must move for its two positions to tell their ratio [rad].
_LEAST_MOTION: Final = 0.05
#: Numbers by name in the log format, each (N,).
Columns = dict[str, Any]


def read_log(path: Path, expected: Expected, mapping: Mapping | None = None) -> Recording:
    """Read one log: a file of the robot that is expected, with a mapping of its columns.

    Raises:
        LegwattError: The file is unreadable, is not this robot's, or holds no usable measurement.
    """
    plan = plan_reading(path, expected, mapping)
    where, mapping = plan.source.where, plan.mapping
    wanted = [*(column for column, _ in plan.sources.values()), *mapping.torque_enabled.values()]
    data = plan.source.columns([*dict.fromkeys(wanted)])
    found = Findings(path.stem)
    for remark in plan.source.remarks:
        found.note("", "file", 1, "1", "warning", remark)
    frame = _in_si(plan, data)
    fresh = _fresh(frame[TIME], where)
    if not fresh.all():
        many = int((~fresh).sum())
        text = f"{many} rows with the time of the row before were dropped"
        found.note("time_s", "repeated_times", many, "1", "warning", text)
    feet, unused = _feet(frame, expected.feet)
    at_motor = _sides(frame, plan, found)
    left_out = _stand_still(frame, plan)
    derived = _drive(plan, data, frame, found)
    _warm(frame, expected.joints)
    table = pd.DataFrame(frame, copy=False)
    log = Recording(
        name=path.stem,
        frame=table if fresh.all() else table[fresh].reset_index(drop=True),
        joints=expected.joints,
        effort="",
        at_motor=at_motor,
        feet=feet,
        gain=plan.rule.gain_per_rad,
        torque_off_bridge=mapping.controller.torque_off_bridge,
        left_out=left_out,
        condition=dict(plan.rule.condition),
        derived=derived,
        findings=tuple(found),
        ignored=(*plan.ignored, *(plan.sources[name][0] for name in unused)),
        sha256=sha256(path),
        rules=plan.sources,
    )
    return replace(log, effort=mapping.effort or log.channels[0])


def _fresh(time: Array, where: str) -> Mask:
    """Rows (N,) with a time of their own; a LegwattError for times that are none or run back."""
    bad, step = ~np.isfinite(time), np.diff(time)
    if bad.any():
        raise LegwattError(
            f"{where}: row {int(np.argmax(bad)) + 2}: time is empty or not finite; drop the row"
        )
    if (step < 0).any():
        k = int(np.argmax(step < 0))
        raise LegwattError(
            f"{where}: row {k + 3}: time {time[k + 1]:.9g} s comes after {time[k]:.9g} s; sort the "
            "rows by time"
        )
    if time.size > 1 and not (step > 0).any():
        raise LegwattError(f"{where}: time never changes from {time[0]:.9g} s")
    return np.concatenate([[True], step > 0])


def _in_si(plan: ReadingPlan, data: MappingType[str, Array]) -> Columns:
    """Every column of the file, and constants that stand for one, (N,) in the log's unit."""
    where, mapping, columns = plan.source.where, plan.mapping, plan.expected.columns
    out: Columns = {}
    n = next(iter(data.values())).size
    if mapping.time.sample_rate is not None:
        out[TIME] = np.arange(n) / mapping.time.sample_rate.si
    # Time first: columns that are late are read off at other times.
    for name, (column, rule) in sorted(plan.sources.items(), key=lambda s: s[0] != TIME):
        factor, offset = rule.affine(columns[name].unit)
        values = data[column]
        for by in ("", f" through {mapping.where}"):
            bad = np.abs(values) > _LARGEST  # infinities too; NaN is an empty cell
            if bad.any() and name != TIME:
                row = int(np.argmax(bad))
                raise LegwattError(
                    f"{where}{by}: row {row + 2}, column '{one_line(column)}' holds "
                    f"{values[row]:g}; no sensor reads that, leave the cell empty"
                )
            if by == "" and (factor, offset) != (1.0, 0.0):
                values = factor * values + offset
        if rule.late and name != TIME:
            at = out[TIME] + rule.late
            values = np.interp(at, out[TIME], values, left=np.nan, right=np.nan)
        out[name] = values
    for name, quantity in plan.rule.constants.items():
        if name in columns and name not in out:
            out[name] = np.full(n, from_si(quantity.si, columns[name].unit))
    return out


def _sides(frame: Columns, plan: ReadingPlan, found: Findings) -> bool:
    """Bring positions to the joint's side; True where every one was measured at the motor.

    A gear ratio comes from the mapping, else the actuator, else the two positions themselves.
    """
    expected = plan.expected
    any_own = any(column_name(joint, "position") in frame for joint in expected.joints)
    for k, joint in enumerate(expected.joints):
        column, place = column_name(joint, "motor_position"), column_name(joint, "position")
        motor, here = frame.pop(column, None), frame.get(place)
        if motor is None or not np.isfinite(motor).any():
            continue
        here = here if here is not None and np.isfinite(here).any() else None
        seen = _slope(motor, here) if here is not None else None
        stated = None if expected.ratio is None else float(expected.ratio[k])
        stated = plan.mapping.gear_ratio.get(joint, stated)
        ratio, remark = stated or 1.0, ""
        if seen is not None and stated is None:
            ratio, remark = seen, f"gear ratio {seen:.6g} from the two positions; no file states it"
        elif seen is not None and abs(seen - 1.0) <= _CONTRADICTS < abs(seen / ratio - 1.0):
            ratio, remark = 1.0, "the motor's position is divided by the gear ratio already"
        elif seen is not None and abs(seen / ratio - 1.0) > _CONTRADICTS:
            remark = f"gear ratio {seen:.6g} by the two positions, {ratio:.6g} by the files"
            ratio = seen
        elif seen is None and stated is None:
            low, high = float(expected.lower[k]), float(expected.upper[k])
            if not np.isfinite(high - low):
                low, high = -np.pi, np.pi
            if max(low - np.nanmin(motor), np.nanmax(motor) - high) > 0.05 * (high - low):
                raise LegwattError(
                    f"{plan.source.where}: {joint}__motor_position_rad leaves the joint's limits "
                    "and no gear ratio is known; give actuators, or the ratio under [gear_ratio] "
                    "in a mapping file"
                )
            remark = "no gear ratio is known: taken as divided by it already, as it stays within "
            remark += "the joint's limits; else state it under [gear_ratio] in a mapping file"
        frame[column if here is not None else place] = motor / ratio
        if here is None and any_own:
            remark = (
                "has a motor-side position alone, other joints have a joint-side one: what "
                "its gear winds up or plays is taken for the joint's motion"
            )
        if remark:
            found.note(column, "side", 1, "1", "warning", remark)
    return not any_own


def _slope(motor: Array, joint: Array) -> float | None:
    """Turns of the motor per turn of the joint; None where the joint hardly moves."""
    good = np.isfinite(motor) & np.isfinite(joint)
    if good.sum() < 2 or np.ptp(joint[good]) < _LEAST_MOTION:
        return None
    x = joint[good] - joint[good].mean()
    return float(x @ (motor[good] - motor[good].mean()) / (x @ x))


def _stand_still(frame: Columns, plan: ReadingPlan) -> dict[str, str]:
    """Put joints that the log does not know at a place; joints that are left out, and why."""
    expected, why = plan.expected, dict[str, str]()
    live = {name for name, x in frame.items() if np.isfinite(x).any()}
    for k, joint in enumerate(expected.joints):
        efforts = {column_name(joint, channel) for channel in EFFORTS}
        if (name := column_name(joint, "position")) not in live:
            place = float(np.clip(0.0, expected.lower[k], expected.upper[k]))
            frame[name] = np.full(frame[TIME].size, place)
            why[joint] = (
                f"nothing tells where it stood: taken as still at {place:.4g} rad; a mapping "
                f"file can state {name} under [constants]"
            )
        elif not (plan.derives_torque or live & efforts):
            why[joint] = "nothing tells its effort: its motion is used, it is not compared"
    return why


def _feet(frame: Columns, feet: tuple[str, ...]) -> tuple[tuple[str, ...], list[str]]:
    """Take out forces and contacts that not every foot has; the feet, and what is unused.

    Some feet alone do not tell who carries the robot, and lateral forces alone not who stands.
    """
    whole = [
        suffix for suffix in FOOT_COLUMNS if all(f"{foot}__{suffix}" in frame for foot in feet)
    ]
    if "force_z_N" not in whole:
        whole = [suffix for suffix in whole if suffix == "contact"]
    every = [f"{foot}__{suffix}" for suffix in FOOT_COLUMNS for foot in feet]
    unused = [n for n in every if n in frame and n.rpartition("__")[2] not in whole]
    for name in unused:
        del frame[name]
    return feet if whole else (), unused


def _drive(
    plan: ReadingPlan, data: MappingType[str, Array], frame: Columns, found: Findings
) -> dict[str, str]:
    """Put rows with a drive off, and efforts by the servos' law, in place; the formulas."""
    mapping, names, derived = plan.mapping, plan.expected.joints, dict[str, str]()
    none = np.full(frame[TIME].size, np.nan)
    for joint, column in mapping.torque_enabled.items():
        frame[f"{joint}__{OFF}"] = ~(data[column] > 0.5)
    if mapping.pd_gains is not None and plan.derives_torque:
        wanted = ("position", "velocity", "goal_position", "goal_velocity", "goal_torque")
        columns = {q: [frame.get(column_name(joint, q)) for joint in names] for q in wanted}
        channels = {
            quantity: np.stack([none if x is None else x for x in own], axis=1)
            for quantity, own in columns.items()
            if any(x is not None for x in own)
        }
        torque, derived["torque"] = mapping.pd_gains.torque(names, channels, frame[TIME])
        for joint, values in zip(names, torque.T, strict=True):
            off = frame.get(f"{joint}__{OFF}", False)
            frame[column_name(joint, "torque")] = np.where(off, 0.0, values)
        found.note("", "file", 1, "1", "warning", f"the torque {CANNOT}")
    if plan.supply_alone:
        derived["torque"] = BY_MODEL
        frame |= {column_name(joint, "torque"): none for joint in names}
    return derived


def _warm(frame: Columns, joints: tuple[str, ...]) -> None:
    """Temperatures of joints, the machine's own where one has none; straight between samples."""
    common, time = frame.pop(column_name("base", "base_temperature"), None), frame[TIME]
    for name in (column_name(joint, "temperature") for joint in joints):
        for mine in (frame.get(name), common):
            if mine is not None and (good := np.isfinite(mine)).any():
                frame[name] = np.interp(time, time[good], mine[good])
                break
