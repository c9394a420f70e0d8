"""One case of a sweep: a machine with other numbers walks; a row for each actuator."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, fields
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from actuators.errors import ActuatorError
from pipeline.api.machine import Machine, load
from pipeline.api.tables import metadata, tables_of_walking, walked
from pipeline.column import column
from pipeline.errors import PipelineError
from pipeline.simulation.cycle_energy import RobotEnergy
from pipeline.simulation.force_choice import ForceChoice
from pipeline.simulation.settings import PAPER_FORCES, SAMPLES, Settings
from pipeline.sweep.plan import Axis, SweepError, Value

Row = dict[str, Any]


@dataclass(frozen=True)
class SweepRow(RobotEnergy):
    """A case with one actuator: the robot's energy, and the peaks of `walk`'s other tables."""

    table: ClassVar = "sweep"
    least_margin_m: float = column("least static margin of the cycle", "m")
    least_normal_force_N: float = column("lightest load on a supporting foot", "N")
    greatest_friction_needed: float = column("largest tangential over normal force", "1")
    peak_torque_Nm: float = column("largest magnitude at any joint", "N*m")
    joint_of_peak_torque: str = column("joint that needs it")
    peak_speed_rad_s: float = column("largest magnitude of a motor", "rad/s")
    peak_voltage_V: float = column("largest magnitude of a motor", "V")
    peak_current_A: float = column("largest magnitude of a motor", "A")
    peak_rms_current_A: float = column("of the motor that has most", "A")
    beyond: str = column("limits of motors that are exceeded, with the first joint that does")
    refusal: str = column("why the robot does not walk so; empty where it does")


@dataclass(frozen=True)
class Order:
    """A machine and how it walks, so that any process can load it again."""

    robot: Path | None = None  #: File or name; None for the default.
    model: Path | None = None  #: Model file.
    gait: Path | None = None  #: Gait file.
    actuators: Path | None = None  #: Folder.
    changes: tuple[tuple[str, object], ...] = ()  #: Of ``--set``, key and value.
    samples: int = SAMPLES  #: Per half period.
    quasi_static: bool = False  #: See `walk`.
    regeneration: str = "none"  #: See `walk`.
    forces: ForceChoice = PAPER_FORCES  #: See `walk`.
    axes: tuple[Axis, ...] = ()  #: What is varied.
    digest: str = ""  #: Of everything read; empty until it is known.

    def walking(self, machine: Machine) -> Settings:
        """A machine ready to walk."""
        return machine.walking(
            samples=self.samples,
            quasi_static=self.quasi_static,
            regeneration=self.regeneration,
            forces=self.forces,
        )

    @property
    def machine(self) -> Machine:
        """Before anything is varied, loaded once in a process."""
        return _loaded(self.robot, self.model, self.gait, self.actuators, self.changes)


@cache
def _loaded(
    robot: Path | None,
    model: Path | None,
    gait: Path | None,
    actuators: Path | None,
    changes: tuple[tuple[str, object], ...],
) -> Machine:
    return load(robot, model=model, gait=gait, actuators=actuators, changes=dict(changes))


def digest_of(given: Settings) -> str:
    """Hash of everything that was read and every option."""
    said = metadata(given)
    kept = {k: said[k] for k in ("inputs_sha256", "urdf_sha256", "options")}
    kept["version"] = said["versions"]["legwatt"]
    return hashlib.sha256(json.dumps(kept, sort_keys=True, default=str).encode()).hexdigest()


@cache
def _checked(order: Order) -> Machine:
    """The order's machine; what another computer reads must be the same.

    Raises:
        SweepError: It is not.
    """
    machine = order.machine
    if digest_of(order.walking(machine)) != order.digest:
        raise SweepError(
            "a worker reads other robot or actuator files, or is of another version, than the "
            "process that asked it; give both the same"
        )
    return machine


def rows_of_block(order: Order, block: tuple[int, tuple[tuple[Value, ...], ...]]) -> list[Row]:
    """The rows of some cases in a row: number of the first, and the values of each."""
    first, cases = block
    rows = (_rows(order, _checked(order), k, values) for k, values in enumerate(cases, first))
    return list(chain.from_iterable(rows))


def _rows(order: Order, machine: Machine, number: int, values: tuple[Value, ...]) -> list[Row]:
    head: Row = {"case": number}
    head |= {axis.header: value for axis, value in zip(order.axes, values, strict=True)}
    changes = {a.key: a.change(v) for a, v in zip(order.axes, values, strict=True)}
    try:
        return [head | row for row in _walked(order.walking(machine.with_values(changes)))]
    except (PipelineError, ActuatorError) as error:
        empty = dict.fromkeys(f.name for f in fields(SweepRow))
        reason = str(error).removeprefix(f"{machine.path}: ")  # a file may lie elsewhere
        return [head | empty | {"alternative": "", "refusal": reason}]


def _walked(given: Settings) -> list[Row]:
    walking = walked(given, given.chains())
    tables = tables_of_walking(given, walking)
    energy, stability, limits = (
        tables[name]().frame() for name in ("robot_energy", "walking_stability", "motor_limits")
    )
    peaks = np.max([np.abs(part.torque).max(axis=0) for part in walking.demand.segments], axis=0)
    most = int(peaks.argmax())
    rows: list[Row] = []
    for record in energy.to_dict("records"):
        own = limits[limits.alternative == record["alternative"]]
        over = own[own.breach].drop_duplicates("quantity")
        found = own.groupby("quantity").peak.max()
        rows.append(
            {
                **{str(header): value for header, value in record.items()},
                "least_margin_m": stability.least_margin_m.min(),
                "least_normal_force_N": stability.least_normal_force_N.min(),
                "greatest_friction_needed": stability.greatest_friction_needed.max(),
                "peak_torque_Nm": float(peaks[most]),
                "joint_of_peak_torque": walking.demand.joints[most],
                "peak_speed_rad_s": found["speed"],
                "peak_voltage_V": found["voltage"],
                "peak_current_A": found["current"],
                "peak_rms_current_A": found["rms_current"],
                "beyond": ", ".join(f"{row.quantity} of {row.joint}" for row in over.itertuples()),
                "refusal": "",
            }
        )
    return rows
