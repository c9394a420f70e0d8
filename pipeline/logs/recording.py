"""Rows of a log as they were read, a DataFrame in the columns of the log format, and findings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
import pandas as pd

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError
from pipeline.logs.log_format import EFFORTS, TIME, column_name
from pipeline.logs.mapping import ColumnTable

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
        self, column: str, check: str, value: float, unit: str, verdict: str, detail: str
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
    gain: float | None = None  #: Of the controller, duty per position error [1/rad].
    #: ``"open"`` (no current flows) or ``"shorted"`` where the drive is off.
    torque_off_bridge: str | None = None
    left_out: Mapping[str, str] = field(default_factory=dict)  #: Joint to why.
    #: What distinguishes this log from others, e.g. ``{"payload": 0.5}``.
    condition: Mapping[str, float | str] = field(default_factory=dict)
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

    def column(self, joint: str, quantity: str) -> Array | None:
        """One joint's column (N,), read-only; None where there is none."""
        return self._named(column_name(joint, quantity))

    def _named(self, name: str) -> Array | None:
        return self.frame[name].to_numpy() if name in self.frame else None

    def _stacked(self, names: Sequence[str]) -> Array | None:
        """Columns by name, (N, K), NaN for those that are not there; None where none is."""
        found = [self._named(name) for name in names]
        if all(x is None for x in found):
            return None
        none = np.full(len(self), np.nan)
        return np.stack([none if x is None else x for x in found], axis=1)

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
    def position(self) -> Array:
        """Shape (N, J) [rad]."""
        return np.stack([self.position_of(joint) for joint in self.joints], axis=1)

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
