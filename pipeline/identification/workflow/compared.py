"""One run of `gap` up to the residuals: its logs loaded, simulated and compared."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from actuators.errors import LegwattError
from pipeline.identification.compare.circumstances import Tally, Where, edges_of, where
from pipeline.identification.compare.loaded import (
    LoadedLogs,
    as_asked,
    lowered,
    naming_cutoff,
    prepare_logs,
    refuse_moved,
    with_encoder_noise,
    without_useless,
)
from pipeline.identification.compare.long import LONG_ROWS, LongLogs, parts_of_surveys
from pipeline.identification.compare.model_check import against_model, drifts, rows_left
from pipeline.identification.compare.observe import observe
from pipeline.identification.workflow.options import Order, expected_of
from pipeline.logs.columns.findings import explained
from pipeline.logs.errors import Finding, refuse
from pipeline.logs.prepared.measurement import Contact, Measurement, find_contact
from pipeline.logs.prepared.parts import Parts, split
from pipeline.logs.prepared.stream import Stream, Survey, survey
from pipeline.logs.quality.checks import OF_LIMITS, refuse_repeats
from pipeline.logs.reading.log import Log
from pipeline.logs.reading.mapping import load_mapping
from pipeline.machine.machine import MachineModel
from pipeline.simulation.along_logs import wrong_columns
from pipeline.simulation.machine import Machine
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


def load_logs(given: Machine, options: Order) -> tuple[LoadedLogs, Parts, int]:
    """Step 1: read, check, prepare and split all logs.

    All scores are taken at one bandwidth: `--cutoff`, else where the encoders' noise is silent.
    Of logs with more than `LONG_ROWS` rows together only the most informative stretches are held.

    Returns:
        The logs, their parts, and how many of them may be fitted (the first ones).

    Raises:
        LegwattError: Unusable input; one line.
    """
    expected = expected_of(given)
    mapping = load_mapping(options.mapping) if options.mapping else None
    paths = (*options.logs, *options.holdout)
    if mapping is not None:
        mapping.refuse_unknown_logs(paths)

    adjust = partial(
        as_asked,
        effort=options.effort,
        base=options.base,
        supply=options.step == "power",
        motors=all(a.motor is not None for a in given.model.actuators[:1]),
    )
    every = [Stream(path, expected, mapping, adjust) for path in paths]
    streams, count, unread = _readable(every, len(options.logs))
    surveys: tuple[Survey, ...] = ()
    if sum(stream.rows for stream in streams) > LONG_ROWS:
        lasts = [options.prove_last if k < count else None for k in range(len(streams))]
        surveys = tuple(survey(s, prove_last=t) for s, t in zip(streams, lasts, strict=True))
    logs = [s.log for s in surveys] or [stream.whole for stream in streams]
    refuse_repeats(logs)
    refuse_moved(given.mimics, logs, expected)
    largest, contact = _largest(given), _contact(given, options.gait_start)

    loaded = prepare_logs(
        logs,
        expected,
        fitted=count,
        cutoff=options.cutoff,
        largest=largest,
        contact=contact,
    )
    loaded = replace(loaded, of_logs=(*unread, *loaded.of_logs)).at(loaded.prepared)
    count = sum(k < count for k in loaded.kept)
    streams = [streams[k] for k in loaded.kept]
    surveys = tuple(surveys[k] for k in loaded.kept) if surveys else ()
    if options.cutoff is None and options.step != "read":
        # By the machine as its files say: what a model file adds changes no bandwidth.
        cutoff = naming_cutoff(given.bare_model, loaded.prepared)
        loaded = loaded.at(lowered(loaded.prepared, cutoff))
    refuse(loaded.findings)
    prepared = loaded.prepared
    last = None if surveys else options.prove_last
    parts = split(prepared[:count], holdout=prepared[count:], prove_last=last)
    if surveys:
        parts = parts_of_surveys(parts, prepared, surveys)
        long = LongLogs(tuple(streams), surveys, prepared, parts, largest, contact)
        loaded = replace(loaded, long=long)
    return loaded, parts, count


def _readable(streams: Sequence[Stream], fitted: int) -> tuple[list[Stream], int, list[Finding]]:
    """Logs that can be read, how many of them may be fitted, and what is said of the others.

    Raises:
        LegwattError: None can be, or none of those that are held out.
    """
    useless: dict[int, str] = {}
    for k, stream in enumerate(streams):
        try:
            if stream.rows <= LONG_ROWS:
                _ = stream.whole
        except LegwattError as error:
            useless[k] = str(error)
    said = without_useless([stream.path.stem for stream in streams], fitted, useless)
    kept = [k for k in range(len(streams)) if k not in useless]
    return [streams[k] for k in kept], sum(k < fitted for k in kept), said


def _with_rows(
    loaded: LoadedLogs, parts: Parts, fitted: int, measurements: Sequence[Measurement]
) -> tuple[LoadedLogs, Parts, int, tuple[Measurement, ...]]:
    """The logs of which rows are left to compare.

    Raises:
        LegwattError: None is left to fit or to test on: what took most rows.
    """
    useless = {
        k: f"{m.name}: {f.detail}"
        for k, m in enumerate(measurements)
        for f in rows_left(m)
        if f.verdict == "refused"
    }
    said = without_useless([m.name for m in measurements], fitted, useless)
    if not useless or loaded.long is not None:
        return loaded, parts, fitted, tuple(measurements)
    kept = [k for k in range(len(measurements)) if k not in useless]
    loaded = replace(loaded, of_logs=(*said, *loaded.of_logs))
    loaded = loaded.at([loaded.prepared[k] for k in kept])
    parts = replace(
        parts,
        part=tuple(parts.part[k] for k in kept),
        block=tuple(parts.block[k] for k in kept),
    )
    return loaded, parts, sum(k < fitted for k in kept), tuple(measurements[k] for k in kept)


def _contact(given: Machine, start: float | None) -> Callable[[Log], Contact | None] | None:
    robot = given.loaded
    if robot is None or not robot.floating:
        if start is not None:
            raise LegwattError(f"{given.path}: its base is fixed; no gait starts in its log")
        return None
    return partial(find_contact, robot=robot, start=start)


def _largest(given: Machine) -> dict[str, np.ndarray]:
    """What the drives can give at most, by channel; empty where no motor is known."""
    motors = [a.motor for a in given.model.actuators if a.motor is not None]
    if len(motors) < len(given.model.joints):
        return {}
    return {
        "current": np.array([m.peak_current for m in motors]),
        "voltage": np.array([m.supply_voltage for m in motors]),
        "power": np.array([m.peak_current * m.supply_voltage for m in motors]),
    }


def compare_logs(
    given: Machine, model: MachineModel, loaded: LoadedLogs, parts: Parts, fitted: int
) -> Compared:
    """Simulate every log's own motion and table the gap.

    Raises:
        LegwattError: The model does not predict what the log measures, or betrays a wrong unit.
    """
    seen = observe(model, loaded.prepared, parts)
    loaded, parts, fitted, seen = _with_rows(loaded, parts, fitted, seen)
    measurements = with_encoder_noise(given.bare_model, loaded.prepared, seen)
    predictions = predict(model, measurements)
    log, ratio = loaded.prepared[0].log, expected_of(given).ratio
    findings = wrong_columns(given.bare_model, measurements, log, ratio)
    beyond = [f for f in loaded.of_logs if f.check in OF_LIMITS and f.verdict == "suspected"]
    others = [f for f in loaded.of_logs if f not in beyond]
    loaded = replace(loaded, of_logs=(*others, *explained(beyond, findings)))
    loaded = loaded.at(loaded.prepared)
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
        # Of every row, in the bands of the stretches that stand for the logs.
        edges = [
            edges_of(m, prediction, loaded.long.span(k))
            for k, (m, prediction) in enumerate(zip(measurements, predictions, strict=True))
        ]
        tally = Tally(legs_of(given))
        for k, simulator in loaded.long.chunks(model, measurements):
            tally.add(simulator.measurement, simulator.predict(model), edges[k])
        rows = tally.ranked(measurements)
    loaded = judged(loaded)
    loaded = replace(loaded, findings=(*loaded.findings, *findings))
    return Compared(loaded, parts, fitted, measurements, predictions, rows)


def judged(loaded: LoadedLogs) -> LoadedLogs:
    """With the judgement on every row where only stretches are held.

    Raises:
        LegwattError: A chunk cannot be used.
    """
    if loaded.long is None:
        return loaded
    return replace(loaded, findings=loaded.long.findings(loaded.findings))


def predict(model: MachineModel, measurements: Sequence[Measurement]) -> tuple[Prediction, ...]:
    """What a model says the sensors of every log show."""
    return tuple(Simulator(m).predict(model) for m in measurements)


def legs_of(given: Machine) -> dict[str, int] | None:
    """Joint to its leg's column; None without legs on the ground."""
    if given.loaded is None or not given.loaded.floating:
        return None
    legs = given.loaded.spec.legs
    return {joint: k for k, leg in enumerate(legs) for joint in leg.joints}
