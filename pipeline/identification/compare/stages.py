"""The gap step by step: the model as it was, with one effect after another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from actuators.arrays import Array
from pipeline.identification.compare.circumstances import gap_of
from pipeline.identification.compare.long import LongLogs
from pipeline.identification.regression.floor import floor_of
from pipeline.logs.prepared.measurement import TEST, VALIDATION, Measurement
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Prediction, Simulator


@dataclass(frozen=True, eq=False)
class Stage:
    """One model along all logs."""

    label: str  #: What it has that the one before has not.
    predictions: tuple[Prediction, ...]  #: One per log.
    #: Root mean square on test rows by joint and channel, shape (J, C), NaN where no row counts.
    gaps: Array
    valid: Array  #: The same on validation rows, of the compared channel, shape (J,).

    @property
    def gap(self) -> Array:
        """On test rows, of the compared channel, by joint, shape (J,)."""
        return np.asarray(self.gaps[:, 0])


def stages(
    models: Sequence[tuple[str, MachineModel]],
    measurements: Sequence[Measurement],
    long: LongLogs | None = None,
) -> tuple[Stage, ...]:
    """Simulate models one after another; what one shares with the next is computed once.

    Args:
        models: Label and model, each like the one before but for one effect.
        measurements: One per log.
        long: The logs in chunks, where measurements hold but stretches of them: the gap is then
            that of every test row.
    """
    by_log = [_along(models, Simulator(m)) for m in measurements]
    held = list(zip(measurements, by_log, strict=True))
    chosen = _root([_squares(m, predictions, VALIDATION) for m, predictions in held])
    if long is None:
        proved = _root([_squares(m, predictions, TEST) for m, predictions in held])
    else:
        proved = _root(
            [
                _squares(simulator.measurement, _along(models, simulator), TEST)
                for _, simulator in long.chunks(models[0][1], measurements)
                if (simulator.measurement.part == TEST).any()
            ]
        )
    return tuple(
        Stage(label, tuple(predictions[k] for predictions in by_log), proved[k], chosen[k, :, 0])
        for k, (label, _) in enumerate(models)
    )


def _along(models: Sequence[tuple[str, MachineModel]], simulator: Simulator) -> list[Prediction]:
    """Predictions of all models for one log or chunk."""
    out: list[Prediction] = []
    for _, model in models:
        out.append(simulator.predict(model, out[-1] if out else None))
    return out


def _squares(m: Measurement, predictions: Sequence[Prediction], part: int) -> Array:
    """Squared gaps and rows on a part, by model, joint and channel, shape (2, M, J, C)."""
    inside = m.part == part
    out = np.zeros((2, len(predictions), len(m.joints), len(m.channels)))
    for k, prediction in enumerate(predictions):
        for c in range(len(m.channels)):
            rest = gap_of(m, prediction, c)[inside]
            good = np.isfinite(rest)
            out[0, k, :, c] = (np.where(good, rest, 0.0) ** 2).sum(axis=0)
            out[1, k, :, c] = good.sum(axis=0)
    return out


def _root(squares: Sequence[Array]) -> Array:
    """Root mean square by model, joint and channel, shape (M, J, C); NaN without rows."""
    total = np.sum(squares, axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.sqrt(total[0] / total[1]))


def overall(gap: Array) -> float:
    """Root mean square over joints."""
    known = gap[np.isfinite(gap)]
    return float(np.sqrt(np.mean(known**2))) if known.size else 0.0


def noise_floor(measurements: Sequence[Measurement]) -> Array:
    """Of the compared channel by joint, of the test logs, shape (J,)."""
    return np.asarray(floor_of(measurements, TEST)[:, 0])
