"""Tables of what was held against the paper."""

from __future__ import annotations

from pipeline.paper.calibration.store import calibrated_numbers
from pipeline.paper.judgement.basis import Basis, Judged
from pipeline.paper.judgement.judge import judge
from pipeline.paper.judgement.readings import reading_rows
from pipeline.paper.judgement.sensitivity import sensitivity_rows
from pipeline.simulation.settings import Settings
from reports.table import Table, table_of
from reports.tables import judgement as tables


def judged(given: Settings, by: Basis) -> tuple[Judged, list[Table]]:
    """Everything held against the paper."""
    judgement = judge(
        given.robot, by.catalog, by.published, by.prior, by.results, samples=given.samples
    )
    out = [
        table_of(tables.ReproductionRow, judgement.reproduction),
        table_of(tables.ConclusionRow, judgement.conclusions),
        table_of(tables.RotorFrictionRow, judgement.ranges),
        table_of(tables.BreakEvenRow, judgement.break_even),
        tables.energy_per_minute(judgement.per_minute),
        *([tables.omissions(judgement.omissions)] if judgement.omissions else []),
    ]
    if by.results is not None:
        readings = [tables.ReadingRow(**r) for r in reading_rows(by.results, by.published)]
        indices = [tables.SensitivityRow(**r) for r in sensitivity_rows(by.results)]
        out += [
            table_of(tables.ReadingRow, readings),
            table_of(tables.LeaveOneOutRow, judgement.predictions),
            table_of(tables.CalibrationRow, calibrated_numbers(by.results, by.prior)),
            table_of(tables.SensitivityRow, indices),
        ]
    return Judged(judgement, by), out
