"""From a file's columns to a `Log`: names resolved, units applied, every defect named."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from actuators.arrays import Array
from actuators.errors import LegwattError, one_line
from actuators.units import from_si
from pipeline.logs.formats.convert import sha256
from pipeline.logs.log_format import EFFORTS, Expected, Target, column_name, parse_column
from pipeline.logs.reading.log import BY_MODEL, Log, sides_of
from pipeline.logs.reading.mapping import ColumnTable, Mapping
from pipeline.logs.reading.plan import ReadingPlan, plan_reading
from pipeline.logs.reading.servo_law import CANNOT
from pipeline.logs.reading.table_file import read_columns, stream_columns

_LARGEST: Final = 1e9  # nothing a robot measures is larger in the log's units
_TIME: Final = Target("time", "", "time", "s")


def read_log(path: Path, expected: Expected, mapping: Mapping | None = None) -> Log:
    """Read one log whole: a file of the robot that is expected, with a mapping of its columns.

    Raises:
        LegwattError: The file is unreadable, is not this robot's, or holds no usable measurement.
    """
    plan = plan_reading(path, expected, mapping)
    return _assemble(plan, read_columns(plan.table, plan.columns), 0, sha256(path))


def stream_log(
    path: Path,
    expected: Expected,
    mapping: Mapping | None = None,
    *,
    rows: int = 200_000,
    digest: str = "",
) -> Iterator[Log]:
    """Read a Parquet log in consecutive pieces of at most `rows` rows; `digest` is its SHA-256.

    Raises:
        LegwattError: As for `read_log`; time is checked across pieces, too.
    """
    plan = plan_reading(path, expected, mapping)
    first, last = 0, -np.inf
    for data in stream_columns(plan.table, plan.columns, rows):
        log = _assemble(plan, data, first, digest)
        if log.time[0] <= last:
            raise LegwattError(
                f"{plan.table.where}: row {first + 2}: time {log.time[0]:.9g} s does not follow "
                f"{last:.9g} s; sort the rows by time"
            )
        first, last = first + len(log), float(log.time[-1])
        yield log


def _assemble(plan: ReadingPlan, data: dict[str, Array], first_row: int, digest: str) -> Log:
    """Put columns, of which the first row is the file's `first_row`, in their places."""
    where, expected, mapping = plan.table.where, plan.expected, plan.mapping
    columns = _in_si(plan, data, first_row)
    time = columns[_TIME]
    bad = ~np.isfinite(time)
    if bad.any():
        row = first_row + int(np.argmax(bad)) + 2
        raise LegwattError(f"{where}: row {row}: time is empty or not finite; drop the row")
    step = np.diff(time)
    if (step < 0).any():
        k = int(np.argmax(step < 0))
        raise LegwattError(
            f"{where}: row {first_row + k + 3}: time {time[k + 1]:.9g} s comes after "
            f"{time[k]:.9g} s; sort the rows by time"
        )
    if time.size > 1 and not (step > 0).any():
        raise LegwattError(f"{where}: time never changes from {time[0]:.9g} s")
    fresh = np.concatenate([[True], step > 0])
    base: dict[str, Any] = {
        t.quantity: x for t, x in columns.items() if t.kind in ("base", "supply")
    }
    joints: dict[str, Array] = {}  # quantity to shape (N, J); NaN where it was not measured
    for target, values in columns.items():
        if target.kind == "joint":
            empty = np.full((time.size, len(expected.joints)), np.nan)
            block = joints.setdefault(target.quantity, empty)
            block[:, expected.joints.index(target.owner)] = values
    warm = joints.pop("temperature", None), base.pop("base_temperature", None)
    own, motor = joints.pop("position", None), joints.pop("motor_position", None)
    sides = sides_of(own, motor, expected, mapping.gear_ratio, where)
    position, left_out = _stand_still(sides.position, joints, plan)
    feet, unused = _feet(columns, expected.feet, time.size)
    log = Log(
        name=plan.table.path.stem,
        time=time,
        joints=expected.joints,
        position=position,
        position_source=sides.source,
        motor_position=sides.motor,
        left_out=left_out,
        remarks={column_name(j, "motor_position"): text for j, text in sides.remarks.items()},
        repeated_times=int((~fresh).sum()),
        gain=plan.rule.gain_per_rad,
        torque_off_bridge=mapping.controller.torque_off_bridge,
        constants={name: quantity.si for name, quantity in plan.rule.constants.items()},
        condition=dict(plan.rule.condition),
        locked=tuple(mapping.locked),
        extra={column: data[column] for column in mapping.keep.columns},
        ignored=(*plan.ignored, *(c for t, (c, _) in plan.sources.items() if t in unused)),
        misspelt=dict(plan.misspelt),
        chosen_effort=mapping.effort,
        sha256=digest,
        source=plan.table.path,
        temperature=_warm(*warm, time, len(expected.joints)),
        rules={(t.owner, t.quantity): source for t, source in plan.sources.items()},
        **base
        | joints
        | feet
        | {"notes": plan.table.remarks}
        | _drive(plan, data, joints | {"position": position}, time),
    )
    return log if fresh.all() else log.rows(fresh)


