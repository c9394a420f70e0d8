"""From a file's columns to rows in the log format: names, units, signs; every defect is named."""

from __future__ import annotations

from collections.abc import Mapping as MappingType
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError, closest, one_line
from actuators.units import from_si
from pipeline.logs.errors import Finding, Findings
from pipeline.logs.formats import sha256
from pipeline.logs.log_format import EFFORTS, TIME, Expected, Target, column_name, parse_column
from pipeline.logs.mapping import CANNOT, ColumnTable, Mapping
from pipeline.logs.plan import ReadingPlan, plan_reading

#: Nothing a robot measures is larger in the log's units.
_LARGEST: Final = 1e9
#: Difference from a stated gear ratio, relative, from which the two positions contradict it.
_CONTRADICTS: Final = 0.05
#: How much a joint must move for its two positions to tell their ratio [rad].
_LEAST_MOTION: Final = 0.05
#: Where the torque of a log without any effort, for `gap power`, comes from.
BY_MODEL: Final = "none logged: the model's stands in"
_TIME: Final = Target("time", "", "time", "s")
#: Rows in which a drive was switched off, a column that no file has.
OFF: Final = "torque_off"


@dataclass(frozen=True, eq=False)
class Recording:
    """Rows of a log as they were read, SI, in the columns of the log format.

    The sign of torque, current, voltage and velocity is the joint's; power is positive from supply
    to motor. What a channel did not measure is NaN. Positions are the joint's; where the motor's
    was measured, too, it is divided by the ratio.
    """

    name: str  #: The file's stem.
    frame: pd.DataFrame  #: Rows by time, N of them.
    joints: tuple[str, ...]  #: Of the robot, in its order.
    effort: str  #: The channel that is compared, a key of `EFFORTS`.
    at_motor: bool = False  #: Whether positions were measured at the motor's side of the gear.
    feet: tuple[str, ...] = ()  #: Legs whose feet were measured.
    gain: float | None = None  #: Of the controller, duty per position error [1/rad].
    #: ``"open"`` (no current flows) or ``"shorted"`` where the drive is off.
    torque_off_bridge: str | None = None
    locked: tuple[str, ...] = ()  #: Joints that stood still on purpose.
    left_out: MappingType[str, str] = field(default_factory=dict)  #: Joint to why.
    #: What distinguishes this log from others, e.g. ``{"payload": 0.5}``.
    condition: MappingType[str, float | str] = field(default_factory=dict)
    #: Channels that were computed from others by the mapping, with the formula.
    derived: MappingType[str, str] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()  #: What reading saw.
    ignored: tuple[str, ...] = ()  #: Columns of the file that were not used.
    sha256: str = ""  #: Of the file.
    #: Owner and quantity to the file's column and the mapping's rule for it.
    rules: MappingType[tuple[str, str], tuple[str, ColumnTable]] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.frame)

    @property
    def time(self) -> Array:
        """Strictly increasing, shape (N,) [s]."""
        return self.frame[TIME].to_numpy()

    def column(self, joint: str, quantity: str) -> Array | None:
        """One joint's column (N,), read-only; None where there is none."""
        name = column_name(joint, quantity)
        return self.frame[name].to_numpy() if name in self.frame else None

    def of(self, quantity: str) -> Array | None:
        """A quantity of all joints, (N, J), or of base or supply, (N,); None where nothing has it.

        Joints without the column are NaN.
        """
        owner = quantity.partition("_")[0]
        if owner in ("base", "supply"):
            return self.column(owner, quantity)
        columns = [self.column(joint, quantity) for joint in self.joints]
        if all(x is None for x in columns):
            return None
        none = np.full(len(self), np.nan)
        return np.stack([none if x is None else x for x in columns], axis=1)

    @property
    def position(self) -> Array:
        """Shape (N, J) [rad]."""
        found = self.of("position")
        assert found is not None
        return found

    @property
    def position_quantity(self) -> str:
        """Key of the position's columns in the log format."""
        return "motor_position" if self.at_motor else "position"

    @property
    def unit(self) -> str:
        """Of the compared effort."""
        return EFFORTS[self.effort]

    @property
    def channels(self) -> tuple[str, ...]:
        """Effort channels the log has, the most direct first."""
        return tuple(
            key for key in EFFORTS if any(column_name(j, key) in self.frame for j in self.joints)
        )

    @property
    def supply_alone(self) -> bool:
        """Whether no effort of any joint is logged, and the supply's power or current is."""
        return BY_MODEL in self.derived.values()

    @property
    def torque_off(self) -> Mask | None:
        """Where the drive was switched off, shape (N, J), or None."""
        names = [f"{joint}__{OFF}" for joint in self.joints]
        none = np.zeros(len(self), dtype=np.bool_)
        if not any(name in self.frame for name in names):
            return None
        every = [self.frame[n].to_numpy() if n in self.frame else none for n in names]
        return np.stack(every, axis=1)

    @property
    def foot_force(self) -> Array | None:
        """Of the world on the robot, shape (N, F, 3) [N]; NaN components were not measured."""
        if not self.feet or f"{self.feet[0]}__force_z_N" not in self.frame:
            return None
        out = np.full((len(self), len(self.feet), 3), np.nan)
        for k, foot in enumerate(self.feet):
            for axis in range(3):
                name = f"{foot}__force_{'xyz'[axis]}_N"
                out[:, k, axis] = self.frame[name].to_numpy() if name in self.frame else np.nan
        return out

    @property
    def contact(self) -> Mask | None:
        """Where feet stand by their own columns, shape (N, F)."""
        names = [f"{foot}__contact" for foot in self.feet]
        if not names or names[0] not in self.frame:
            return None
        return np.stack([self.frame[name].to_numpy() > 0.5 for name in names], axis=1)

    def with_changes(self, **changes: Any) -> Recording:
        """The same log with some attributes replaced."""
        return replace(self, **changes)

    def compared_in(self, channel: str) -> Recording:
        """The same log compared in another channel; a LegwattError where it has none."""
        if channel not in self.channels:
            raise LegwattError(
                f"{self.name}: no {channel} channel in the log; {closest(channel, self.channels)}"
            )
        return replace(self, effort=channel)


