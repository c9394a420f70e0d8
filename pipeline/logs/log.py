"""One log: columns `<owner>__<quantity>_<unit>`, rows as read, findings, and it at one bandwidth.

`Expected` is what a log of one robot must look like: joint and foot names, ranges, gear ratios.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError
from pipeline.logs.filters import LowPass
from pipeline.robot.robot import Robot

if TYPE_CHECKING:
    import pandas as pd

    from pipeline.logs.mapping import ColumnTable

TIME: Final = "time_s"
POSITIONS: Final = ("position", "motor_position")
#: Channels in which measurement and simulation are compared, the most direct first, with unit.
EFFORTS: Final = {"torque": "N*m", "current": "A", "voltage": "V", "power": "W"}


class Column(NamedTuple):
    """What a column means; a row of `columns.csv` is one of any joint, foot, base or supply."""

    owner: str  #: ``joint``, ``foot``, ``base``, ``supply`` (of all drives), or whose it is.
    suffix: str  #: Of its header, behind the owner's name.
    quantity: str  #: As the program calls it.
    unit: str  #: In which the log keeps it, as `actuators.parameters` writes it.

    @property
    def name(self) -> str:
        """In the log format, a foot by its leg."""
        return f"{self.owner}__{self.suffix}" if self.owner else self.suffix


with Path(__file__).with_name("columns.csv").open(encoding="utf-8", newline="") as _file:
    COLUMNS: Final = [Column(**row) for row in csv.DictReader(_file)]
UNITS: Final = {column.quantity: column.unit for column in COLUMNS}
_SUFFIX: Final = {column.quantity: column.suffix for column in COLUMNS}


def column_name(owner: str, quantity: str) -> str:
    """Header in the log format of a channel of a joint, or of the owner ``supply``."""
    return f"{owner}__{_SUFFIX[quantity]}"


@dataclass(frozen=True)
class Expected:
    """Names and limits against which a log is read."""

    robot: str  #: The robot's name, for messages.
    joints: tuple[str, ...]  #: In the order of the columns.
    lower: Array  #: Position limits, -inf where there is none, shape (J,) [rad].
    upper: Array  #: Position limits, inf where there is none, shape (J,) [rad].
    effort_limit: Array  #: Joint torque, inf where there is none, shape (J,) [N*m].
    feet: tuple[str, ...] = ()  #: Names of legs in order.
    #: Other names of the same feet (their frames) to the leg's name.
    foot_alias: Mapping[str, str] = field(default_factory=dict)
    #: Motor angle per joint angle, signed, shape (J,); None where it is not known.
    ratio: Array | None = None
    #: What the feet carry [N]; None for a robot that does not stand on its feet.
    weight: float | None = None
    #: Channel to the largest magnitude that the drives can give, shape (J,), where it is known.
    largest: Mapping[str, Array] = field(default_factory=dict)

    @cached_property
    def columns(self) -> dict[str, Column]:
        """Every column that a log of this robot may have, and what it means."""
        one = {name: {name: name} for name in ("", "base", "supply")}
        feet = {name: name for name in self.feet} | {**self.foot_alias}
        owners = {**one, "joint": {name: name for name in self.joints}, "foot": feet}
        return {
            column._replace(owner=called).name: column._replace(owner=owner)
            for column in COLUMNS
            for called, owner in owners[column.owner].items()
        }


def expected_of_robot(robot: Robot, *, ratio: Array | None = None) -> Expected:
    """Names and limits of a robot; a foot goes by its leg's or its frame's name.

    `ratio`: motor angle per joint angle, shape (J,).
    """
    model, own = robot.model, robot.velocity_index
    (lower, upper), effort = robot.limits, model.effortLimit[own]
    # Pinocchio writes "no limit" as the largest double, and URDFs often as zero.
    effort = np.where((np.abs(effort) > 1e100) | (effort == 0.0), np.inf, effort)
    gravity = float(np.linalg.norm(model.gravity.linear))
    return Expected(
        robot=robot.spec.name,
        joints=robot.joints,
        lower=lower,
        upper=upper,
        effort_limit=effort,
        ratio=None if ratio is None else np.asarray(ratio, dtype=np.float64),
        feet=robot.leg_names,
        foot_alias={leg.foot: leg.name for leg in robot.spec.legs},
        weight=gravity * float(pin.computeTotalMass(model)) if robot.floating else None,
    )


#: Training estimates, validation selects, test judges; guards between them are not used.
TRAIN, VALIDATION, TEST, UNUSED = 0, 1, 2, -1
#: Where the torque of a log without any effort, for `gap power`, comes from.
BY_MODEL: Final = "none logged: the model's stands in"
#: Rows in which a drive was switched off, a column that no file has.
OFF: Final = "torque_off"


@dataclass(frozen=True)
class Finding:
    """One check of one column."""

    log: str  #: Name of the log.
    column: str  #: Header in the log format, or the joint, or empty for the log as a whole.
    check: str  #: What was looked at.
    value: float  #: The number found.
    unit: str  #: Of `value`.
    #: ``ok``, ``masked``, ``warning``, ``suspected`` (the run goes on with the log as it is, and
    #: nothing counts as explained) or ``refused``.
    verdict: str
    detail: str  #: In words, with the remedy where there is one.


class Findings(list[Finding]):
    """A list of one log's findings that fills in its name."""

    def __init__(self, log: str) -> None:
        super().__init__()
        self._log = log

    def note(
        self, column: str, check: str, verdict: str, detail: str, value: float = 1, unit: str = "1"
    ) -> None:
        """Add one."""
        self.append(Finding(self._log, column, check, float(value), unit, verdict, detail))