def _in_si(plan: ReadingPlan, data: dict[str, Array], first_row: int) -> dict[Target, Array]:
    """Every quantity of the file, and constants that stand for one, (N,) in the log's unit."""
    where, mapping = plan.table.where, plan.mapping
    out: dict[Target, Array] = {}
    n = next(iter(data.values())).size
    if mapping.time.sample_rate is not None:
        out[_TIME] = (first_row + np.arange(n)) / mapping.time.sample_rate.si
    # Time first: columns that are late are read off at other times.
    for target, (column, rule) in sorted(plan.sources.items(), key=lambda s: s[0] != _TIME):
        values, (factor, offset) = data[column], rule.affine(target.unit)
        if target != _TIME:
            _check_values(values, column, where, first_row)
        if (factor, offset) != (1.0, 0.0):
            values = factor * values + offset
            if target != _TIME:
                _check_values(values, column, f"{where} through {mapping.where}", first_row)
        if rule.late and target != _TIME:
            at = out[_TIME] + rule.late
            values = np.interp(at, out[_TIME], values, left=np.nan, right=np.nan)
        out[target] = values
    for key, quantity in plan.rule.constants.items():
        constant = parse_column(key, plan.expected, mapping.where)
        if constant is not None and constant.kind != "foot" and constant not in out:
            out[constant] = np.full(n, from_si(quantity.si, constant.unit))
    return out


def _warm(own: Array | None, common: Array | None, time: Array, joints: int) -> Array | None:
    """Temperatures (N, J), the machine's own where a joint has none.

    They are slow: samples that come more seldom than rows are joined by straight lines.
    """
    if own is None and common is None:
        return None
    out = np.full((time.size, joints), np.nan) if own is None else own.copy()
    if common is not None:
        out[:, ~np.isfinite(out).any(axis=0)] = common[:, None]
    for column in out.T:
        good = np.isfinite(column)
        if good.any() and not good.all():
            column[:] = np.interp(time, time[good], column[good])
    return out


def _stand_still(
    position: Array, joints: dict[str, Array], plan: ReadingPlan
) -> tuple[Array, dict[str, str]]:
    """Positions (N, J), joints that the log does not know at a place; and what is left out, why."""
    expected, out, why = plan.expected, position.copy(), dict[str, str]()
    duty = plan.mapping.controller.law == "duty"
    if "goal_position" in joints and (duty or plan.derives_torque):
        return out, why
    efforts = [joints[c] for c in EFFORTS if c in joints]
    for k, joint in enumerate(expected.joints):
        if any(np.isfinite(e[:, k]).any() for e in efforts):
            continue
        if not np.isfinite(position[:, k]).any():
            out[:, k] = np.clip(0.0, expected.lower[k], expected.upper[k])
            why[joint] = (
                f"nothing tells where it stood: taken as still at {out[0, k]:.4g} rad; a mapping "
                f"file can state {joint}__position_rad under [constants]"
            )
        elif joint not in plan.mapping.locked:
            why[joint] = "nothing tells its effort: its motion is used, it is not compared"
    return out, why


