"""From a file's columns to rows in the log format: names, units, signs; every defect is named."""

from __future__ import annotations

from collections.abc import Mapping as MappingType
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError, one_line
from actuators.units import from_si
from pipeline.logs.errors import Findings
from pipeline.logs.formats import sha256
from pipeline.logs.log_format import EFFORTS, TIME, Expected, Target, column_name
from pipeline.logs.mapping import CANNOT, Mapping
from pipeline.logs.plan import ReadingPlan, plan_reading
from pipeline.logs.recording import BY_MODEL, OFF, Recording

#: Nothing a robot measures is larger in the log's units.
_LARGEST: Final = 1e9
#: Difference from a stated gear ratio, relative, from which the two positions contradict it.
_CONTRADICTS: Final = 0.05
#: How much a joint must move for its two positions to tell their ratio [rad].
_LEAST_MOTION: Final = 0.05
_TIME: Final = Target("time", "", "time", "s")
#: Numbers by owner and quantity, each (N,).
Columns = dict[tuple[str, str], Any]


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
    columns = _in_si(plan, data)
    time = columns.pop(_TIME)
    fresh = _fresh(time, where)
    if not fresh.all():
        many = int((~fresh).sum())
        text = f"{many} rows with the time of the row before were dropped"
        found.note("time_s", "repeated_times", many, "1", "warning", text)
    frame: dict[str, Any] = {TIME: time}
    feet, unused = _feet(columns, expected.feet, frame)
    own: Columns = {
        (t.owner or t.kind, t.quantity): x for t, x in columns.items() if t[0] != "foot"
    }
    at_motor = _sides(own, plan, found)
    left_out = _stand_still(own, plan, time.size)
    derived = _drive(plan, data, own, time, found)
    _warm(own, expected.joints, time)
    frame |= {
        f"{owner}__{OFF}" if quantity == OFF else column_name(owner, quantity): values
        for (owner, quantity), values in own.items()
    }
    table = pd.DataFrame(frame, copy=False)
    every = {quantity for _, quantity in own}
    return Recording(
        name=path.stem,
        frame=table if fresh.all() else table[fresh].reset_index(drop=True),
        joints=expected.joints,
        effort=mapping.effort or next(channel for channel in EFFORTS if channel in every),
        at_motor=at_motor,
        feet=feet,
        gain=plan.rule.gain_per_rad,
        torque_off_bridge=mapping.controller.torque_off_bridge,
        left_out=left_out,
        condition=dict(plan.rule.condition),
        derived=derived,
        findings=tuple(found),
        ignored=(*plan.ignored, *(c for t, (c, _) in plan.sources.items() if t in unused)),
        sha256=sha256(path),
        rules={(t.owner, t.quantity): source for t, source in plan.sources.items()},
    )


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


def _in_si(plan: ReadingPlan, data: MappingType[str, Array]) -> dict[Target, Array]:
    """Every quantity of the file, and constants that stand for one, (N,) in the log's unit."""
    where, mapping = plan.source.where, plan.mapping
    out: dict[Target, Array] = {}
    n = next(iter(data.values())).size
    if mapping.time.sample_rate is not None:
        out[_TIME] = np.arange(n) / mapping.time.sample_rate.si
    # Time first: columns that are late are read off at other times.
    for target, (column, rule) in sorted(plan.sources.items(), key=lambda s: s[0] != _TIME):
        factor, offset = rule.affine(target.unit)
        values = data[column]
        for by in ("", f" through {mapping.where}"):
            bad = np.abs(values) > _LARGEST  # infinities too; NaN is an empty cell
            if bad.any() and target != _TIME:
                row = int(np.argmax(bad))
                raise LegwattError(
                    f"{where}{by}: row {row + 2}, column '{one_line(column)}' holds "
                    f"{values[row]:g}; no sensor reads that, leave the cell empty"
                )
            if by == "" and (factor, offset) != (1.0, 0.0):
                values = factor * values + offset
        if rule.late and target != _TIME:
            at = out[_TIME] + rule.late
            values = np.interp(at, out[_TIME], values, left=np.nan, right=np.nan)
        out[target] = values
    for key, quantity in plan.rule.constants.items():
        constant = plan.expected.columns.get(key)
        if constant is not None and constant.kind != "foot" and constant not in out:
            out[constant] = np.full(n, from_si(quantity.si, constant.unit))
    return out


