"""Everything one run of `gap` computes, before anything is written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from pipeline.identification.compare.bandwidth import with_encoder_noise
from pipeline.identification.compare.circumstances import Tally, Where, edges_of, where
from pipeline.identification.compare.loaded import LoadedLogs
from pipeline.identification.compare.long import LongLogs
from pipeline.identification.compare.model_check import against_model, drifts, rows_left
from pipeline.identification.compare.observe import observe
from pipeline.identification.workflow.setup import Setup
from pipeline.logs.prepared.measurement import Measurement
from pipeline.logs.prepared.parts import Parts
from pipeline.logs.quality.finding import refuse
from pipeline.machine.machine import MachineModel
from pipeline.simulation.along_logs import wrong_columns
from pipeline.simulation.predict import Prediction, Simulator


@dataclass(frozen=True, eq=False)
class Compared:
    """Steps 1 and 2."""

    loaded: LoadedLogs  #: The logs.
    parts: Parts  #: Of the logs.
    fitted: int  #: How many of them may be fitted, the first ones.
    measurements: tuple[Measurement, ...]  #: One per log.
    predictions: tuple[Prediction, ...]  #: By the model as it is.
    rows: tuple[Where, ...]  #: Of `where.csv`.


def compare_logs(
    given: Setup, model: MachineModel, loaded: LoadedLogs, parts: Parts, fitted: int
) -> Compared:
    """Simulate every log's own motion and table the gap.

    Raises:
        GapError: The model does not predict what the log measures, or betrays a wrong unit.
    """
    seen = observe(model, loaded.prepared, parts)
    measurements = with_encoder_noise(given.bare, loaded.prepared, seen)
    predictions = predict(model, measurements)
    log, ratio = loaded.prepared[0].log, given.expected.ratio
    findings = [f for m in measurements for f in rows_left(m) if f.verdict == "refused"]
    findings += [] if findings else wrong_columns(given.bare, measurements, log, ratio)
    refuse(findings)
    findings += [
        finding
        for m, prediction in zip(measurements, predictions, strict=True)
        for finding in against_model(m, prediction)
    ]
    refuse(findings)
    findings += drifts(measurements, predictions)
    if loaded.long is None:
        rows = where(measurements, predictions, legs_of(given))
    else:
        rows = _where_in_chunks(given, model, loaded.long, measurements, predictions)
    loaded = judged(loaded)
    loaded = replace(loaded, findings=(*loaded.findings, *findings))
    return Compared(loaded, parts, fitted, measurements, predictions, rows)


def judged(loaded: LoadedLogs) -> LoadedLogs:
    """With the judgement on every row where only stretches are held.

    Raises:
        GapError: A chunk cannot be used.
    """
    if loaded.long is None:
        return loaded
    return replace(loaded, findings=loaded.long.findings(loaded.findings))


def _where_in_chunks(
    given: Setup,
    model: MachineModel,
    long: LongLogs,
    measurements: Sequence[Measurement],
    predictions: Sequence[Prediction],
) -> tuple[Where, ...]:
    """The table of every row, in the bands of the stretches that stand for the logs."""
    edges = [
        edges_of(m, prediction, long.span(k))
        for k, (m, prediction) in enumerate(zip(measurements, predictions, strict=True))
    ]
    tally = Tally(legs_of(given))
    for k, simulator in long.chunks(model, measurements):
        tally.add(simulator.measurement, simulator.predict(model), edges[k])
    return tally.ranked(measurements)


def predict(model: MachineModel, measurements: Sequence[Measurement]) -> tuple[Prediction, ...]:
    """What a model says the sensors of every log show."""
    return tuple(Simulator(m).predict(model) for m in measurements)


def legs_of(given: Setup) -> dict[str, int] | None:
    """Joint to its leg's column; None without legs on the ground."""
    if given.robot is None or not given.robot.floating:
        return None
    legs = given.robot.spec.legs
    return {joint: k for k, leg in enumerate(legs) for joint in leg.joints}
