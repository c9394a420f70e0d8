"""What a robot costs over many gaits, loads and dimensions: a row for each case and actuator.

    speed=0.1:0.4:7 m/s       seven values, first and last included
    payload_mass=0,5,10 kg    these values

Names are those of ``--set``; ``gait.`` may be left out. Finished cases stand in a file beside the
table, whose name is that of this sweep, until all are done: a run that is stopped goes on.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from actuators.errors import LegwattError, closest, one_line
from pipeline.columns import declared
from pipeline.motion.gait_table import gait_keys
from pipeline.result import Result, run_meta
from pipeline.simulation.changes import GAIT
from pipeline.simulation.machine import Machine
from pipeline.simulation.tables import tables_of_walking
from pipeline.spread import resumed
from reports.typeset import unit_suffix

if TYPE_CHECKING:
    from pandas import DataFrame

MOST_CASES: Final = 100_000  # some hours of a fast machine
#: Numbers or words, and the unit behind numbers.
_WRITTEN: Final = re.compile(r"((?:[-+0-9.,:eE ]|nan|inf)*(?:[0-9.]|nan|inf))\s*([A-Za-z%].*)")
Value = float | str


@dataclass(frozen=True)
class Axis:
    """One number or choice that is varied."""

    key: str  #: As ``--set`` writes it.
    unit: str  #: Of the values; empty for pure numbers and words.
    values: tuple[Value, ...]  #: In their order.

    @property
    def header(self) -> str:
        """Of its column."""
        name = self.key.removeprefix(GAIT).replace(".", "__")
        return "_".join(filter(None, [name, unit_suffix(self.unit)]))

    def change(self, value: Value) -> object:
        """A value as `Machine.with_values` takes it, units as the key's file has them."""
        return f"{value!r} {self.unit}" if self.unit and self.key.startswith(GAIT) else value


def read_axis(text: str, machine: Machine) -> Axis:
    """The axis of ``NAME=VALUES``, each of which the machine takes by itself.

    Raises:
        LegwattError: It cannot be read, or the machine has no such number in this unit.
    """
    name, _, written = (part.strip() for part in text.partition("="))
    place = f"vary {one_line(text)}"
    if not name or not written:
        raise LegwattError(f"{place}: expected NAME=VALUES, such as 'speed=0.1:0.4:7 m/s'")
    key = f"{GAIT}{name}" if f"{GAIT}{name}" in gait_keys() else name
    numbers = {p.name: p for p in machine.robot.spec.parameters.rows()}
    numbers |= {f"{component}.{p.name}": p for component, p in machine.catalog.rows()}
    if not key.startswith(GAIT) and key != "standing.feet" and key not in numbers:
        known = [*(k.removeprefix(GAIT) for k in gait_keys()), *numbers]
        raise LegwattError(f"{place}: there is no such number; {closest(name, known)}")
    match = _WRITTEN.fullmatch(written)
    body, unit = match.groups() if match else (written, "")
    if key in numbers:  # in the unit of its file
        own = numbers[key].unit
        if unit not in ("", own):
            raise LegwattError(f"{place}: its unit is {own}, not {unit}")
        unit = "" if own == "1" else own
    axis = Axis(key, unit, _values(body, place))
    for value in axis.values:  # each by itself is one that ``--set`` takes; together may not be
        try:
            machine.with_values({key: axis.change(value)})
        except LegwattError as error:
            raise LegwattError(f"{place}: {str(error).partition(': ')[2] or error}") from None
    return axis


def _values(body: str, place: str) -> tuple[Value, ...]:
    """``FIRST:LAST:COUNT`` or ``A,B,C``, numbers or words."""
    values: list[Value] = []
    first, *others = body.split(":")
    try:
        if others:
            low, high, count = float(first), float(others[0]), int(others[1])
            if len(others) > 2 or not 2 <= count <= MOST_CASES:
                raise ValueError
            values += [float(f"{x:.12g}") for x in np.linspace(low, high, count)]
    except (ValueError, IndexError):
        raise LegwattError(
            f"{place}: expected FIRST:LAST:COUNT, two numbers and a count from 2 to {MOST_CASES}, "
            "such as 'speed=0.1:0.4:7 m/s'"
        ) from None
    for part in body.split(",") if not others else ():
        try:
            values.append(float(part))
        except ValueError:
            values.append(part.strip())
    if "" in values or len(set(values)) < len(values):
        raise LegwattError(f"{place}: a value is empty or stands twice")
    if not all(isinstance(value, str) or math.isfinite(value) for value in values):
        raise LegwattError(f"{place}: expected finite numbers")
    return tuple(values)


def rows_of_case(
    machine: Machine, axes: Sequence[Axis], case: tuple[int, Sequence[Value]]
) -> list[dict[str, Any]]:
    """The rows of one case, one for each actuator, or the reason why there are none.

    Args:
        machine: Before anything is varied, and how it walks.
        axes: What is varied.
        case: Its number, and the value of each axis.
    """
    number, values = case
    pairs = list(zip(axes, values, strict=True))
    head = {"case": number} | {axis.header: value for axis, value in pairs}
    try:
        changed = machine.with_values({axis.key: axis.change(value) for axis, value in pairs})
        return [head | row for row in _walked(changed)]
    except LegwattError as error:
        reason = str(error).removeprefix(f"{machine.path}: ")  # a file may lie elsewhere
        return [head | {"alternative": "", "refusal": reason}]


def _walked(machine: Machine) -> Iterator[dict[str, Any]]:
    result = machine.walk(machine.chains())
    demand, tables = result.demand, tables_of_walking(machine, result)
    stability, limits = tables["walking_stability"](), tables["motor_limits"]()
    peaks = np.max([np.abs(part.torque).max(axis=0) for part in demand.segments], axis=0)
    most = int(peaks.argmax())
    for record in tables["robot_energy"]().to_dict("records"):
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
        done = self.rows[self.rows["refusal"] == ""]
        if len(done):
            save_figure(sweep_figure(done, self.axis), out, "sweep")
        return about


def run(machine: Machine, vary: Sequence[str], out: Path, workers: int | str = 1) -> Swept:
    """Walk with every combination of values; see `pipeline.commands.sweep.sweep`."""
    import pandas

    axes = [read_axis(text, machine) for text in vary]
    if len({axis.key for axis in axes}) != len(axes) or not axes:
        raise LegwattError("vary: " + ("a number stands twice" if axes else "give NAME=VALUES"))
    total = math.prod(len(axis.values) for axis in axes)
    if total > MOST_CASES:
        raise LegwattError(f"vary: {total} cases, expected at most {MOST_CASES}")
    every = enumerate(product(*(axis.values for axis in axes)))
    said = machine.record | {"sweep": {"vary": list(vary)}}
    of = json.dumps([said, run_meta(machine.inputs)], sort_keys=True, default=str)
    digest = hashlib.sha256(of.encode()).hexdigest()
    point = out / f"sweep.{digest[:16]}.jsonl"
    work, cases = partial(rows_of_case, machine, axes), {str(case[0]): case for case in every}
    found = resumed(work, cases, point, digest, workers=workers, title="cases")
    known = [name for name in declared("sweep") if name not in ("", "case", "*")]
    headers = ["case", *(axis.header for axis in axes), *known]
    rows = pandas.DataFrame([row for case in found for row in case], columns=headers)
    return Swept("sweep", {"sweep": lambda: rows}, said, machine.inputs, axes[0].header, point)
