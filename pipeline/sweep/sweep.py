"""A sweep from its axes to its Parquet file.

Finished blocks of cases stand in a file beside it, whose name is that of this sweep, until all are
done: a run that is stopped goes on from them, and those of another sweep are never touched.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Final

import pyarrow as pa
import pyarrow.parquet as pq

from pipeline.atomic import replacing
from pipeline.checkpoint import Checkpoint
from pipeline.sweep.case import Order, SweepRow, digest_of, machine_of, rows_of_block
from pipeline.sweep.plan import Axis, SweepError, cases_of, read_axes

#: Cases that are computed together: no more than these are done again after a kill.
BLOCK: Final = 4
FILE: Final = "sweep.parquet"
_KEY: Final = b"legwatt_sweep"


@dataclass(frozen=True)
class Swept:
    """A finished sweep."""

    file: Path  #: The Parquet file.
    cases: int  #: How many.
    kept: int  #: How many of them an earlier run had done.
    refused: Counter[str]  #: First words of the reasons, and how many cases each refused.

    def __str__(self) -> str:
        lost = sum(self.refused.values())
        lines = [f"{self.cases} cases in {self.file}, {lost} refused"]
        if self.kept:
            lines[0] += f"; {self.kept} were done before"
        lines += [f"  {count} times such as: {text}" for text, count in self.refused.most_common(3)]
        return "\n".join(lines)


def sweep(
    order: Order,
    vary: Sequence[str],
    out: Path,
    *,
    sample: int | None = None,
    seed: int = 1,
    workers: int = 1,
    scheduler: str | None = None,
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
        workers: Processes.
        scheduler: Address of a Dask scheduler in place of them.

    Raises:
        PipelineError: Unusable axes or machine, another sweep's file in the folder, or workers that
            are gone; what was finished stays.
        ActuatorError: An actuator file cannot be used.
    """
    digest = digest_of(order)
    axes = read_axes(vary, machine_of(order))
    cases = cases_of(axes, sample, seed)
    whole = hashlib.sha256(f"{digest} {axes} {cases}".encode()).hexdigest()
    file = out / FILE
    kept = len(cases)
    if not _is_there(file, whole):
        blocks = {str(k): (k, cases[k : k + BLOCK]) for k in range(0, len(cases), BLOCK)}
        point = Checkpoint(out / f"sweep.{whole[:16]}.jsonl", whole)
        kept = sum(len(blocks[name][1]) for name in point.done)
        found = point.run(
            partial(rows_of_block, order, digest, axes),
            blocks,
            workers=workers,
            scheduler=scheduler,
            title="blocks of cases",
        )
        rows = [row for block in found for row in block]
        with replacing(file) as temporary:
            pq.write_table(pa.Table.from_pylist(rows, schema=_schema(axes, whole)), temporary)
        point.path.unlink(missing_ok=True)
    reasons = pq.read_table(file, columns=["refusal"]).column(0).to_pylist()
    return Swept(file, len(cases), kept, Counter(r for r in reasons if r))


def _is_there(file: Path, digest: str) -> bool:
    """Whether the file is there; refuses one of another sweep."""
    if not file.exists():
        return False
    try:
        said = (pq.read_schema(file).metadata or {}).get(_KEY)
    except (pa.ArrowInvalid, OSError):
        said = None
    if said != digest.encode():
        raise SweepError(f"{file}: not of this sweep; choose another --out, or move or remove it")
    return True


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
