"""A sweep from its axes to its Parquet file.

Finished blocks of cases stand in a file beside it, whose name is that of this sweep, until all are
done: a run that is stopped goes on from them, and those of another sweep are never touched.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cache, partial
from pathlib import Path
from typing import Any, ClassVar, Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from actuators.errors import LegwattError
from pipeline.api.machine import Machine, load
from pipeline.api.motion import walked
from pipeline.api.result import run_meta
from pipeline.api.tables import inputs_of, said_of
from pipeline.atomic import replacing
from pipeline.column import column
from pipeline.dynamics.force_rules import LEAST_TANGENTIAL
from pipeline.simulation.cycle_energy import RobotEnergy
from pipeline.simulation.settings import SAMPLES, Settings
from pipeline.spread import resumed
from pipeline.sweep.plan import Axis, Value, cases_of, read_axes

Row = dict[str, Any]
_WALKS = ("samples", "quasi_static", "regeneration", "forces", "friction_coefficient")


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
    forces: str = LEAST_TANGENTIAL  #: See `walk`.
    friction_coefficient: float | None = None  #: See `walk`.

    def walking(self, machine: Machine) -> Settings:
        """A machine ready to walk."""
        return machine.walking(**{name: getattr(self, name) for name in _WALKS})


@cache
def machine_of(order: Order) -> Machine:
    """The machine before anything is varied, loaded once in a process."""
    files = {"model": order.model, "gait": order.gait, "actuators": order.actuators}
    return load(order.robot, **files, changes=dict(order.changes))


@cache
def digest_of(order: Order) -> str:
    """Hash of everything that was read and every option."""
    given = order.walking(machine_of(order))
    said = said_of(given) | run_meta(inputs_of(given))
    kept = {k: said[k] for k in ("inputs_sha256", "urdf_sha256", "options")}
    kept["version"] = said["versions"]["legwatt"]
    return hashlib.sha256(json.dumps(kept, sort_keys=True, default=str).encode()).hexdigest()


def rows_of_block(
    order: Order, digest: str, axes: Sequence[Axis], block: tuple[int, Sequence[Sequence[Value]]]
) -> list[Row]:
    """The rows of some cases in a row.

    Args:
        order: The machine and how it walks.
        digest: Of everything that the order reads.
        axes: What is varied.
        block: Number of the first case, and the values of each.

    Raises:
        LegwattError: This computer reads something else than what the digest was made of.
    """
    if digest_of(order) != digest:
        raise LegwattError(
            "a worker reads other robot or actuator files, or is of another version, than the "
            "process that asked it; give both the same"
        )
    machine = machine_of(order)
    first, cases = block
    rows: list[Row] = []
    for number, values in enumerate(cases, first):
        pairs = list(zip(axes, values, strict=True))
        head: Row = {"case": number} | {axis.header: value for axis, value in pairs}
        try:
            changed = machine.with_values({axis.key: axis.change(value) for axis, value in pairs})
            rows += [head | row for row in _walked(order.walking(changed))]
        except LegwattError as error:
            empty = dict.fromkeys(f.name for f in fields(SweepRow))
            reason = str(error).removeprefix(f"{machine.path}: ")  # a file may lie elsewhere
            rows.append(head | empty | {"alternative": "", "refusal": reason})
    return rows


def _walked(given: Settings) -> list[Row]:
    walk = walked(given)
    demand = walk.result.demand
    energy, stability, limits = (
        walk.table(name).frame() for name in ("robot_energy", "walking_stability", "motor_limits")
    )
    peaks = np.max([np.abs(part.torque).max(axis=0) for part in demand.segments], axis=0)
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
                "joint_of_peak_torque": demand.joints[most],
                "peak_speed_rad_s": found["speed"],
                "peak_voltage_V": found["voltage"],
                "peak_current_A": found["current"],
                "peak_rms_current_A": found["rms_current"],
                "beyond": ", ".join(f"{row.quantity} of {row.joint}" for row in over.itertuples()),
                "refusal": "",
            }
        )
    return rows


#: Cases that are computed together: no more than these are done again after a kill.
BLOCK: Final = 4
FILE: Final = "sweep.parquet"
_KEY: Final = b"legwatt_sweep"


@dataclass(frozen=True)
class Swept:
    """A finished sweep."""

    file: Path  #: The Parquet file.
    cases: int  #: How many.
    refused: Counter[str]  #: First words of the reasons, and how many cases each refused.

    def __str__(self) -> str:
        lost = sum(self.refused.values())
        lines = [f"{self.cases} cases in {self.file}, {lost} refused"]
        lines += [f"  {count} times such as: {text}" for text, count in self.refused.most_common(3)]
        return "\n".join(lines)


def sweep(
    order: Order,
    vary: Sequence[str],
    out: Path,
    *,
    sample: int | None = None,
    seed: int = 1,
    workers: int | str = 1,
) -> Swept:
    """Walk with every combination or a sample of values; a row for each case and actuator.

    What a run before had finished in the folder is kept; the rows are the same whatever the number
    of workers, and however often it was stopped.

    Args:
        order: The machine and how it walks.
        vary: Axes as ``--vary`` writes them.
        out: Folder, which the caller holds.
        sample: See `cases_of`, as is seed.
        seed: Of the draw.
        workers: Processes, or the address of a Dask scheduler.

    Raises:
        LegwattError: Unusable axes or machine, another sweep's file in the folder, or workers that
            are gone; what was finished stays. An actuator file cannot be used.
    """
    digest = digest_of(order)
    axes = read_axes(vary, machine_of(order))
    cases = cases_of(axes, sample, seed)
    whole = hashlib.sha256(f"{digest} {axes} {cases}".encode()).hexdigest()
    file = out / FILE
    if file.exists():
        try:
            said = (pq.read_schema(file).metadata or {}).get(_KEY)
        except (pa.ArrowInvalid, OSError):
            said = None
        if said != whole.encode():
            raise LegwattError(
                f"{file}: not of this sweep; choose another --out, or move or remove it"
            )
    else:
        blocks = {str(k): (k, cases[k : k + BLOCK]) for k in range(0, len(cases), BLOCK)}
        point = out / f"sweep.{whole[:16]}.jsonl"
        work = partial(rows_of_block, order, digest, axes)
        found = resumed(work, blocks, point, whole, workers=workers, title="blocks of cases")
        rows = [row for block in found for row in block]
        with replacing(file) as temporary:
            pq.write_table(pa.Table.from_pylist(rows, schema=_schema(axes, whole)), temporary)
        point.unlink(missing_ok=True)
    reasons = pq.read_table(file, columns=["refusal"]).column(0).to_pylist()
    return Swept(file, len(cases), Counter(r for r in reasons if r))


def _schema(axes: Sequence[Axis], digest: str) -> pa.Schema:
    """Columns with unit and meaning, and the sweep they belong to."""
    columns = [("case", pa.int64(), "number of the case, from 0", "1")]
    for axis in axes:
        words = any(isinstance(value, str) for value in axis.values)
        kind = pa.string() if words else pa.float64()
        columns.append((axis.header, kind, f"varied: {axis.key}", axis.unit))
    for declared in fields(SweepRow):
        meaning, unit, _ = declared.metadata["column"]
        kind = pa.string() if declared.type == "str" else pa.float64()
        columns.append((declared.name, kind, meaning, unit))
    told = [
        pa.field(name, kind, metadata={"meaning": meaning, "unit": unit})
        for name, kind, meaning, unit in columns
    ]
    return pa.schema(told, metadata={_KEY: digest.encode()})
