"""Everything one run of `gap` computes, before anything is written."""

from __future__ import annotations

import logging
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from types import TracebackType
from typing import Any, Final

from pipeline.identification.compare.bandwidth import with_encoder_noise
from pipeline.identification.compare.circumstances import Tally, Where, edges_of, where
from pipeline.identification.compare.intake import Intake
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

logger = logging.getLogger("legwatt")
#: Share of a run's time that has usually passed when a step begins, by the first word of its text;
#: shared out from where the demonstration and the blind trials spend theirs.
_BEGUN: Final = {
    "reading": 0.0,
    "simulating": 0.1,
    "driving": 0.2,
    "letting": 0.2,
    "fitting": 0.3,
    "weighing": 0.7,
    "writing": 0.9,
}


class Progress:
    """Steps of a run as a bar with the time that is left, roughly; on a terminal only.

    Attributes:
        seconds: What every step took so far, by its text [s].
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._running = ""
        self._since = 0.0
        self._bar: Any = None
        if sys.stderr.isatty():
            from tqdm import tqdm

            form = "{desc:<36}|{bar}| {elapsed}, about {remaining} left"
            self._bar = tqdm(total=1.0, bar_format=form, leave=False, smoothing=0.0)

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stop()
        if self._bar is not None:
            self._bar.close()

    def took(self) -> str:
        """Every step and its seconds, the longest first, in words."""
        longest = sorted(self.seconds.items(), key=lambda item: -item[1])
        return ", ".join(f"{text} {seconds:.1f} s" for text, seconds in longest)

    def _stop(self) -> None:
        if self._running:
            past = perf_counter() - self._since
            self.seconds[self._running] = self.seconds.get(self._running, 0.0) + past
            logger.info("%s took %.1f s", self._running, past)
        self._running = ""

    def step(self, text: str) -> None:
        """Say what comes next."""
        self._stop()
        self._running, self._since = text, perf_counter()
        if self._bar is not None:
            self._bar.set_description_str(text)
            begun = _BEGUN.get(text.partition(" ")[0], self._bar.n)
            self._bar.update(max(0.0, begun - self._bar.n))


@dataclass(frozen=True, eq=False)
class Whereabouts:
    """Steps 1 and 2.

    Attributes:
        intake: The logs.
        parts: Of the logs.
        fitted: How many of them may be fitted, the first ones.
        measurements: One per log.
        predictions: By the model as it is.
        rows: Of `where.csv`.
    """

    intake: Intake
    parts: Parts
    fitted: int
    measurements: tuple[Measurement, ...]
    predictions: tuple[Prediction, ...]
    rows: tuple[Where, ...]


def find_where(
    given: Setup, model: MachineModel, intake: Intake, parts: Parts, fitted: int
) -> Whereabouts:
    """Simulate every log's own motion and table the gap.

    Raises:
        GapError: The model does not predict what the log measures, or betrays a wrong unit.
    """
    seen = observe(model, intake.prepared, parts)
    measurements = with_encoder_noise(given.bare, intake.prepared, seen)
    predictions = predict(model, measurements)
    log, ratio = intake.prepared[0].log, given.expected.ratio
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
    if intake.long is None:
        rows = where(measurements, predictions, legs_of(given))
    else:
        rows = _where_in_chunks(given, model, intake.long, measurements, predictions)
    intake = judged(intake)
    intake = replace(intake, findings=(*intake.findings, *findings))
    return Whereabouts(intake, parts, fitted, measurements, predictions, rows)


def judged(intake: Intake) -> Intake:
    """With the judgement on every row where only stretches are held.

    Raises:
        GapError: A chunk cannot be used.
    """
    if intake.long is None:
        return intake
    return replace(intake, findings=intake.long.findings(intake.findings))


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
