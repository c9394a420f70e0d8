"""A measured log: what was sensed at every joint and instant, in SI units and joint order.

Positions are measured at the joint, at the motor, or on both sides of the gear (`sides_of`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError, closest
from pipeline.logs.log_format import EFFORTS, Expected
from pipeline.logs.reading.mapping import ColumnTable

#: Difference from a stated gear ratio, relative, from which the two positions contradict it.
_CONTRADICTS: Final = 0.05
#: How much a joint must move for its two positions to tell their ratio [rad].
_LEAST_MOTION: Final = 0.05


_ALONE: Final = (
    "has a motor-side position alone, other joints have a joint-side one: what its gear winds up "
    "or plays is taken for the joint's motion"
)
#: Commands to the servos.
GOALS: Final = ("goal_position", "goal_velocity", "goal_torque")
#: Of the supply: its voltage, and what it gives; seldom as often as the joints.
SUPPLY: Final = ("supply", "supply_current", "supply_power")
#: Where the torque of a log without any effort, for `gap power`, comes from.
BY_MODEL: Final = "none logged: the model's stands in"


class Effort(NamedTuple):
    """The channel that is compared."""

    channel: str  #: Key of `EFFORTS`.
    unit: str  #: Its unit.
    values: Array  #: Shape (N, J).


@dataclass(frozen=True)
class Log:
    """One measured log; samples along the first axis, joints in the robot's order.

    The sign of torque, current, voltage and velocity is the joint's; power is positive from supply
    to motor. What a channel did not measure is NaN there.
    """

    name: str  #: Short name, the file's stem.
    time: Array  #: Strictly increasing, shape (N,) [s].
    joints: tuple[str, ...]  #: Names of the columns.
    position: Array  #: Joint side, shape (N, J) [rad].
    #: ``"joint"`` or ``"motor"``: which side of the gear the encoder sits on; motor angles are
    #: divided by the ratio.
    position_source: str
    #: Of the motor over the ratio where both sides were measured, (N, J) [rad].
    motor_position: Array | None = None
    velocity: Array | None = None  #: As measured, shape (N, J) [rad/s].
    torque: Array | None = None  #: At the joint side, shape (N, J) [N*m].
    current: Array | None = None  #: Of the motor, shape (N, J) [A].
    voltage: Array | None = None  #: Of the motor, shape (N, J) [V].
    power: Array | None = None  #: Electrical, shape (N, J) [W].
    goal_position: Array | None = None  #: Shape (N, J) [rad].
    goal_velocity: Array | None = None  #: Shape (N, J) [rad/s].
    #: What the servos add to their law, at the joint side, shape (N, J) [N*m].
    goal_torque: Array | None = None
    temperature: Array | None = None  #: Shape (N, J) [degC].
    feet: tuple[str, ...] = ()  #: Names of the legs whose feet were measured.
    foot_force: Array | None = None  #: Of the world on the robot, shape (N, F, 3) [N].
    contact: Mask | None = None  #: Shape (N, F).
    base_roll: Array | None = None  #: Shape (N,) [rad].
    base_pitch: Array | None = None  #: Shape (N,) [rad].
    torque_off: Mask | None = None  #: True where the drive was switched off, shape (N, J).
    supply: Array | None = None  #: Voltage of the supply of all drives, shape (N,) [V].
    supply_current: Array | None = None  #: Out of it, shape (N,) [A].
    supply_power: Array | None = None  #: Out of it, shape (N,) [W].
    gain: float | None = None  #: Of the controller, duty per position error [1/rad].
    #: ``"open"`` (no current flows) or ``"shorted"`` where the drive is off.
    torque_off_bridge: str | None = None
    locked: tuple[str, ...] = ()  #: Joints that stood still on purpose.
    #: Further numbers the mapping names, SI.
    constants: Mapping[str, float] = field(default_factory=dict)
    #: What distinguishes this log from others, e.g. ``{"payload": 0.5}``.
    condition: Mapping[str, float | str] = field(default_factory=dict)
    #: Numeric columns the mapping keeps under their own names, each shape (N,).
    extra: Mapping[str, Array] = field(default_factory=dict)
    ignored: tuple[str, ...] = ()  #: Columns of the file that were not used.
    #: Columns that were not used though they are nearly ones of the log format, and those.
    misspelt: Mapping[str, str] = field(default_factory=dict)
    chosen_effort: str | None = None  #: Channel to compare, overriding the order of `EFFORTS`.
    #: Joints that cannot be compared, and why.
    left_out: Mapping[str, str] = field(default_factory=dict)
    #: Columns about which a reader should know something, and that.
    remarks: Mapping[str, str] = field(default_factory=dict)
    repeated_times: int = 0  #: Rows that were dropped because their time stood in the row before.
    notes: tuple[str, ...] = ()  #: What a reader should know of the file as a whole.
    #: Channels that were computed from others by the mapping, with the formula.
    derived: Mapping[str, str] = field(default_factory=dict)
    sha256: str = ""  #: Of the file.
    source: Path = Path()  #: The file's name.
    #: Owner and quantity to the file's column and the mapping's rule for it.
    rules: Mapping[tuple[str, str], tuple[str, ColumnTable]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n, j = self.position.shape
        shapes = {"time": (n,), "torque_off": (n, j)}
        shapes |= dict.fromkeys(("base_roll", "base_pitch", *SUPPLY), (n,))
        shapes |= dict.fromkeys(
            ("velocity", *EFFORTS, *GOALS, "temperature", "motor_position"), (n, j)
        )
        for key, shape in shapes.items():
            value = getattr(self, key)
            if value is not None and value.shape != shape:
                raise LegwattError(
                    f"{self.name}: {key} has shape {value.shape}; positions of shape {(n, j)} "
                    f"need {shape}"
                )

    def __len__(self) -> int:
        return self.time.size

    @property
    def clock(self) -> Array:
        """Times of the rows that hold a position: others may come between, at their own [s]."""
        told = np.isfinite(self.position).any(axis=1)
        return self.time[told] if np.count_nonzero(told) > 1 else self.time

    @property
    def finite(self) -> tuple[Mask, Mask]:
        """Positions and efforts that are numbers, of drives that are on, each shape (N, J)."""
        effort = np.isfinite(self.effort.values)
        return np.isfinite(self.position), effort if self.torque_off is None else (
            effort & ~self.torque_off
        )

    @property
    def supply_alone(self) -> bool:
        """Whether no effort of any joint is logged, and the supply's power or current is."""
        return BY_MODEL in self.derived.values()

    @property
    def position_quantity(self) -> str:
        """Key of the position's columns in the log format."""
        return "motor_position" if self.position_source == "motor" else "position"

    @property
    def channels(self) -> tuple[str, ...]:
        """Effort channels the log has, the most direct first."""
        return tuple(key for key in EFFORTS if getattr(self, key) is not None)

    @cached_property
    def effort(self) -> Effort:
        """The channel in which measurement and simulation are compared, where the log has it."""
        channels = self.channels
        channel = self.chosen_effort or (channels[0] if channels else "")
        if channel not in channels:
            raise LegwattError(
                f"{self.name}: no {channel or 'effort'} channel in the log; "
                f"{closest(channel, channels)}"
            )
        return Effort(channel, EFFORTS[channel], getattr(self, channel))

    def rows(self, part: slice | NDArray[np.intp] | Mask) -> Log:
        """The same log with some of its rows, in order."""
        arrays = {k: x[part] for k, x in vars(self).items() if isinstance(x, np.ndarray)}
        extra = {key: value[part] for key, value in self.extra.items()}
        return self.with_changes(extra=extra, **arrays)

    def with_changes(self, **changes: Any) -> Log:
        """The same log with some attributes replaced."""
        return replace(self, **changes)


