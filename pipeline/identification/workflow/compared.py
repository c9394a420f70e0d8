"""One run of `gap` up to the residuals: its logs loaded, simulated and compared."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from pipeline.identification.compare.circumstances import Tally, Where, edges_of, where
from pipeline.identification.compare.loaded import (
    LoadedLogs,
    lowered,
    naming_cutoff,
    prepare_logs,
    with_encoder_noise,
)
from pipeline.identification.compare.long import LONG_ROWS, LongLogs, parts_of_surveys
from pipeline.identification.compare.model_check import against_model, drifts, rows_left
from pipeline.identification.compare.observe import observe, observe_all
from pipeline.identification.workflow.options import Options
from pipeline.identification.workflow.setup import Setup
from pipeline.logs.errors import Finding, GapError, LogContentError, refuse
from pipeline.logs.prepared.measurement import Contact, Measurement, find_contact
from pipeline.logs.prepared.parts import Parts, split
from pipeline.logs.prepared.prepare import Prepared
from pipeline.logs.prepared.stream import Stream, Survey, survey
from pipeline.logs.quality.checks import refuse_repeats
from pipeline.logs.reading.log import Log
from pipeline.logs.reading.log_format import Expected
from pipeline.logs.reading.mapping import load_mapping
from pipeline.machine.machine import MachineModel
from pipeline.simulation.along_logs import wrong_columns
from pipeline.simulation.predict import Prediction, Simulator

#: A joint that moves by less is still and its encoder noisy: share of its range, or angle [rad]
#: where it has no range.
_STILL: Final = 0.01


@dataclass(frozen=True, eq=False)
class Compared:
    """Steps 1 and 2."""

    loaded: LoadedLogs  #: The logs.
    parts: Parts  #: Of the logs.
    fitted: int  #: How many of them may be fitted, the first ones.
    measurements: tuple[Measurement, ...]  #: One per log.
    predictions: tuple[Prediction, ...]  #: By the model as it is.
    rows: tuple[Where, ...]  #: Of `where.csv`.


def _adjusted(log: Log, given: Setup, options: Options) -> Log:
    """A log, or a piece of one, as the options want it; refused where it is not."""
    if options.effort:
        log = log.with_changes(chosen_effort=options.effort)
        _ = log.effort  # refuses a channel that is not there
    if options.base == "measured" and log.base_roll is None and log.base_pitch is None:
        raise LogContentError(
            f"{log.name}: --base measured needs base__roll_rad and base__pitch_rad; log them or "
            "use --base level"
        )
    if options.base in ("level", "fixed"):
        log = log.with_changes(base_roll=None, base_pitch=None)
    if log.supply_alone and options.step != "power":
        raise LogContentError(
            f"{log.name}: no effort of any joint, only the supply: that is for `gap power`; log "
            "torque, current, voltage or power per joint, or give the servos' gains"
        )
    actuators = given.model.actuators
    if actuators and actuators[0].motor is None and log.effort.channel != "torque":
        raise LogContentError(
            f"{log.name}: measures {log.effort.channel} and a bare URDF has no motor; name "
            "the actuator with --alternative"
        )
    return log


def load_logs(given: Setup, options: Options) -> tuple[LoadedLogs, Parts, int]:
    """Step 1: read, check, prepare and split all logs.

    All scores are taken at one bandwidth: `--cutoff`, else where the encoders' noise is silent.
    Of logs with more than `LONG_ROWS` rows together only the most informative stretches are held.

    Returns:
        The logs, their parts, and how many of them may be fitted (the first ones).

    Raises:
        GapError: Unusable input; one line.
    """
    mapping = load_mapping(options.mapping) if options.mapping else None
    paths = (*options.logs, *options.holdout)
    if mapping is not None:
        mapping.refuse_unknown_logs(paths)

    def adjust(log: Log) -> Log:
        return _adjusted(log, given, options)

    streams = [Stream(path, given.expected, mapping, adjust) for path in paths]
    count = len(options.logs)
    surveys: tuple[Survey, ...] = ()
    if sum(stream.rows for stream in streams) > LONG_ROWS:
        lasts = [options.prove_last if k < count else None for k in range(len(streams))]
        surveys = tuple(survey(s, prove_last=t) for s, t in zip(streams, lasts, strict=True))
    logs = [s.log for s in surveys] or [stream.whole for stream in streams]
    refuse_repeats(logs)
    refuse_moved(given.mimics, logs, given.expected)
    largest, contact = _largest(given), _contact(given, options.gait_start)

    def suspects(prepared: Sequence[Prepared]) -> Sequence[Finding]:
        seen = observe_all(given.bare, prepared)
        return wrong_columns(given.bare, seen, logs[0], given.expected.ratio)

    loaded = prepare_logs(
        logs,
        given.expected,
        cutoff=options.cutoff,
        largest=largest,
        contact=contact,
        wrong_columns=suspects,
    )
    if options.cutoff is None and options.step != "read":
        # By the machine as its files say: what a model file adds changes no bandwidth.
        cutoff = naming_cutoff(given.bare, loaded.prepared)
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


def refuse_moved(mimics: Mapping[str, str], logs: Iterable[Log], expected: Expected) -> None:
    """Stop where a log moves a joint that mimics another, or the one that it mimics.

    Raises:
        LogContentError: Names log and joints.
    """
    for log in logs:
        for joint, other in mimics.items():
            moved = [name for name in (joint, other) if _moves(log, name, expected)]
            if moved:
                raise LogContentError(
                    f"{log.name}: '{moved[0]}' moves, and '{joint}' mimics '{other}': a drive that "
                    "moves several joints is not computed; make it fixed in the URDF, or remove "
                    "<mimic> if it has a drive of its own"
                )


def _moves(log: Log, joint: str, expected: Expected) -> bool:
    if joint not in log.joints:
        return False
    k = log.joints.index(joint)
    q = log.position[:, k]
    q = q[np.isfinite(q)]
    span = float(expected.upper[k] - expected.lower[k])
    return q.size > 0 and float(np.ptp(q)) > _STILL * (span if np.isfinite(span) else 1.0)


def _contact(given: Setup, start: float | None) -> Callable[[Log], Contact | None] | None:
    robot = given.robot
    if robot is None or not robot.floating:
        if start is not None:
            raise GapError(f"{given.path}: its base is fixed; leave --gait-start out")
        return None
    return lambda log: find_contact(log, robot, start=start)


def _largest(given: Setup) -> dict[str, np.ndarray]:
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
