"""The gap step by step: the model as it was, with tolerances, with one effect after another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.gap.circumstances import gap_of
from pipeline.gap.long import LongLogs
from pipeline.gap.measurement import PROVE, Measurement
from pipeline.gap.model import MachineModel
from pipeline.gap.simulate import Prediction, Simulator

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Stage:
    """One model along all logs.

    Attributes:
        label: What it has that the one before has not.
        predictions: One per log.
        gap: Root mean square on *prove* by joint, shape (J,), NaN where no row counts.
    """

    label: str
    predictions: tuple[Prediction, ...]
    gap: Array


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
            that of every row that proves.
    """
    by_log = [_along(models, Simulator(m)) for m in measurements]
    if long is None:
        proving = list(zip(measurements, by_log, strict=True))
        squares = [_squares(m, predictions) for m, predictions in proving]
    else:
        squares = [
            _squares(simulator.measurement, _along(models, simulator))
            for _, simulator in long.chunks(models[0][1], measurements)
            if (simulator.measurement.part == PROVE).any()
        ]
    total = np.sum(squares, axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        gaps = np.sqrt(total[0] / total[1])
    return tuple(
        Stage(label, tuple(predictions[k] for predictions in by_log), gaps[k])
        for k, (label, _) in enumerate(models)
    )


def _along(models: Sequence[tuple[str, MachineModel]], simulator: Simulator) -> list[Prediction]:
    """Predictions of all models for one log or chunk."""
    out: list[Prediction] = []
    for _, model in models:
        out.append(simulator.predict(model, out[-1] if out else None))
    return out


def _squares(m: Measurement, predictions: Sequence[Prediction]) -> Array:
    """Squared gaps and rows on *prove*, by model and joint, shape (2, M, J)."""
    proves = m.part == PROVE
    out = np.zeros((2, len(predictions), len(m.joints)))
    for k, prediction in enumerate(predictions):
        rest = gap_of(m, prediction)[proves]
        good = np.isfinite(rest)
        out[0, k] = (np.where(good, rest, 0.0) ** 2).sum(axis=0)
        out[1, k] = good.sum(axis=0)
    return out


def overall(gap: Array) -> float:
    """Root mean square over joints."""
    known = gap[np.isfinite(gap)]
    return float(np.sqrt(np.mean(known**2))) if known.size else 0.0


def noise_floor(measurements: Sequence[Measurement]) -> Array:
    """Of the compared channel by joint, shape (J,)."""
    return np.sqrt(np.mean([m.noise[:, 0] ** 2 for m in measurements], axis=0))
