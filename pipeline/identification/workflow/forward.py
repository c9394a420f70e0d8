"""Step `forward`: a model drives itself under its servos' law, and is compared with the machine.

What is simulated are the logs of `--holdout`, or the logs themselves without it; nothing is
estimated.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pipeline.columns import frame, series
from pipeline.effects.base import place_text
from pipeline.effects.model_file import apply_edits
from pipeline.identification.workflow.compared import Compared, Order
from pipeline.identification.workflow.written import AS_IT_WAS
from pipeline.simulation.forward import ForwardSimulator, servo_input
from pipeline.simulation.machine import Machine

if TYPE_CHECKING:
    from pandas import DataFrame


def forward(given: Machine, compared: Compared, options: Order) -> dict[str, DataFrame]:
    """Simulate every model along every log, the model as it was first.

    Returns:
        Errors by model, log and joint, then over all logs; and the motion of each log.

    Raises:
        LegwattError: A log does not say what drives the servos, or the machine is none that can be
            simulated forward.
    """
    start = len(options.logs) if options.holdout else 0
    logs = [one.recording for one in compared.logs[start:] if one.recording is not None]
    servos = [servo_input(log) for log in logs]
    models = [(AS_IT_WAS, given.bare_model)]
    for edit in given.stated_file.edits:
        label = f"{edit.effect} at {place_text(edit.place)}"
        models.append((label, apply_edits(models[-1][1], [edit])))
    rows, runs = [], []
    for label, model in models:
        machine = ForwardSimulator(model)
        runs.append([machine.run(servo) for servo in servos])
        misses = {
            log.name: log.position - run.position for log, run in zip(logs, runs[-1], strict=True)
        }
        misses["all"] = np.concatenate([*misses.values()])
        for j, joint in enumerate(given.model.joints):
            for name, miss in misses.items():
                size = np.abs(miss[np.isfinite(miss[:, j]), j])
                numbers = (float(np.sqrt(np.mean(size**2))), float(np.mean(size)))
                rows.append((label, name, joint, *numbers, float(size.max()), int(size.size)))
    tables = {"forward": frame("forward", rows)}
    for log, before, after in zip(logs, runs[0], runs[-1], strict=True):
        values = {
            "measured_position_rad": log.position,
            "before_position_rad": before.position,
            "after_position_rad": after.position,
            "after_voltage_V": after.voltage,
        }
        tables[f"rollout_{log.name}"] = series(log.time, {}, given.model.joints, values)
    return tables
