"""What a robot costs over many gaits, loads and dimensions: a row for each case and actuator.

    speed=0.1:0.4:7 m/s       seven values, first and last included
    payload_mass=0,5,10 kg    these values

Cases run in this process or on Dask, a local cluster or a remote one. Finished ones stand in a file
beside the table, whose name is that of this sweep, until all are done: a run that is stopped goes
on.
"""

import hashlib
import json
import logging
import math
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, Final

import numpy as np

from actuators.checked import output_errors, write_text
from actuators.errors import LegwattError, known, one_line
from pipeline.columns import declared
from pipeline.motion.gait import gait_keys
from pipeline.result import Result, of_table, run_meta
from pipeline.simulation.machine import GAIT, Machine
from pipeline.simulation.walk_stand import tables_of_walking
from reports.page import unit_suffix

MOST_CASES: Final = 100_000  # some hours of a fast machine
_PATIENCE: Final = 10.0  # for a scheduler and its first worker [s]
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
        """A value as `Machine.with_values` takes it."""
        return f"{value!r} {self.unit}" if self.unit else value


def read_axis(text: str, machine: Machine) -> Axis:
    """The axis of ``NAME=VALUES``, each of which the machine takes by itself.

    Raises:
        LegwattError: It cannot be read, or the machine has no such number in this unit.
    """
    name, _, written = (part.strip() for part in text.partition("="))
    place = f"vary {one_line(text)}"
    key = f"{GAIT}{name}" if f"{GAIT}{name}" in gait_keys() else name
    units = {p.name: p.unit for p in machine.robot.spec.parameters.rows()}
    units |= {f"{component}.{p.name}": p.unit for component, p in machine.catalog.rows()}
    if not key.startswith(GAIT) and key != "standing.feet":
        names = [*(k.removeprefix(GAIT) for k in gait_keys()), *units]
        known("there is no such number", key, names, place)
    match = _WRITTEN.fullmatch(written)
    body, unit = match.groups() if match else (written, "")
    unit = unit or units.get(key, "")  # that of its file
    axis = Axis(key, "" if unit == "1" else unit, _values(body))
    for value in axis.values:  # each by itself is one that ``--set`` takes; together may not be
        try:
            machine.with_values({key: axis.change(value)})
        except LegwattError as error:
            reason = str(error).partition(": ")[2] or error
            form = "; expected NAME=FIRST:LAST:COUNT UNIT or A,B,C UNIT" * isinstance(value, str)
            raise LegwattError(f"{place}: {reason}{form}") from None
    return axis


def _values(body: str) -> tuple[Value, ...]:
    """``FIRST:LAST:COUNT`` or ``A,B,C``, numbers or words; what is neither is a word."""
    values: list[Value] = [*map(str.strip, body.split(","))]
    with suppress(ValueError):
        low, high, count = body.split(":")
        if 2 <= int(count) <= MOST_CASES:
            every = np.linspace(float(low), float(high), int(count))
            values = [float(f"{x:.12g}") for x in every]
    for k, value in enumerate(values):
        with suppress(ValueError):
            values[k] = float(value)
    return tuple(dict.fromkeys(values))