def refuse(findings: Sequence[Finding]) -> None:
    """Stop where a finding refuses its log.

    Raises:
        LegwattError: Names the log, the first refused column and how many there are.
    """
    refused = [finding for finding in findings if finding.verdict == "refused"]
    for first in refused[:1]:
        column = f", column '{first.column}'" if first.column else ""
        more = f" ({len(refused) - 1} more like this)" if len(refused) > 1 else ""
        raise LegwattError(f"{first.log}{column}: {first.detail}{more}")


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
    #: Motor turns per joint turn by mapping or actuator, (J,), NaN where it is not known.
    ratio: Array | None = None
    gain: float | None = None  #: Of the controller, duty per position error [1/rad].
    #: ``"open"`` (no current flows) or ``"shorted"`` where the drive is off.
    torque_off_bridge: str | None = None
    left_out: Mapping[str, str] = field(default_factory=dict)  #: Joint to why.
    #: Channels that were computed from others by the mapping, with the formula.
    derived: Mapping[str, str] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()  #: What reading saw.
    ignored: tuple[str, ...] = ()  #: Columns of the file that were not used.
    sha256: str = ""  #: Of the file.
    #: Name in the log format to the file's column and the mapping's rule for it.
    rules: Mapping[str, tuple[str, ColumnTable]] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.frame)

    @property
    def time(self) -> Array:
        """Strictly increasing, shape (N,) [s]."""
        return self.frame[TIME].to_numpy()

    @property
    def clock(self) -> Array:
        """Times of rows that hold a position: others may come between, at their own [s]."""
        told = np.isfinite(self.position).any(axis=1)
        return self.time[told] if np.count_nonzero(told) > 1 else self.time

    def column(self, joint: str, quantity: str) -> Array | None:
        """One joint's column (N,), read-only; None where there is none."""
        name = column_name(joint, quantity)
        return self.frame[name].to_numpy() if name in self.frame else None

    def _stacked(self, names: list[str]) -> Array | None:
        """Columns by name, (N, K), NaN for those that are not there; None where none is."""
        if not self.frame.columns.isin(names).any():
            return None
        return self.frame.reindex(columns=names).to_numpy(np.float64)

    def position_of(self, joint: str) -> Array:
        """A joint's positions, shape (N,) [rad]."""
        return self.frame[column_name(joint, "position")].to_numpy()

    def of(self, quantity: str) -> Array | None:
        """A quantity of all joints, (N, J), or of base or supply, (N,); None where nothing has it.

        Joints without the column are NaN.
        """
        owner = quantity.partition("_")[0]
        if owner in ("base", "supply"):
            return self.column(owner, quantity)
        return self._stacked([column_name(joint, quantity) for joint in self.joints])

    @property
    def efforts(self) -> Array:
        """The compared ones, shape (N, J), in `unit`; NaN where there is none."""
        every = self.of(self.effort)
        return np.full((len(self), len(self.joints)), np.nan) if every is None else every

    @property
    def position(self) -> Array:
        """Shape (N, J) [rad]."""
        return self.frame[[column_name(joint, "position") for joint in self.joints]].to_numpy()

    def position_quantity(self, joint: str) -> str:
        """Of the column that a joint's position was read from."""
        read = [side for side in POSITIONS if column_name(joint, side) in self.rules]
        return read[0] if read else POSITIONS[self.at_motor]

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
        off = self._stacked([f"{joint}__{OFF}" for joint in self.joints])
        return None if off is None else np.nan_to_num(off) > 0.5

    @property
    def foot_force(self) -> Array | None:
        """Of the world on the robot, shape (N, F, 3) [N]; NaN components were not measured."""
        names = [f"{foot}__force_{axis}_N" for foot in self.feet for axis in "xyz"]
        force = self._stacked(names)
        return None if force is None else force.reshape(len(self), -1, 3)

    @property
    def contact(self) -> Mask | None:
        """Where feet stand by their own columns, shape (N, F)."""
        contact = self._stacked([f"{foot}__contact" for foot in self.feet])
        return None if contact is None else contact > 0.5


