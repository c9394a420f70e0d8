"""Step `forward`: a model drives itself under its servos' law, and is compared with the machine.

Tolerances are estimated on the logs, for each model anew, as for step `shrink`; what is simulated
are the logs of `--holdout`, or the logs themselves without it.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.effects.model_file import apply_edits
from pipeline.identification.selection.weigh import Weighing
from pipeline.identification.workflow.locate import Whereabouts
from pipeline.identification.workflow.setup import Setup
from pipeline.identification.workflow.written import AS_IT_WAS
from pipeline.logs.reading.log import Log
from pipeline.simulation.forward import ForwardSimulator, Rollout, servo_input
from reports.pages.gap_words import place_text
from reports.table import Table
from reports.tables import forward as tables

Array = NDArray[np.float64]
ALL_LOGS = "all"


@dataclass(frozen=True, eq=False)
class Drive:
    """One model along one log.

    Attributes:
        log: What the machine did.
        model: What the model has that the one before has not.
        rollout: What the model did.
    """

    log: Log
    model: str
    rollout: Rollout

    @property
    def miss(self) -> Array:
        """Measured less simulated position, shape (N, J) [rad]; NaN where it was not measured."""
        return self.log.position - self.rollout.position


def forward(given: Setup, where: Whereabouts, options: argparse.Namespace) -> tuple[Drive, ...]:
    """Simulate every model along every log, the model as it was first.

    Args:
        given: Robot, actuators, effects of the model file.
        where: Steps 1 and 2 with all logs.
        options: Of the command.

    Raises:
        GapError: A log does not say what drives the servos, or the machine is none that can be
            simulated forward.
    """
    start = len(options.logs) if options.holdout else 0
    logs = [one.log for one in where.intake.prepared[start:]]
    servos = [servo_input(log) for log in logs]
    models = [(AS_IT_WAS, given.bare)]
    for edit in given.file.edits:
        label = f"{edit.effect} at {place_text(edit.place)}"
        models.append((label, apply_edits(models[-1][1], [edit])))
    out = []
    weighing = Weighing(given.bare, where.measurements)
    for label, model in models:
        machine = ForwardSimulator(weighing.calibrated(model))
        out += [
            Drive(log, label, machine.run(servo)) for log, servo in zip(logs, servos, strict=True)
        ]
    return tuple(out)


def rms(drives: Sequence[Drive]) -> float:
    """Root mean square position error of all joints [rad]."""
    return float(np.sqrt(np.nanmean(np.concatenate([d.miss.ravel() for d in drives]) ** 2)))


def by_model(drives: Sequence[Drive]) -> dict[str, list[Drive]]:
    """Drives of each model, the one as it was first."""
    out: dict[str, list[Drive]] = {}
    for drive in drives:
        out.setdefault(drive.model, []).append(drive)
    return out


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


def say(drives: Sequence[Drive]) -> None:
    """What a person wants to know first."""
    logs = len({d.log.name for d in drives})
    for model, own in by_model(drives).items():
        print(
            f"{model}: position misses by {1e3 * rms(own):.1f} mrad root mean square, {logs} logs"
        )
