"""Tables that hold the model against the paper: reproduction, readings, conclusions, Fig. 21.

Rows are the results of `pipeline.paper`; each column says where in a result its value stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from actuators.units import from_si
from pipeline.paper.calibration.store import VERDICTS
from pipeline.paper.judgement.fig_21 import EnergyPerMinute
from pipeline.paper.omissions.omissions import Omission
from pipeline.paper.published import ROLES
from reports.column import column
from reports.table import Table, table_of

#: What the columns of intervals mean; empty where the run's numbers are not the calibration's.
PRIOR_LOW = "2.5 % quantile of what data sheets and literature say, before anything is fitted"
PRIOR_HIGH = "97.5 % quantile of the same"
LEFT_LOW = "2.5 % quantile of what everything else says, this figure left out of the fit"
LEFT_HIGH = "97.5 % quantile of the same"
_ROLE = "; ".join(f"{role}: {meaning}" for role, meaning in ROLES.items())
_MORE = "by how much it is more than in the first row"


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
    half_width: float = column(
        "half of the last printed digit, or of the words' range",
        "see unit",
    )
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
class RotorFrictionRow:
    """How many entries of Tables IV to VI each rotor friction leaves unmet."""

    table: ClassVar = "rotor_friction"
    about: ClassVar = (
        "Frictions tried in steps of 0.0025 mN*m; the calibration draws from the range that "
        "leaves the fewest unmet."
    )
    from_mNm: float = column(
        "least Coulomb friction of the rotor tried", "mN*m", of=lambda r: from_si(r.low, "mN*m")
    )
    to_mNm: float = column("greatest", "mN*m", of=lambda r: from_si(r.high, "mN*m"))
    unmet: float = column(
        "entries of Tables IV to VI unmet at printed precision, at the torque constant and "
        "resistance that meet the most",
        "1",
        of=lambda r: len(r.unmet),
    )
    which: str = column("their ids in reproduction.csv", of=lambda r: " ".join(r.unmet))


@dataclass(frozen=True)
class ReadingRow:
    """The open readings of the paper, each calibrated on its own."""

    table: ClassVar = "readings"
    about: ClassVar = (
        "limit rows: peak over the data sheet's limit, less one; positive is a breach."
    )
    axis_deg: float = column(
        "angle of joint 1's axis from the vertical, in the frontal plane", "deg"
    )
    standing_legs_counted: float = column("middle legs that Fig. 21 counts as loaded", "1")
    consumption: str = column(
        "drawn: what the supply delivers, E_el(+); net: less what flows back, E_el(+) - E_el(-)"
    )
    numbers: str = column("with which numbers: fitted to this reading, or those of this run")
    id: str = column("printed value, limit:<alternative>.<quantity>, or discriminator")
    unit: str = column("unit of computed")
    computed: float = column("with these numbers", "see unit")
    verdict: str = column("for printed values and limits")


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
class OmissionRow:
    """What the paper leaves out, and how far its answer moves with it."""

    table: ClassVar = "omissions"
    about: ClassVar = (
        "Each row changes one thing against the numbers of the run; nothing here is fitted."
    )
    left_out: str = column("what the paper leaves out", of=lambda r: r.name or "nothing")
    assumption: str = column("how it is put in")
    value: float = column(
        "with which number; empty where there is none",
        "see unit",
        of=lambda r: r.number and r.number.value_as_written,
    )
    unit: str = column("unit of value", of=lambda r: r.number.unit if r.number else "")
    basis: str = column(
        "of value, as in parameters.csv", of=lambda r: r.number.basis if r.number else ""
    )
    source: str = column("of value", of=lambda r: r.number.source if r.number else "")
    break_even: float = column(
        "fraction of time standing above which the irreversible actuator uses less, both "
        "middle legs; empty where there is none",
        "1",
    )
    break_even_change: float = column(_MORE, "1", of=lambda r: r.moved)
    note: str = column("in words")


@dataclass(frozen=True)
class LeaveOneOutRow:
    """Each target predicted from the rest."""

    table: ClassVar = "leave_one_out"
    id: str = column(
        "target, or the energy difference that the break-even implies", of=lambda r: r.name
    )
    without: str = column("left out of the calibration together, with what follows from them")
    unit: str = column("unit of the numbers")
    published: float = column("as printed; walking_extra_J: implied by the break-even", "see unit")
    half_width: float = column("of the published value", "see unit")
    predicted: float = column(
        "median of the posterior without it", "see unit", of=lambda r: r.median
    )
    low: float = column(
        "2.5 % quantile of the same, or of the data sheet's rounding",
        "see unit",
        of=lambda r: r.interval[0],
    )
    high: float = column("97.5 % quantile of the same", "see unit", of=lambda r: r.interval[1])
    inside: bool = column("whether prediction and published value overlap")
    sets: float = column("how many draws of that posterior have such a value", "1")
    by: str = column("what predicts it")


@dataclass(frozen=True)
class CalibrationRow:
    """Every free number before and after."""

    table: ClassVar = "calibration"
    parameter: str = column("robot or component, and name in its file", of=lambda r: r.key)
    unit: str = column("unit of the numbers")
    prior: float = column(
        "centre of prior knowledge; empty where there was none",
        "see unit",
        of=lambda r: None if r.prior is None else from_si(r.prior, r.unit),
    )
    prior_low: float = column(
        "lower end of the 95 % belief",
        "see unit",
        of=lambda r: r.prior_interval and from_si(r.prior_interval[0], r.unit),
    )
    prior_high: float = column(
        "upper end of the 95 % belief",
        "see unit",
        of=lambda r: r.prior_interval and from_si(r.prior_interval[1], r.unit),
    )
    calibrated: float = column(
        "at the set nearest to the prior", "see unit", of=lambda r: from_si(r.value, r.unit)
    )
    low: float = column(
        "2.5 % quantile of the posterior, or the calibrated number where that is less",
        "see unit",
        of=lambda r: from_si(r.low, r.unit),
    )
    high: float = column(
        "97.5 % quantile of the posterior, or the calibrated number where that is greater",
        "see unit",
        of=lambda r: from_si(r.high, r.unit),
    )
    shift_over_prior: float = column(
        "mean of the posterior less the prior's centre, in prior standard deviations",
        "1",
        of=lambda r: r.shift,
    )
    spread_over_prior: float = column(
        "standard deviation of the posterior, in prior standard deviations",
        "1",
        of=lambda r: r.spread,
    )
    at_lower_share: float = column(
        "share of the posterior at the number's lower bound", "1", of=lambda r: r.at_lower
    )
    at_upper_share: float = column(
        "share of the posterior at the number's upper bound", "1", of=lambda r: r.at_upper
    )
    verdict: str = column("; ".join(f"{v}: {meaning}" for v, meaning in VERDICTS.items()))
    r_hat: float = column("nested R-hat of groups of walkers; 1 where they agree", "1")
    effective_sample_size: float = column(
        "independent draws that say as much", "1", of=lambda r: r.effective
    )


@dataclass(frozen=True)
class SensitivityRow:
    """Which unpublished number moves which conclusion."""

    table: ClassVar = "sensitivities"
    about: ClassVar = (
        "Every number uniform within one prior standard deviation of the calibrated point."
    )
    output: str = column("walking ratio, energy difference or break-even")
    parameter: str = column("robot or component, and name in its file")
    first_order: float = column("Sobol index of the number alone", "1")
    first_order_95: float = column("half width of its 95 % interval", "1")
    total: float = column("Sobol index with all interactions", "1")
    total_95: float = column("half width of its 95 % interval", "1")


@dataclass(frozen=True)
class BreakEvenRow:
    """Where the irreversible actuator begins to pay."""

    table: ClassVar = "break_even"
    subject: str = column(
        "the paper's pair of middle legs, or the robot on three or six feet", of=lambda r: r.id
    )
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
    subject: str = column("the paper's pair of middle legs, or the robot on three or six feet")
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


def omissions(rows: Sequence[Omission]) -> Table:
    """What the paper leaves out, with the ratios of all alternatives that the run has."""
    table = table_of(OmissionRow, rows)
    columns, meanings = dict(table.columns), dict(table.meanings)
    note, said = columns.pop("note"), meanings.pop("note")
    for name in rows[0].ratios:
        header = f"ratio_{name}"
        columns[header] = [row.ratios[name] for row in rows]
        meaning = f"walking energy of the middle right leg, {name} over ideal actuator"
        meanings[header] = (meaning, "1")
    for name in rows[0].ratios:
        columns[f"ratio_{name}_change"] = [row.ratios_moved[name] for row in rows]
        meanings[f"ratio_{name}_change"] = (_MORE, "1")
    return Table(table.name, columns | {"note": note}, meanings | {"note": said}, table.description)


def energy_per_minute(lines: Sequence[EnergyPerMinute]) -> Table:
    """The lines of Fig. 21, point by point."""
    rows = []
    for line in lines:
        nothing = np.full((2, line.fraction.size), np.nan)
        prior, left_out = (nothing if b is None else b for b in (line.prior, line.left_out))
        points = zip(line.fraction, line.energy, *prior, *left_out, strict=True)
        rows += [MinuteRow(line.subject, line.alternative, *point) for point in points]
    return table_of(MinuteRow, rows)
