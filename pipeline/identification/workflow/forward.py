"""Step `forward`: a model drives itself under its servos' law, and is compared with the machine.

What is simulated are the logs of `--holdout`, or the logs themselves without it; nothing is
estimated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from actuators.arrays import Array
from pipeline.effects.base import place_text
from pipeline.effects.model_file import apply_edits
from pipeline.identification.workflow.compared import Compared
from pipeline.identification.workflow.options import Order
from pipeline.identification.workflow.written import AS_IT_WAS
from pipeline.logs.recording import Recording
from pipeline.simulation.forward import ForwardSimulator, Rollout, servo_input
from pipeline.simulation.machine import Machine


@dataclass(frozen=True, eq=False)
class Drive:
    """One model along one log."""

    log: Recording  #: What the machine did.
    model: str  #: What the model has that the one before has not.
    rollout: Rollout  #: What the model did.

    @property
    def miss(self) -> Array:
        """Measured minus simulated position, shape (N, J) [rad]; NaN where it was not measured."""
        return self.log.position - self.rollout.position


def forward(given: Machine, compared: Compared, options: Order) -> tuple[Drive, ...]:
    """Simulate every model along every log, the model as it was first.

    Args:
        given: Robot, actuators, effects of the model file.
        compared: Steps 1 and 2 with all logs.
        options: Of the command.

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
    out = []
    for label, model in models:
        machine = ForwardSimulator(model)
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
