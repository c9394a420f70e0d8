"""Tables of what was held against the paper."""

from __future__ import annotations

from pipeline.paper.calibration.store import calibrated_numbers
from pipeline.paper.judgement.basis import Basis, Judged
from pipeline.paper.judgement.judge import judge
from pipeline.paper.judgement.readings import reading_rows
from pipeline.paper.judgement.sensitivity import sensitivity_rows
from pipeline.simulation.settings import Settings
from reports.table import Table
from reports.tables import judgement as tables


def judged(given: Settings, by: Basis) -> tuple[Judged, list[Table]]:
    """Everything held against the paper."""
    judgement = judge(
        given.robot, by.catalog, by.published, by.prior, by.results, samples=given.samples
    )
    out = [
        tables.reproduction(judgement.reproduction),
        tables.conclusions(judgement.conclusions),
        tables.rotor_friction(judgement.ranges),
        tables.break_even(judgement.break_even),
        tables.energy_per_minute(judgement.per_minute),
        *([tables.omissions(judgement.omissions)] if judgement.omissions else []),
    ]
    if by.results is not None:
        out += [
            tables.readings(reading_rows(by.results, by.published)),
            tables.leave_one_out(judgement.predictions),
            tables.calibration(calibrated_numbers(by.results, by.prior)),
            tables.sensitivities(sensitivity_rows(by.results)),
        ]
    return Judged(judgement, by), out