class Sides(NamedTuple):
    """Positions brought to the joint's side."""

    #: Of the joint where that was measured, else of the motor over the ratio, (N, J).
    position: Array
    #: Of the motor over the ratio where both were measured, shape (N, J), NaN for joints with one
    #: position; None where the log has one kind of position.
    motor: Array | None
    source: str  #: ``"motor"`` where every position is the motor's, else ``"joint"``.
    remarks: Mapping[str, str]  #: Joint to what a reader should know about its positions.


def sides_of(
    joint: Array | None,
    motor: Array | None,
    expected: Expected,
    ratio: Mapping[str, float],
    where: str,
) -> Sides:
    """Decide which position of each joint is its own.

    A gear ratio comes from the mapping, else from the actuator, else from the two positions
    themselves; a motor's position alone without any of them is taken as divided by the ratio
    already where it stays within the joint's limits.

    Args:
        joint: Joint-side positions, shape (N, J) [rad], NaN columns where there are none; or None.
        motor: Motor-side positions as logged, likewise.
        expected: Names, limits, and gear ratios of the actuator.
        ratio: Gear ratios the mapping states, signed.
        where: File, for messages.

    Raises:
        LegwattError: A motor's position needs a gear ratio that nothing states.
    """
    if motor is None:
        assert joint is not None
        return Sides(joint, None, "joint", {})
    own = np.full_like(motor, np.nan) if joint is None else joint
    has_own = np.asarray(np.isfinite(own).any(axis=0))
    has_motor = np.asarray(np.isfinite(motor).any(axis=0))
    divided = np.full_like(motor, np.nan)
    remarks: dict[str, str] = {}
    for k, name in enumerate(expected.joints):
        if not has_motor[k]:
            continue
        seen = _slope(motor[:, k], own[:, k]) if has_own[k] else None
        known = ratio.get(name, None if expected.ratio is None else float(expected.ratio[k]))
        n, remark = _ratio(known, seen)
        if n is None:
            q = motor[np.isfinite(motor[:, k]), k]
            low, high = float(expected.lower[k]), float(expected.upper[k])
            if not (np.isfinite(low) and np.isfinite(high)):
                low, high = -np.pi, np.pi
            margin = 0.05 * (high - low)
            if q.min() < low - margin or q.max() > high + margin:
                raise LegwattError(
                    f"{where}: {name}__motor_position_rad leaves the joint's limits and no gear "
                    "ratio is known; give actuators, or the ratio under [gear_ratio] in a mapping "
                    "file"
                )
            remark = (
                "no gear ratio is known: taken as divided by it already, since it stays within "
                "the joint's limits; else state it under [gear_ratio] in a mapping file"
            )
        divided[:, k] = motor[:, k] / (n or 1.0)
        if remark:
            remarks[name] = remark
    mixed = joint is not None  # by its columns: a piece of a log may hold no number of one
    remarks |= {expected.joints[k]: _ALONE for k in np.flatnonzero(mixed & has_motor & ~has_own)}
    both = has_own & has_motor
    position = np.where(has_own, own, divided)
    side = np.where(both, divided, np.nan) if mixed else None
    return Sides(position, side, "joint" if mixed else "motor", remarks)


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
