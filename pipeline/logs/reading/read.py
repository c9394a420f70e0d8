"""From a file's columns to a `Log`: names resolved, units applied, every defect named."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from actuators.errors import one_line
from actuators.units import from_si
from pipeline.logs.errors import LogContentError
from pipeline.logs.reading.expected import Expected
from pipeline.logs.reading.log import EFFORTS, Log
from pipeline.logs.reading.log_format import TIME, parse_column
from pipeline.logs.reading.mapping import ColumnRule, Mapping
from pipeline.logs.reading.plan import ReadingPlan, derives_voltage, plan_reading
from pipeline.logs.reading.sides import sides_of
from pipeline.logs.reading.table_file import read_columns, sha256, stream_columns

Array = NDArray[np.float64]
_LARGEST: Final = 1e9  # nothing a robot measures is larger in the log's units


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
    arrays, force = _arrays(plan, data, n, first_row)
    arrays["time"] = _time(plan, data, n, first_row)
    fresh = _check_time(arrays["time"], where, first_row)
    sides = sides_of(
        arrays.pop("position", None),
        arrays.pop("motor_position", None),
        expected,
        mapping.ratio,
        where,
    )
    position, left_out = _stand_still(sides.position, arrays, plan)
    arrays |= {"position": position, "motor_position": sides.motor}
    unused = _feet(arrays, force, expected)
    ignored = [s.column for t, s in plan.sources.items() if (t.owner, t.quantity) in unused]
    _drive(plan, data, arrays, n)
    log = Log(
        name=plan.table.path.stem,
        joints=expected.joints,
        position_source=sides.source,
        left_out=left_out,
        remarks={f"{j}__motor_position_rad": text for j, text in sides.remarks.items()},
        repeated_times=int((~fresh).sum()),
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
        rules={(t.owner, t.quantity): (s.column, s.rule) for t, s in plan.sources.items()},
        **arrays,
    )
    return log if fresh.all() else log.rows(fresh)


def _time(plan: ReadingPlan, data: dict[str, Array], n: int, first_row: int) -> Array:
    """Of every row, (N,) [s]; in the file's order, whatever it is."""
    if plan.mapping.sample_rate is not None:
        return (first_row + np.arange(n)) / plan.mapping.sample_rate
    source = next(s for target, s in plan.sources.items() if target.kind == "time")
    return source.factor * data[source.column] + source.offset


def _arrays(
    plan: ReadingPlan, data: dict[str, Array], n: int, first_row: int
) -> tuple[dict[str, Any], dict[tuple[str, str], Array]]:
    """Attributes of the log by name, and forces and contacts by foot and quantity.

    Raises:
        LogContentError: Values that no robot measures.
    """
    where, expected, mapping = plan.table.where, plan.expected, plan.mapping
    arrays: dict[str, Any] = {}
    force: dict[tuple[str, str], Array] = {}
    by_joint: dict[str, dict[str, Array]] = {}
    time = _time(plan, data, n, first_row)
    for target, source in plan.sources.items():
        values = data[source.column]
        _check_values(values, source.column, where, first_row)
        if (source.factor, source.offset) != (1.0, 0.0):
            values = source.factor * values + source.offset
            _check_values(values, source.column, f"{where} through {mapping.where}", first_row)
        if source.rule.late and target.kind != "time":
            values = np.interp(time + source.rule.late, time, values, left=np.nan, right=np.nan)
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
    return arrays, force


def _stand_still(
    position: Array, arrays: dict[str, Any], plan: ReadingPlan
) -> tuple[Array, dict[str, str]]:
    """Give joints that the log does not know a place to stand.

    Returns:
        Positions, shape (N, J), and joints that cannot be compared, with the reason.
    """
    expected, mapping = plan.expected, plan.mapping
    out, why = position.copy(), {}
    efforts = [arrays[c] for c in EFFORTS if c in arrays]
    derived = mapping.law == "duty" and "goal_position" in arrays
    for k, joint in enumerate(expected.joints):
        compared = derived or any(np.isfinite(e[:, k]).any() for e in efforts)
        if not compared and not np.isfinite(position[:, k]).any():
            out[:, k] = np.clip(0.0, expected.lower[k], expected.upper[k])
            why[joint] = (
                f"nothing tells where it stood: taken as still at {out[0, k]:.4g} rad; a mapping "
                f"file can state {joint}__position_rad under [constants]"
            )
        elif not compared and joint not in mapping.locked:
            why[joint] = "nothing tells its effort: its motion is used, it is not compared"
    return out, why


def _check_values(values: Array, column: str, where: str, first_row: int) -> None:
    bad = np.abs(values) > _LARGEST  # infinities too; NaN is an empty cell
    if column != TIME and bad.any():
        row = int(np.argmax(bad))
        raise LogContentError(
            f"{where}: row {first_row + row + 2}, column '{one_line(column)}' holds "
            f"{values[row]:g}; no sensor reads that, leave the cell empty"
        )


def _check_time(time: Array, where: str, first_row: int) -> NDArray[np.bool_]:
    """Refuse time that is missing or runs backward; returns the rows whose time is new, (N,)."""
    bad = ~np.isfinite(time)
    if bad.any():
        row = first_row + int(np.argmax(bad)) + 2
        raise LogContentError(f"{where}: row {row}: time is empty or not finite; drop the row")
    step = np.diff(time)
    if (step < 0).any():
        k = int(np.argmax(step < 0))
        raise LogContentError(
            f"{where}: row {first_row + k + 3}: time {time[k + 1]:.9g} s comes after "
            f"{time[k]:.9g} s; sort the rows by time"
        )
    if time.size > 1 and not (step > 0).any():
        raise LogContentError(f"{where}: time never changes from {time[0]:.9g} s")
    return np.concatenate([[True], step > 0])


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
    if "voltage" not in arrays and derives_voltage(plan, have):
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
