"""Tables of what was held against the paper."""

from __future__ import annotations

from pipeline.paper.judgement.basis import Basis
from pipeline.paper.judgement.judge import Judgement, judge
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
        table_of(tables.BreakEvenRow, judgement.break_even),
        tables.energy_per_minute(judgement.per_minute),
        *([table_of(Omission, judgement.omissions)] if judgement.omissions else []),
    ]
    return judgement, out
