"""A sweep from its axes to its table.

Finished cases stand in a file beside it, whose name is that of this sweep, until all are done: a
run that is stopped goes on from them.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.errors import LegwattError
from pipeline.columns import declared
from pipeline.result import Result, run_meta, walked
from pipeline.simulation.machine import Machine, read_machine
from pipeline.simulation.options import USUAL, WalkOptions
from pipeline.spread import resumed
from pipeline.sweeps.plan import Axis, Value, cases_of, read_axes

if TYPE_CHECKING:
    from pandas import DataFrame

Row = dict[str, Any]


@dataclass(frozen=True)
class Order:
    """A machine and how it walks, so that any process can read it again."""

    robot: Path | None = None  #: File; None for the default.
    model: Path | None = None  #: Model file.
    gait: Path | None = None  #: Gait file.
    actuators: Path | None = None  #: Folder.
    changes: tuple[tuple[str, object], ...] = ()  #: Of ``--set``, key and value.
    options: WalkOptions = USUAL  #: How it walks.


@cache
def machine_of(order: Order) -> Machine:
    """The machine before anything is varied, read once in a process."""
    machine = read_machine(
        order.robot,
        model=order.model,
        gait=order.gait,
        actuators=order.actuators,
        changes=dict(order.changes),
    )
    return machine.walking(**order.options.model_dump())


@cache
def digest_of(order: Order) -> str:
    """Hash of everything that was read and every option."""
    machine = machine_of(order)
    said = machine.record | run_meta(machine.inputs)
    kept = {k: said[k] for k in ("inputs_sha256", "urdf_sha256", "options")}
    kept["version"] = said["versions"]["legwatt"]
    return hashlib.sha256(json.dumps(kept, sort_keys=True, default=str).encode()).hexdigest()


def rows_of_case(
    order: Order, digest: str, axes: Sequence[Axis], case: tuple[int, Sequence[Value]]
) -> list[Row]:
    """The rows of one case, one for each actuator, or the reason why there are none.

    Args:
        order: The machine and how it walks.
        digest: Of everything that the order reads.
        axes: What is varied.
        case: Its number, and the value of each axis.

    Raises:
        LegwattError: This computer reads something else than what the digest was made of.
    """
    if digest_of(order) != digest:
        raise LegwattError(
            "a worker reads other robot or actuator files, or is of another version, than the "
            "process that asked it; give both the same"
        )
    machine, (number, values) = machine_of(order), case
    pairs = list(zip(axes, values, strict=True))
    head: Row = {"case": number} | {axis.header: value for axis, value in pairs}
    try:
        changed = machine.with_values({axis.key: axis.change(value) for axis, value in pairs})
        return [head | row for row in _walked(changed)]
    except LegwattError as error:
        reason = str(error).removeprefix(f"{machine.path}: ")  # a file may lie elsewhere
        return [head | {"alternative": "", "refusal": reason}]


def _walked(machine: Machine) -> Iterator[Row]:
    walk = walked(machine)
    demand = walk.result.demand
    stability, limits = walk.table("walking_stability"), walk.table("motor_limits")
    peaks = np.max([np.abs(part.torque).max(axis=0) for part in demand.segments], axis=0)
    most = int(peaks.argmax())
    for record in walk.table("robot_energy").to_dict("records"):
        own = limits[limits["alternative"] == record["alternative"]]
        over = own[own["breach"]].drop_duplicates("quantity")
        found = own.groupby("quantity")["peak"].max()
        yield {
            **{str(header): value for header, value in record.items()},
            "least_margin_m": stability["least_margin_m"].min(),
            "least_normal_force_N": stability["least_normal_force_N"].min(),
            "greatest_friction_needed": stability["greatest_friction_needed"].max(),
            "peak_torque_Nm": float(peaks[most]),
            "joint_of_peak_torque": demand.joints[most],
            "peak_speed_rad_s": found["speed"],
            "peak_voltage_V": found["voltage"],
            "peak_current_A": found["current"],
            "peak_rms_current_A": found["rms_current"],
            "beyond": ", ".join(f"{row.quantity} of {row.joint}" for row in over.itertuples()),
            "refusal": "",
        }


@dataclass(frozen=True, eq=False)
class Swept(Result):
    """A finished sweep: a row for each case and actuator."""

    axis: str  #: Column of the first number that is varied.
    point: Path  #: Finished cases, until the table is written.

    @property
    def rows(self) -> DataFrame:
        """All cases."""
        return self.table("sweep")

    @property
    def refused(self) -> Counter[str]:
        """Reasons, and how many cases each refused."""
        return Counter(reason for reason in self.rows["refusal"] if reason)

    def __str__(self) -> str:
        refused = self.refused
        lines = [f"{self.rows['case'].nunique()} cases, {refused.total()} refused"]
        lines += [f"  {count} times such as: {text}" for text, count in refused.most_common(3)]
        return "\n".join(lines)

    def _write(self, out: Path, decimal: str) -> dict[str, Any]:
        from reports.figures.lines import sweep_figure
        from reports.figures.style import save_figure

        about = super()._write(out, decimal)
        walked = self.rows[self.rows["refusal"] == ""]
        if len(walked):
            save_figure(sweep_figure(walked, self.axis), out, "sweep")
        return about


def run(order: Order, vary: Sequence[str], out: Path, *, workers: int | str = 1) -> Swept:
    """Walk with every combination of values.

    What a run before had finished in the folder is kept; the rows are the same whatever the number
    of workers, and however often it was stopped.

    Args:
        order: The machine and how it walks.
        vary: Axes as ``--vary`` writes them.
        out: Folder in which finished cases are kept until all are done.
        workers: Processes, or the address of a Dask scheduler.

    Raises:
        LegwattError: Unusable axes or machine, or workers that are gone; what was finished stays.
    """
    import pandas

    digest, machine = digest_of(order), machine_of(order)
    axes = read_axes(vary, machine)
    cases = {str(number): (number, values) for number, values in enumerate(cases_of(axes))}
    whole = hashlib.sha256(f"{digest} {axes}".encode()).hexdigest()
    point = out / f"sweep.{whole[:16]}.jsonl"
    work = partial(rows_of_case, order, digest, axes)
    found = resumed(work, cases, point, whole, workers=workers, title="cases")
    known = [name for name in declared("sweep") if name not in ("", "case", "*")]
    headers = ["case", *(axis.header for axis in axes), *known]
    rows = pandas.DataFrame([row for case in found for row in case], columns=headers)
    said = machine.record | {"sweep": {"vary": list(vary)}}
    return Swept("sweep", {"sweep": lambda: rows}, said, machine.inputs, axes[0].header, point)