def read_log(path: Path, expected: Expected, mapping: Mapping | None = None) -> Recording:
    """Read one log: a file of the robot that is expected, with a mapping of its columns.

    Raises:
        LegwattError: The file is unreadable, is not this robot's, or holds no usable measurement.
    """
    plan = plan_reading(path, expected, mapping)
    where, mapping = plan.source.where, plan.mapping
    data = plan.source.columns(plan.columns)
    columns = _in_si(plan, data)
    time = columns.pop(_TIME)
    fresh = _fresh(time, where)
    joints: dict[str, dict[str, Array]] = {}  # joint to quantity to numbers
    frame: dict[str, Any] = {TIME: time}
    for target, values in columns.items():
        if target.kind == "joint":
            joints.setdefault(target.owner, {})[target.quantity] = values
        elif target.kind != "foot":
            frame[column_name(target.kind, target.quantity)] = values
    found = Findings(path.stem)
    for remark in plan.source.remarks:
        found.note("", "file", 1, "1", "warning", remark)
    at_motor = _sides(joints, plan, found)
    left_out = _stand_still(joints, plan, time.size)
    feet, unused = _feet(columns, expected.feet, frame)
    derived, off = _drive(plan, data, joints, frame, found)
    _warm(joints, frame, plan, time)
    if not fresh.all():
        many = int((~fresh).sum())
        text = f"{many} rows with the time of the row before were dropped"
        found.note("time_s", "repeated_times", many, "1", "warning", text)
    for column, meant in plan.misspelt.items():
        text = f"is ignored: no column of the log format; did you mean '{meant}'?"
        found.note(column, "ignored", 1, "1", "warning", text)
    for joint, own in joints.items():
        frame |= {column_name(joint, quantity): values for quantity, values in own.items()}
    frame |= {f"{joint}__{OFF}": rows for joint, rows in off.items()}
    table = pd.DataFrame(frame, copy=False)
    every = {quantity for own in joints.values() for quantity in own}
    return Recording(
        name=path.stem,
        frame=table if fresh.all() else table[fresh].reset_index(drop=True),
        joints=expected.joints,
        effort=mapping.effort or next(channel for channel in EFFORTS if channel in every),
        at_motor=at_motor,
        feet=feet,
        gain=plan.rule.gain_per_rad,
        torque_off_bridge=mapping.controller.torque_off_bridge,
        locked=tuple(mapping.locked),
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
    bad = ~np.isfinite(time)
    if bad.any():
        row = int(np.argmax(bad)) + 2
        raise LegwattError(f"{where}: row {row}: time is empty or not finite; drop the row")
    step = np.diff(time)
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
        values, (factor, offset) = data[column], rule.affine(target.unit)
        if target != _TIME:
            _check_values(values, column, where)
        if (factor, offset) != (1.0, 0.0):
            values = factor * values + offset
            if target != _TIME:
                _check_values(values, column, f"{where} through {mapping.where}")
        if rule.late and target != _TIME:
            at = out[_TIME] + rule.late
            values = np.interp(at, out[_TIME], values, left=np.nan, right=np.nan)
        out[target] = values
    for key, quantity in plan.rule.constants.items():
        constant = parse_column(key, plan.expected, mapping.where)
        if constant is not None and constant.kind != "foot" and constant not in out:
            out[constant] = np.full(n, from_si(quantity.si, constant.unit))
    return out


def _check_values(values: Array, column: str, where: str) -> None:
    bad = np.abs(values) > _LARGEST  # infinities too; NaN is an empty cell
    if bad.any():
        row = int(np.argmax(bad))
        raise LegwattError(
            f"{where}: row {row + 2}, column '{one_line(column)}' holds {values[row]:g}; no sensor "
            "reads that, leave the cell empty"
        )


def _sides(joints: dict[str, dict[str, Array]], plan: ReadingPlan, found: Findings) -> bool:
    """Bring positions to the joint's side; True where every one was measured at the motor.

    A gear ratio comes from the mapping, else from the actuator, else from the two positions
    themselves; a motor's position alone without any of them is taken as divided by the ratio
    already where it stays within the joint's limits.
    """
    expected = plan.expected
    live = {j: {q for q, x in own.items() if np.isfinite(x).any()} for j, own in joints.items()}
    any_own = any("position" in own for own in joints.values())
    for k, joint in enumerate(expected.joints):
        own = joints.get(joint, {})
        if "motor_position" not in live.get(joint, ()):
            own.pop("motor_position", None)
            continue
        motor, here = own["motor_position"], "position" in live[joint]
        seen = _slope(motor, own["position"]) if here else None
        stated = None if expected.ratio is None else float(expected.ratio[k])
        ratio, remark = _ratio(plan.mapping.gear_ratio.get(joint, stated), seen)
        if ratio is None:
            low, high = float(expected.lower[k]), float(expected.upper[k])
            if not (np.isfinite(low) and np.isfinite(high)):
                low, high = -np.pi, np.pi
            margin = 0.05 * (high - low)
            if np.nanmin(motor) < low - margin or np.nanmax(motor) > high + margin:
                raise LegwattError(
                    f"{plan.source.where}: {joint}__motor_position_rad leaves the joint's limits "
                    "and no gear ratio is known; give actuators, or the ratio under [gear_ratio] "
                    "in a mapping file"
                )
            remark = (
                "no gear ratio is known: taken as divided by it already, since it stays within "
                "the joint's limits; else state it under [gear_ratio] in a mapping file"
            )
        own["motor_position"] = motor / (ratio or 1.0)
        if not here:
            own["position"] = own.pop("motor_position")
            if any_own:
                remark = (
                    "has a motor-side position alone, other joints have a joint-side one: what "
                    "its gear winds up or plays is taken for the joint's motion"
                )
        if remark:
            column = column_name(joint, "motor_position")
            found.note(column, "side", 1, "1", "warning", remark)
    return not any_own


def _ratio(known: float | None, seen: float | None) -> tuple[float | None, str]:
    """The ratio to divide by, and what is odd about it."""
    if seen is None:
        return known, ""
    if known is None:
        return seen, f"gear ratio {seen:.6g} from the two positions; no file states it"
    if abs(seen / known - 1.0) <= _CONTRADICTS:
        return known, ""
    if abs(seen - 1.0) <= _CONTRADICTS:
        return 1.0, "the motor's position is divided by the gear ratio already: taken as it is"
    return seen, f"gear ratio {seen:.6g} by the two positions, {known:.6g} by the files"


def _slope(motor: Array, joint: Array) -> float | None:
    """Turns of the motor per turn of the joint; None where the joint hardly moves."""
    good = np.isfinite(motor) & np.isfinite(joint)
    if good.sum() < 2 or np.ptp(joint[good]) < _LEAST_MOTION:
        return None
    x = joint[good] - joint[good].mean()
    return float(x @ (motor[good] - motor[good].mean()) / (x @ x))


def _stand_still(
    joints: dict[str, dict[str, Array]], plan: ReadingPlan, rows: int
) -> dict[str, str]:
    """Put joints that the log does not know at a place; joints that are left out, and why."""
    expected, why = plan.expected, dict[str, str]()
    for k, joint in enumerate(expected.joints):
        own = joints.setdefault(joint, {})
        if any(c in own and np.isfinite(own[c]).any() for c in EFFORTS):
            continue
        driven = plan.mapping.controller.law == "duty" or plan.derives_torque
        if driven and "goal_position" in plan.quantities:
            continue
        if "position" not in own or not np.isfinite(own["position"]).any():
            place = float(np.clip(0.0, expected.lower[k], expected.upper[k]))
            own["position"] = np.full(rows, place)
            why[joint] = (
                f"nothing tells where it stood: taken as still at {place:.4g} rad; a mapping "
                f"file can state {joint}__position_rad under [constants]"
            )
        elif joint not in plan.mapping.locked:
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
    # Where lateral sensors are missing at some feet, those of the others fit no sum of forces.
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
    joints: dict[str, dict[str, Array]],
    frame: dict[str, Array],
    found: Findings,
) -> tuple[dict[str, str], dict[str, Mask]]:
    """Put supply and efforts by the servos' law in place; formulas, and rows off by joint."""
    mapping, names, rows = plan.mapping, plan.expected.joints, frame[TIME].size
    if mapping.supply.column:
        factor, offset = ColumnTable(unit=mapping.supply.unit).affine("V")
        frame["supply__voltage_V"] = factor * data[mapping.supply.column] + offset
    elif mapping.supply.voltage is not None:
        frame["supply__voltage_V"] = np.full(rows, mapping.supply.voltage.si)
    off = {joint: ~(data[column] > 0.5) for joint, column in mapping.torque_enabled.items()}
    derived: dict[str, str] = {}
    if plan.derives_voltage and not any("voltage" in own for own in joints.values()):
        # U = U_supply * clip(k (goal - position), -1, 1): the servo's duty, averaged over its PWM.
        derived["voltage"] = "supply x clip(gain x (goal - position), -1, 1)"
        for joint, own in joints.items():
            error = (plan.rule.gain_per_rad or 0.0) * (own["goal_position"] - own["position"])
            voltage = frame["supply__voltage_V"] * np.clip(error, -1.0, 1.0)
            own["voltage"] = np.where(off.get(joint, False), np.nan, voltage)
    if mapping.pd_gains is not None and plan.derives_torque:
        none = np.full(rows, np.nan)
        channels = {
            quantity: np.stack([joints[j].get(quantity, none) for j in names], axis=1)
            for quantity in (
                "position",
                "velocity",
                "goal_position",
                "goal_velocity",
                "goal_torque",
            )
            if any(quantity in own for own in joints.values())
        }
        torque, derived["torque"] = mapping.pd_gains.torque(names, channels, frame[TIME])
        for joint, column in zip(names, torque.T, strict=True):
            joints[joint]["torque"] = np.where(off.get(joint, False), 0.0, column)
        found.note("", "file", 1, "1", "warning", f"the torque {CANNOT}")
    if plan.supply_alone:
        derived["torque"] = BY_MODEL
        for joint in names:
            joints[joint]["torque"] = np.full(rows, np.nan)
    return derived, off


def _warm(
    joints: dict[str, dict[str, Array]], frame: dict[str, Array], plan: ReadingPlan, time: Array
) -> None:
    """Temperatures of joints, the machine's own where one has none.

    They are slow: samples that come more seldom than rows are joined by straight lines.
    """
    common = frame.pop("base__temperature_degC", None)
    for joint in plan.expected.joints:
        own = joints[joint].get("temperature", np.full(time.size, np.nan))
        own = common if common is not None and not np.isfinite(own).any() else own
        good = np.isfinite(own)
        if good.any():
            joints[joint]["temperature"] = np.interp(time, time[good], own[good])
