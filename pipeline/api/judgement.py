"""Tables of what was held against the paper."""

from __future__ import annotations

from pipeline.paper.calibration.store import Calibrated, calibrated_numbers
from pipeline.paper.judgement.basis import Basis
from pipeline.paper.judgement.evidence import Sensitivity, sensitivities
from pipeline.paper.judgement.judge import Judgement, Prediction, judge
from pipeline.paper.judgement.readings import ReadingRow, reading_rows
from pipeline.paper.omissions import Omission
from pipeline.simulation.settings import Settings
from reports.table import Table, table_of
from reports.tables import judgement as tables


def judged(given: Settings, by: Basis) -> tuple[Judgement, list[Table]]:
    """Everything held against the paper."""
    judgement = judge(given.robot, by, samples=given.samples)
    out = [
        table_of(tables.ReproductionRow, judgement.reproduction),
        table_of(tables.ConclusionRow, judgement.conclusions),
        table_of(tables.RotorFrictionRow, judgement.ranges),
        table_of(tables.BreakEvenRow, judgement.break_even),
        tables.energy_per_minute(judgement.per_minute),
        *([table_of(Omission, judgement.omissions)] if judgement.omissions else []),
    ]
    if by.results is not None:
        out += [
            table_of(ReadingRow, reading_rows(by.results, by.published)),
            table_of(Prediction, judgement.predictions),
            table_of(Calibrated, calibrated_numbers(by.results, by.prior)),
            table_of(Sensitivity, sensitivities(by.results)),
        ]
    return judgement, out
