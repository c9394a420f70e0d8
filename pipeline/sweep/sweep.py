"""A sweep from its axes to its Parquet file."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

import pyarrow.parquet as pq

from pipeline.spread import spread
from pipeline.sweep.case import Order, digest_of, machine_of, rows_of_block
from pipeline.sweep.plan import cases_of, read_axes
from pipeline.sweep.store import Store

#: Cases that are computed together: no more than these are done again after a kill.
BLOCK: Final = 4


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
    method: str = "sobol",
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
        sample: See `cases_of`, as are method and seed.
        method: ``sobol`` or ``lhs``.
        seed: Of the draw.
        workers: Processes.
        scheduler: Address of a Dask scheduler in place of them.

    Raises:
        PipelineError: Unusable axes or machine, another sweep in the folder, or workers that are
            gone; what was finished stays.
        ActuatorError: An actuator file cannot be used.
    """
    digest = digest_of(order)
    axes = read_axes(vary, machine_of(order))
    cases = cases_of(axes, sample, method, seed)
    whole = hashlib.sha256(f"{digest} {axes} {cases}".encode()).hexdigest()
    blocks = [(k, tuple(cases[k : k + BLOCK])) for k in range(0, len(cases), BLOCK)]
    store = Store(out, axes, whole, len(blocks))
    kept = len(cases) if store.complete else sum(len(blocks[k][1]) for k in store.done)
    if not store.complete:
        left = [k for k in range(len(blocks)) if k not in store.done]
        for place, rows in spread(
            partial(rows_of_block, order, digest, axes),
            [blocks[k] for k in left],
            workers=workers,
            scheduler=scheduler,
            title="blocks of cases",
            done=len(store.done),
        ):
            store.add(left[place], rows)
        store.finish()
    reasons = pq.read_table(store.file, columns=["refusal"]).column(0).to_pylist()
    return Swept(store.file, len(cases), kept, Counter(r for r in reasons if r))