def _check_values(values: Array, column: str, where: str, first_row: int) -> None:
    bad = np.abs(values) > _LARGEST  # infinities too; NaN is an empty cell
    if bad.any():
        row = int(np.argmax(bad))
        raise LegwattError(
            f"{where}: row {first_row + row + 2}, column '{one_line(column)}' holds "
            f"{values[row]:g}; no sensor reads that, leave the cell empty"
        )


def _feet(
    columns: dict[Target, Array], feet: tuple[str, ...], n: int
) -> tuple[dict[str, Any], set[Target]]:
    """Forces and contacts, where every foot has them (NaN where not measured), and what is unused.

    Some feet alone do not tell who carries the robot, and lateral forces alone not who stands.
    """
    by_quantity: dict[str, dict[str, Array]] = {}
    for target, values in columns.items():
        if target.kind == "foot":
            by_quantity.setdefault(target.quantity, {})[target.owner] = values
    # Where lateral sensors are missing at some feet, those of the others fit no sum of forces.
    whole = {quantity: per for quantity, per in by_quantity.items() if len(per) == len(feet)}
    if "force_z" not in whole:
        whole = {quantity: per for quantity, per in whole.items() if quantity == "contact"}
    unused = {t for t in columns if t.kind == "foot" and t.quantity not in whole}
    out: dict[str, Any] = {"feet": feet} if whole else {}
    if "contact" in whole:
        out["contact"] = np.stack([whole["contact"][foot] > 0.5 for foot in feet], axis=1)
    if "force_z" in whole:
        none = dict.fromkeys(feet, np.full(n, np.nan))
        axes = [whole.get(f"force_{axis}", none) for axis in "xyz"]
        out["foot_force"] = np.stack([[per[foot] for foot in feet] for per in axes]).T
        out["foot_force"] = np.ascontiguousarray(out["foot_force"])
    return out, unused


def _drive(
    plan: ReadingPlan, data: dict[str, Array], joints: dict[str, Array], time: Array
) -> dict[str, Any]:
    """Supply, switched-off rows, and the effort of the servos' own law."""
    mapping, position, out = plan.mapping, joints["position"], dict[str, Any]()
    supply, gains = mapping.supply, mapping.pd_gains
    if supply.column:
        factor, offset = ColumnTable(unit=supply.unit).affine("V")
        out["supply"] = factor * data[supply.column] + offset
    elif supply.voltage is not None:
        out["supply"] = np.full(position.shape[0], supply.voltage.si)
    off = np.zeros(position.shape, dtype=np.bool_)
    if mapping.torque_enabled:
        for joint, column in mapping.torque_enabled.items():
            off[:, plan.expected.joints.index(joint)] = ~(data[column] > 0.5)
        out["torque_off"] = off
    if "voltage" not in joints and plan.derives_voltage:
        # U = U_supply * clip(k (goal - position), -1, 1): the servo's duty, averaged over its PWM.
        gain = plan.rule.gain_per_rad or 0.0
        duty = np.clip(gain * (joints["goal_position"] - position), -1.0, 1.0)
        out["voltage"] = np.where(off, np.nan, out["supply"][:, None] * duty)
        out["derived"] = {"voltage": "supply x clip(gain x (goal - position), -1, 1)"}
    if gains is not None and plan.derives_torque:
        torque = gains.torque(plan.expected.joints, joints, time)
        out["torque"] = np.where(off, 0.0, torque)
        out["derived"] = {"torque": gains.formula(joints)}
        out["notes"] = (*plan.table.remarks, f"the torque {CANNOT}")
    if plan.supply_alone:
        out["torque"], out["derived"] = np.full(position.shape, np.nan), {"torque": BY_MODEL}
    return out
