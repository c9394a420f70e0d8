"""The gap step by step: the model as it was, with tolerances, with one effect after another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.gap.circumstances import gap_of
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
    models: Sequence[tuple[str, MachineModel]], measurements: Sequence[Measurement]
) -> tuple[Stage, ...]:
    """Simulate models one after another; what one shares with the next is computed once.

    Args:
        models: Label and model, each like the one before but for one effect.
        measurements: One per log.
    """
    simulators = [Simulator(m) for m in measurements]
    out: list[Stage] = []
    for label, model in models:
        near = out[-1].predictions if out else (None,) * len(simulators)
        predictions = tuple(s.predict(model, n) for s, n in zip(simulators, near, strict=True))
        out.append(Stage(label, predictions, prove_gap(measurements, predictions)))
    return tuple(out)


def prove_gap(measurements: Sequence[Measurement], predictions: Sequence[Prediction]) -> Array:
    """Root mean square gap by joint on *prove*, shape (J,)."""
    square = np.zeros(len(measurements[0].joints))
    count = np.zeros_like(square)
    for m, prediction in zip(measurements, predictions, strict=True):
        rest = gap_of(m, prediction)[m.part == PROVE]
        good = np.isfinite(rest)
        square += (np.where(good, rest, 0.0) ** 2).sum(axis=0)
        count += good.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.sqrt(square / count))


def overall(gap: Array) -> float:
    """Root mean square over joints."""
    known = gap[np.isfinite(gap)]
    return float(np.sqrt(np.mean(known**2))) if known.size else 0.0


def noise_floor(measurements: Sequence[Measurement]) -> Array:
    """Of the compared channel by joint, shape (J,)."""
    return np.sqrt(np.mean([m.noise[:, 0] ** 2 for m in measurements], axis=0))