def rows_of_case(
    machine: Machine, axes: Sequence[Axis], case: tuple[int, Sequence[Value]]
) -> list[dict[str, Any]]:
    """The rows of one case, one for each actuator, or the reason why there are none.

    `case`: its number, and the value of each axis.
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

    rows = of_table("sweep")  #: All cases.

    @property
    def refused(self) -> Counter[str]:
        """Reasons, and how many cases each refused."""
        return Counter(reason for reason in self.rows["refusal"] if reason)

    def __str__(self) -> str:
        refused = self.refused
        lines = [f"{self.rows['case'].nunique()} cases, {refused.total()} refused"]
        lines += [f"  {count} times such as: {text}" for text, count in refused.most_common(3)]
        return "\n".join(lines)

    def _write(self, out: Path) -> dict[str, Any]:
        from reports.figures.energy import sweep_figure
        from reports.figures.style import save_figure

        about = super()._write(out)
        done = self.rows[self.rows["refusal"] == ""]
        if len(done):
            save_figure(sweep_figure(done, self.axis), out, "sweep")
        return about


def sweep(
    machine: Machine,
    vary: Sequence[str],
    folder: str | Path,
    *,
    workers: int | str = 1,
    **options: Any,
) -> Swept:
    """Walk with every combination of values.

    Args:
        machine: From `load`, with a floating base.
        vary: Numbers of ``--set`` with their values, such as ``"speed=0.1:0.4:7 m/s"``.
        folder: In which finished cases are kept until all are done; a run that was stopped goes on
            from them.
        workers: Processes, or the address of a Dask scheduler.
        **options: See `pipeline.simulation.walk_stand.WalkOptions`.

    Raises:
        LegwattError: Unusable axes or machine, or workers that are gone; what was finished stays.
    """
    import pandas

    machine, out = machine.walking(**options), Path(folder)
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
    point, work = out / f"sweep.{digest[:16]}.jsonl", partial(rows_of_case, machine, axes)
    with output_errors(out):
        found = resumed(work, {str(case[0]): case for case in every}, point, digest, workers)
    columns = [name for name in declared("sweep") if name not in ("", "case", "*")]
    headers = ["case", *(axis.header for axis in axes), *columns]
    rows = pandas.DataFrame([row for case in found for row in case], columns=headers)
    return Swept("sweep", {"sweep": lambda: rows}, said, machine.inputs, axes[0].header, point)


def resumed(
    work: Callable[[Any], Any],
    tasks: Mapping[str, Any],
    path: Path,
    inputs: str,
    workers: int | str = 1,
) -> list[Any]:
    """Do what a file of finished tasks does not hold yet; all results in the order of the tasks.

    Args:
        work: Of one task; it returns what JSON can hold, and workers can import it.
        tasks: Name to a small description of what to do.
        path: One JSON line per finished task, headed by `inputs`. A file of other inputs is begun
            anew; a last line cut short by a kill is dropped.
        inputs: Hash of all that the results rest on.
        workers: Processes of this machine, 1 for the calling one; or the address of a Dask
            scheduler (``tcp://host:8786``), whose workers have this project at the same version.

    Raises:
        LegwattError: No such scheduler, it has no workers or died; a task ended several workers;
            the number of workers is out of range; what `work` raised, as it raised it.
    """
    from tqdm import tqdm

    head, done = json.dumps({"inputs": inputs}), {}
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    for line in lines[1:] if lines[:1] == [head] else ():
        with suppress(json.JSONDecodeError):
            entry = json.loads(line)
            done[entry["task"]] = entry["result"]
    kept = [json.dumps({"task": name, "result": result}) for name, result in done.items()]
    left = [name for name in tasks if name not in done]
    finished = _finished(work, [tasks[name] for name in left], workers)
    shown = tqdm(finished, None, len(tasks), initial=len(kept), leave=False, disable=None)
    for count, (place, result) in enumerate(shown):
        done[left[place]] = result
        if not count:  # nothing is written before there is a result
            write_text(path, "\n".join([head, *kept]) + "\n")
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"task": left[place], "result": result}) + "\n")
    return [done[name] for name in tasks]


def _finished(
    work: Callable[[Any], Any], tasks: Sequence[Any], workers: int | str
) -> Iterator[tuple[int, Any]]:
    """Each task's place in `tasks` and its result, in the order in which they finish."""
    if isinstance(workers, int) and not 1 <= workers <= 256:
        raise LegwattError(f"workers {workers}: give a number from 1 to 256")
    if workers == 1 or not tasks:
        yield from enumerate(map(work, tasks))
        return
    import distributed

    for name in ("distributed", "distributed.client", "tornado.application"):
        logging.getLogger(name).handlers = [logging.NullHandler()]  # what matters is said below
    where = workers if isinstance(workers, str) else "a local cluster"
    with ExitStack() as closing:
        try:
            cluster: Any = workers
            if isinstance(workers, int):
                look: Any = {"dashboard_address": ":0", "silence_logs": logging.CRITICAL}
                count = min(workers, len(tasks))
                cluster = distributed.LocalCluster(count, threads_per_worker=1, **look)
                closing.enter_context(cluster)
            client = closing.enter_context(distributed.Client(cluster, timeout=_PATIENCE))
            client.wait_for_workers(1, timeout=_PATIENCE)
        except (OSError, ValueError, TimeoutError):
            raise LegwattError(f"{where}: no scheduler with workers answers") from None
        try:
            futures = client.map(work, tasks, pure=False)
            places = {future.key: place for place, future in enumerate(futures)}
            for future in distributed.as_completed(futures):
                yield places[future.key], future.result()
        except distributed.scheduler.KilledWorker:
            raise LegwattError(f"{where}: a case ended several workers; try fewer") from None
        except (distributed.client.FutureCancelledError, distributed.CancelledError, OSError):
            raise LegwattError(f"{where}: the scheduler is gone") from None
