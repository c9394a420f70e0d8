"""Tables that hold the model against the paper: reproduction, conclusions, Fig. 21.

Rows are the results of `pipeline.paper`; each column says where in a result its value stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pipeline.column import column
from pipeline.paper.judgement.evidence import EnergyPerMinute
from pipeline.paper.published import ROLES
from reports.table import Table, table_of

#: What the columns of intervals mean; empty where the run's numbers are not the calibration's.
PRIOR_LOW = "2.5 % quantile of what data sheets and literature say, before anything is fitted"
PRIOR_HIGH = "97.5 % quantile of the same"
LEFT_LOW = "2.5 % quantile of what everything else says, this figure left out of the fit"
LEFT_HIGH = "97.5 % quantile of the same"
_ROLE = "; ".join(f"{role}: {meaning}" for role, meaning in ROLES.items())


@dataclass(frozen=True)
class ReproductionRow:
    """Every printed value beside ours."""

    table: ClassVar = "reproduction"
    id: str = column("short name")
    where: str = column("table or section of the paper")
    quantity: str = column("what is printed")
    joint: str = column("joint of the middle right leg, or empty")
    unit: str = column("unit of the numbers in the row")
    published: float = column("as printed", "see unit")
    half_width: float = column("half of the last printed digit, or of the words' range", "see unit")
    computed: float = column("ours, with the calibrated files", "see unit")
    error: float = column(
        "computed less published", "see unit", of=lambda r: r.computed - r.published
    )
    role: str = column(_ROLE)
    verdict: str = column(
        "reproduced: the error is within the half width; contradicted: it is not, and other "
        "printed numbers leave no way to it"
    )
    met_share: float = column(
        "share of the posterior in which it comes out at printed precision",
        "1",
        of=lambda r: r.posterior_share,
    )
    prior_low: float = column(
        PRIOR_LOW + "; empty where it was put in or follows from that",
        "see unit",
        of=lambda r: r.prior[0],
    )
    prior_high: float = column(PRIOR_HIGH, "see unit", of=lambda r: r.prior[1])
    left_out_low: float = column(
        LEFT_LOW + "; empty where nothing was", "see unit", of=lambda r: r.left_out[0]
    )
    left_out_high: float = column(LEFT_HIGH, "see unit", of=lambda r: r.left_out[1])
    remark: str = column("in words")


@dataclass(frozen=True)
class ConclusionRow:
    """Sections V and IV.A, sentence by sentence."""

    table: ClassVar = "conclusions"
    where: str = column("section of the paper")
    sentence: str = column("what the paper says")
    joint: str = column("joint of the middle right leg, or empty")
    quantity: str = column("what is computed for it")
    unit: str = column("unit of the numbers")
    printed: str = column("the paper's number or word", of=lambda r: r.words)
    computed: float = column("ours", "see unit")
    holds: bool = column("whether the sentence holds for ours")
    part: str = column(
        "in the calibration; put in, or fitted: asked for, so that it holds says nothing; "
        "follows: from fitted and put-in numbers",
        of=lambda r: r.role,
    )
    prior_low: float = column(PRIOR_LOW, "see unit", of=lambda r: r.prior[0])
    prior_high: float = column(PRIOR_HIGH, "see unit", of=lambda r: r.prior[1])
    prior_holds_share: float = column(
        "share of these draws in which the sentence holds", "1", of=lambda r: r.prior_share
    )
    left_out_low: float = column(LEFT_LOW, "see unit", of=lambda r: r.left_out[0])
    left_out_high: float = column(LEFT_HIGH, "see unit", of=lambda r: r.left_out[1])
    left_out_holds_share: float = column(
        "share of these sets in which it holds", "1", of=lambda r: r.left_out_share
    )
    posterior_holds_share: float = column(
        "share of the posterior in which it holds, where that was not asked for",
        "1",
        of=lambda r: r.posterior_share,
    )


@dataclass(frozen=True)
class BreakEvenRow:
    """Where the irreversible actuator begins to pay."""

    table: ClassVar = "break_even"
    subject: str = column("the paper's pair of middle legs", of=lambda r: r.id)
    standing_fraction: float = column(
        "fraction of time standing; empty where there is none", "1", of=lambda r: r.computed
    )
    prior_low: float = column(
        PRIOR_LOW + "; of the draws that have one", "1", of=lambda r: r.prior[0]
    )
    prior_high: float = column(PRIOR_HIGH, "1", of=lambda r: r.prior[1])
    left_out_low: float = column(
        LEFT_LOW + ", nor the irreversible ratio; of those that have one",
        "1",
        of=lambda r: r.left_out[0],
    )
    left_out_high: float = column(LEFT_HIGH, "1", of=lambda r: r.left_out[1])
    note: str = column("in words", of=lambda r: r.remark)


@dataclass(frozen=True)
class MinuteRow:
    """Fig. 21 as numbers."""

    table: ClassVar = "energy_per_minute"
    subject: str = column("the paper's pair of middle legs")
    alternative: str = column("actuator alternative of section III")
    standing_fraction: float = column("fraction of the minute spent standing", "1")
    energy_J: float = column("electrical energy in one minute, fitted", "J")
    prior_low_J: float = column(PRIOR_LOW, "J")
    prior_high_J: float = column(PRIOR_HIGH, "J")
    left_out_low_J: float = column(
        "2.5 % quantile of the sets fitted without this actuator's walking figures; empty where it "
        "has none",
        "J",
    )
    left_out_high_J: float = column("97.5 % quantile of the same", "J")


def energy_per_minute(lines: Sequence[EnergyPerMinute]) -> Table:
    """The lines of Fig. 21, point by point."""
    rows = []
    for line in lines:
        nothing = np.full((2, line.fraction.size), np.nan)
        prior, left_out = (nothing if b is None else b for b in (line.prior, line.left_out))
        points = zip(line.fraction, line.energy, *prior, *left_out, strict=True)
        rows += [MinuteRow(line.subject, line.alternative, *point) for point in points]
    return table_of(MinuteRow, rows)