def _sides(own: Columns, plan: ReadingPlan, found: Findings) -> bool:
    """Bring positions to the joint's side; True where every one was measured at the motor.

    A gear ratio comes from the mapping, else the actuator, else the two positions themselves.
    """
    expected, any_own = plan.expected, any(quantity == "position" for _, quantity in own)
    for k, joint in enumerate(expected.joints):
        motor, here = own.pop((joint, "motor_position"), None), own.get((joint, "position"))
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
        own[joint, "motor_position" if here is not None else "position"] = motor / ratio
        if here is None and any_own:
            remark = (
                "has a motor-side position alone, other joints have a joint-side one: what "
                "its gear winds up or plays is taken for the joint's motion"
            )
        if remark:
            column = column_name(joint, "motor_position")
            found.note(column, "side", 1, "1", "warning", remark)
    return not any_own


def _slope(motor: Array, joint: Array) -> float | None:
    """Turns of the motor per turn of the joint; None where the joint hardly moves."""
    good = np.isfinite(motor) & np.isfinite(joint)
    if good.sum() < 2 or np.ptp(joint[good]) < _LEAST_MOTION:
        return None
    x = joint[good] - joint[good].mean()
    return float(x @ (motor[good] - motor[good].mean()) / (x @ x))


def _stand_still(own: Columns, plan: ReadingPlan, rows: int) -> dict[str, str]:
    """Put joints that the log does not know at a place; joints that are left out, and why."""
    expected, why = plan.expected, dict[str, str]()
    live = {key for key, x in own.items() if np.isfinite(x).any()}
    for k, joint in enumerate(expected.joints):
        if (joint, "position") not in live:
            place = float(np.clip(0.0, expected.lower[k], expected.upper[k]))
            own[joint, "position"] = np.full(rows, place)
            why[joint] = (
                f"nothing tells where it stood: taken as still at {place:.4g} rad; a mapping "
                f"file can state {joint}__position_rad under [constants]"
            )
        elif not (plan.derives_torque or live & {(joint, channel) for channel in EFFORTS}):
            why[joint] = "nothing tells its effort: its motion is used, it is not compared"
    return why


def _feet(
    columns: dict[Target, Array], feet: tuple[str, ...], frame: dict[str, Array]
) -> tuple[tuple[str, ...], set[Target]]:
    """Put forces and contacts that every foot has into the frame; the feet, and what is unused.

    Some feet alone do not tell who carries the robot, and lateral forces alone not who stands.
    """
    by_quantity: dict[str, dict[str, Array]] = {}
    for target, values in columns.items():
        if target.kind == "foot":
            by_quantity.setdefault(target.quantity, {})[target.owner] = values
    whole = {quantity: per for quantity, per in by_quantity.items() if len(per) == len(feet)}
    if "force_z" not in whole:
        whole = {quantity: per for quantity, per in whole.items() if quantity == "contact"}
    for quantity, per in whole.items():
        unit = "" if quantity == "contact" else "_N"
        frame |= {f"{foot}__{quantity}{unit}": per[foot] for foot in feet}
    unused = {t for t in columns if t.kind == "foot" and t.quantity not in whole}
    return feet if whole else (), unused


def _drive(
    plan: ReadingPlan,
    data: MappingType[str, Array],
    own: Columns,
    time: Array,
    found: Findings,
) -> dict[str, str]:
    """Put supply, rows with a drive off, and efforts by the servos' law in place; the formulas."""
    mapping, names, derived = plan.mapping, plan.expected.joints, dict[str, str]()
    none = np.full(time.size, np.nan)
    for joint, column in mapping.torque_enabled.items():
        own[joint, OFF] = ~(data[column] > 0.5)
    if mapping.pd_gains is not None and plan.derives_torque:
        every = {quantity for _, quantity in own}
        wanted = ("position", "velocity", "goal_position", "goal_velocity", "goal_torque")
        channels = {
            quantity: np.stack([own.get((joint, quantity), none) for joint in names], axis=1)
            for quantity in wanted
            if quantity in every
        }
        torque, derived["torque"] = mapping.pd_gains.torque(names, channels, time)
        for joint, values in zip(names, torque.T, strict=True):
            own[joint, "torque"] = np.where(own.get((joint, OFF), False), 0.0, values)
        found.note("", "file", 1, "1", "warning", f"the torque {CANNOT}")
    if plan.supply_alone:
        derived["torque"] = BY_MODEL
        own |= {(joint, "torque"): none for joint in names}
    return derived


def _warm(own: Columns, joints: tuple[str, ...], time: Array) -> None:
    """Temperatures of joints, the machine's own where one has none; straight between samples."""
    common = own.pop(("base", "base_temperature"), None)
    for joint in joints:
        for mine in (own.get((joint, "temperature")), common):
            if mine is not None and (good := np.isfinite(mine)).any():
                own[joint, "temperature"] = np.interp(time, time[good], mine[good])
                break