@dataclass(frozen=True, eq=False)
class Log:
    """Samples of the machine's motion and of what it cost, at one bandwidth.

    Position, speed, acceleration and efforts passed one zero-phase low-pass. A prediction made from
    them may hold more (friction at a reversal): `smooth` brings it to the same bandwidth.
    """

    name: str  #: The file's stem.
    time: Array  #: Uniform within every piece, shape (N,) [s].
    joints: tuple[str, ...]  #: Names of the columns.
    q: Array  #: Position, shape (N, J) [rad].
    v: Array  #: Velocity, shape (N, J) [rad/s].
    a: Array  #: Acceleration, shape (N, J) [rad/s^2].
    #: Compared channels, the log's own effort first, e.g. ``("current", "voltage")``. With a
    #: measured current, voltage is predicted from that current and the speed.
    channels: tuple[str, ...]
    effort: Array  #: Shape (N, J, C) in the channels' units.
    noise: Array  #: Standard deviation of the noise in the bandwidth, shape (J, C).
    mask: Mask  #: Samples that count, shape (N, J).
    part: NDArray[np.int8]  #: TRAIN, VALIDATION, TEST or UNUSED, shape (N,).
    pieces: tuple[slice, ...]  #: Stretches without a gap.
    filter: LowPass | None = None  #: That it passed; None for series that are exact, or its rows.
    bandwidth: float = float("inf")  #: Cut-off of that low-pass [Hz].
    at_motor: bool = False  #: Whether the encoder sits on the motor's side of the gear.
    #: Speed within which friction passes from one sign to the other, (J,) [rad/s].
    rest_speed: Array = field(default_factory=lambda: np.zeros(0))
    base_roll: Array | None = None  #: Shape (N,) [rad], or None for level.
    base_pitch: Array | None = None  #: Likewise.
    base_yaw: Array | None = None  #: Likewise.
    base_rate: Array | None = None  #: Of the base link, in its axes, shape (N, 3) [rad/s].
    standing: Mask | None = None  #: Which feet stand, shape (N, F), or None.
    #: World on robot, shape (N, F, 3) [N]; NaN components were not measured; None where the
    #: ground's forces are computed.
    foot_force: Array | None = None
    #: Rows in which a drive is off and its winding open, (N, J), or None: no current flows, and a
    #: voltage that is compared has no part from the speed.
    open_winding: Mask | None = None
    temperature: Array | None = None  #: Of the motors' sensors, shape (N, J) [degC], or None.
    sign: Array | None = None  #: Expected sign of friction, -1 to 1, shape (N, J).
    unsure: Array | None = None  #: Its remaining standard deviation, shape (N, J).
    #: What took rows from the comparison, and the share of each joint's rows it took, shape (J,);
    #: a row counts with the first that took it.
    removed: tuple[tuple[str, Array], ...] = ()
    sha256: str = ""  #: Of the file.
    known: Mask | None = None  #: Where effort and all motion are known, shape (N, J).
    moved: Mask | None = None  #: Where the motion of a joint is known, shape (N, J).
    off: Mask | None = None  #: Where a drive was switched off, shape (N, J), or None.
    raw: Array | None = None  #: The compared effort, not filtered, shape (N, J).
    windup: Array | None = None  #: Motor over ratio less joint, (N, J) [rad]; NaN with one sensor.
    #: Noise of speed [rad/s] and acceleration [rad/s^2] in the bandwidth, shape (2, J).
    rate_noise: Array | None = None
    a_noise: Array | None = None  #: Another draw of the acceleration's, shape (N, J) [rad/s^2].
    foot_noise: float | None = None  #: Of a component of a foot's force in the bandwidth [N].
    findings: tuple[Finding, ...] = ()  #: What bringing it there saw.
    recording: Recording | None = None  #: Rows as they were read.

    def __len__(self) -> int:
        return self.time.size

    def without(self, takers: Mapping[str, Mask]) -> Log:
        """The same log without rows (N, J) or (N, 1), each kind with what took it."""
        mask, removed = self.mask, list(self.removed)
        for why, taken in takers.items():
            lost = mask & taken
            if lost.any():
                removed.append((why, np.asarray(lost.mean(axis=0))))
                mask = mask & ~lost
        return replace(self, mask=mask, removed=tuple(removed))

    def at(self, rows: NDArray[np.intp]) -> Log:
        """Some of its rows, as one piece without a filter."""
        every = {f.name: getattr(self, f.name) for f in fields(self)}
        own = {n: x for n, x in every.items() if isinstance(x, np.ndarray) and len(x) == len(self)}
        kept: dict[str, Any] = {name: x[rows] for name, x in own.items()}
        return replace(self, pieces=(slice(0, rows.size),), filter=None, **kept)

    @property
    def rate(self) -> float:
        """Samples per second [Hz]."""
        return 1.0 / float(np.median(np.diff(self.time)))

    @property
    def has_say(self) -> Mask:
        """Rows that estimate and choose; all where none does (to look, not to judge), (N,)."""
        rows = np.isin(self.part, (TRAIN, VALIDATION))
        return rows if rows.any() else np.ones_like(rows)

    def smooth(self, x: Array) -> Array:
        """A series (N, ...) of this grid brought to the bandwidth."""
        return x if self.filter is None else self.filter.smooth(x, self.pieces)

    def derivative(self, x: Array) -> Array:
        """Rate of change of a series (N, ...), piece by piece."""
        return np.concatenate([np.gradient(x[p], self.time[p], axis=0) for p in self.pieces])
