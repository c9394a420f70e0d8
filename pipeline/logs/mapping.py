"""The mapping file: how a foreign log's columns become those of the log format.

A rule renames a column, or all that match a pattern, and gives unit, zero, sign, factor and delay.
All tables are optional; the README of `pipeline/logs` shows every key.
"""

from __future__ import annotations

import re
from collections.abc import Mapping as MappingType
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np
from pydantic import AfterValidator, Field

from actuators.arrays import Array
from actuators.checked import Number, Table, Text, checked, read_toml
from actuators.errors import known, one_line
from actuators.parameters import dimension, from_si, to_si
from pipeline.logs.log import TIME

#: Of servos, in words.
LAW: Final = "kp (goal - position) + kd (goal velocity - velocity) + goal torque"
#: What a reader of results must know of a torque that the servos' law gives.
CANNOT: Final = (
    "is computed by the servos' law from targets and gains, not measured: the delay and bandwidth "
    "of the servos, currents or torques they hold back, and gains other than stated are taken for "
    "the machine's"
)


def _not_zero(value: float) -> float:
    if value == 0.0:
        raise ValueError("must not be zero")
    return value


Factor = Annotated[Number, AfterValidator(_not_zero)]
Gain = Annotated[Number, Field(ge=0.0)]
Pattern = Annotated[Text, Field(pattern=r"^[^*]*\*?[^*]*$")]  # at most one star


def _known(unit: str) -> str:
    dimension(unit)
    return unit


Unit = Annotated[str, AfterValidator(_known)]


class QuantityTable(Table):
    """A number with its unit."""

    value: Number
    unit: Unit


class TimeTable(Table):
    """Where time comes from."""

    column: str | None = None
    unit: Literal["s", "ms", "us", "ns"] = "s"
    sample_rate: Annotated[Number, Field(gt=0.0)] | None = None  #: [Hz], instead of stamps.


class ColumnTable(Table):
    """How one column, or all that match a pattern, become columns of the log format."""

    target: Pattern | None = Field(default=None, alias="as")
    unit: Unit | None = None
    zero: Number = 0.0
    scale: Factor = 1.0
    flip: bool = False
    late: Number = 0.0

    def renamed(self, pattern: str, column: str) -> str | None:
        """The column of the log format a column of the file becomes, or None."""
        found = re.fullmatch("(.*)".join(map(re.escape, pattern.split("*"))), column, re.DOTALL)
        if found is None:
            return None
        return (self.target or pattern).replace("*", found[1] if found.groups() else "*")

    def affine(self, target_unit: str) -> tuple[float, float]:
        """Factor and offset that bring the file's numbers into the log's unit."""
        factor, offset = 1.0, 0.0
        if self.unit not in (None, "1", target_unit):
            offset = from_si(to_si(0.0, str(self.unit)), target_unit)
            factor = from_si(to_si(1.0, str(self.unit)), target_unit) - offset
        scale = -self.scale if self.flip else self.scale
        return scale * factor, scale * (offset - factor * self.zero)


class ControllerTable(Table):
    """The drive's controller."""

    gain_per_rad: Number | None = None
    torque_off_bridge: Literal["open", "shorted"] | None = None


class PdGains(Table):
    """Gains of the servos: stiffness [N*m/rad], damping [N*m*s/rad], largest torque [N*m].

    tau = clip(kp (q_goal - q) + kd (v_goal - v) + tau_goal, -limit, limit), the law of impedance-
    controlled drives and of learned controllers (Hwangbo et al. 2019, section "Actuator model"):
    what is commanded and not what is measured. A number for all joints, or one for each by name.
    """

    kp: Gain | dict[str, Gain]
    kd: Gain | dict[str, Gain] = 0.0
    limit: Factor | dict[str, Factor] = np.inf

    @property
    def named(self) -> tuple[str, ...]:
        """Joints that have numbers of their own."""
        tables = (self.kp, self.kd, self.limit)
        return tuple(joint for table in tables if isinstance(table, dict) for joint in table)

    def _of(self, key: str, joint: str) -> float:
        table = getattr(self, key)
        if isinstance(table, dict):
            return float(table[known(f"{key}: nothing for", joint, table, "pd_gains")])
        return float(table)

    def torque(self, joint: str, logged: MappingType[str, Array], time: Array) -> Array:
        """Torque of a joint by the law, (N,) [N*m]; NaN where position or target are not known.

        Args:
            joint: Its name.
            logged: Its position, and velocity and goals where they are logged, each (N,), SI units.
            time: Shape (N,) [s].

        Raises:
            LegwattError: Gains are told by joint, and none for this one.
        """
        kp, kd, limit = (self._of(key, joint) for key in ("kp", "kd", "limit"))
        position, zero = logged["position"], np.zeros(time.size)
        speed = logged["velocity"] if "velocity" in logged else np.gradient(position, time)
        torque = kp * (logged.get("goal_position", np.nan) - position)
        torque = torque + np.nan_to_num(logged.get("goal_torque", zero))
        if kd:
            torque = torque + kd * (np.nan_to_num(logged.get("goal_velocity", zero)) - speed)
        return np.clip(torque, -limit, limit)


class Mapping(Table):
    """The whole file."""

    effort: Literal["torque", "current", "voltage", "power"] | None = None
    time: TimeTable = TimeTable()
    columns: dict[Pattern, ColumnTable] = Field(default_factory=dict)
    joints: dict[str, str] = Field(default_factory=dict)
    torque_enabled: dict[str, str] = Field(default_factory=dict)
    gear_ratio: dict[str, Factor] = Field(default_factory=dict)
    controller: ControllerTable = ControllerTable()
    pd_gains: PdGains | None = None
    constants: dict[str, QuantityTable] = Field(default_factory=dict)
    where: str = Field(default="mapping", exclude=True)  #: The file's name, for messages.

    @property
    def rules(self) -> dict[str, ColumnTable]:
        """Patterns of columns, time's and those for one column first, and what each becomes."""
        time = ColumnTable.model_validate({"as": TIME, "unit": self.time.unit})
        stars = {text: rule for text, rule in self.columns.items() if "*" in text}
        named = {text: rule for text, rule in self.columns.items() if text not in stars}
        return {self.time.column or TIME: time} | {TIME: time} | named | stars


def load_mapping(path: Path) -> Mapping:
    """Load and check a mapping file.

    Raises:
        LegwattError: Missing file, malformed TOML, unknown key or unit, wrong type; one line.
    """
    return parse_mapping(read_toml(path), one_line(path.name))


def parse_mapping(table: MappingType[str, Any], where: str) -> Mapping:
    """Check the contents of a mapping file.

    Raises:
        LegwattError: Unknown key or unit, or a value of the wrong kind; one line.
    """
    return checked(Mapping, table, where).model_copy(update={"where": where})
