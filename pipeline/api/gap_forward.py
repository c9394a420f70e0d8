"""The tables of step `forward`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.identification.workflow.forward import Drive, by_model
from reports.table import Table
from reports.tables import forward as tables

Array = NDArray[np.float64]
ALL_LOGS = "all"


def forward_table(drives: Sequence[Drive], joints: Sequence[str]) -> Table:
    """Rows of `forward.csv`: by model, log and joint, then over all logs."""
    rows = []
    for model, own in by_model(drives).items():
        for j, joint in enumerate(joints):
            misses = [(d.log.name, d.miss[:, j]) for d in own]
            misses.append((ALL_LOGS, np.concatenate([miss for _, miss in misses])))
            rows += [_row(model, log, joint, miss) for log, miss in misses]
    return tables.forward(rows)


def _row(model: str, log: str, joint: str, miss: Array) -> dict[str, object]:
    size = np.abs(miss[np.isfinite(miss)])
    return {
        "model": model,
        "log": log,
        "joint": joint,
        "position_rms_rad": float(np.sqrt(np.mean(size**2))),
        "position_mean_abs_rad": float(np.mean(size)),
        "position_largest_rad": float(size.max()),
        "rows": int(size.size),
    }


def rollout_tables(drives: Sequence[Drive], joints: Sequence[str]) -> list[Table]:
    """One wide table per log: what the machine did, the model as it was, and with all effects."""
    models = by_model(drives)
    first, last = next(iter(models.values())), list(models.values())[-1]
    return [
        tables.rollout(
            before.log.name,
            joints,
            before.log.time,
            before.log.position,
            before.rollout.position,
            after.rollout.position,
            after.rollout.voltage,
        )
        for before, after in zip(first, last, strict=True)
    ]
