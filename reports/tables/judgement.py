"""Tables that hold the model against the paper: reproduction, readings, conclusions, Fig. 21."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuators.units import from_si
from pipeline.paper.calibration.store import VERDICTS, Calibrated
from pipeline.paper.constants.rotor_friction import Frictions
from pipeline.paper.judgement.conclusions import Conclusion
from pipeline.paper.judgement.fig_21 import BreakEven, EnergyPerMinute
from pipeline.paper.judgement.leave_one_out import Prediction
from pipeline.paper.judgement.reproduction import ReproducedRow
from pipeline.paper.omissions.omissions import Omission
from pipeline.paper.published import ROLES
from reports.table import Table, table_from_rows

Array = NDArray[np.float64]
#: What the columns of intervals mean; empty where the run's numbers are not the calibration's.
PRIOR_LOW = "2.5 % quantile of what data sheets and literature say, before anything is fitted"
PRIOR_HIGH = "97.5 % quantile of the same"
LEFT_LOW = "2.5 % quantile of what everything else says, this figure left out of the fit"
LEFT_HIGH = "97.5 % quantile of the same"
_ROLE = "; ".join(f"{role}: {meaning}" for role, meaning in ROLES.items())


def reproduction(rows: Sequence[ReproducedRow]) -> Table:
    """Every printed value beside ours."""
    return table_from_rows(
        "reproduction",
        [
            {
                "id": row.published.id,
                "where": row.published.where,
                "quantity": row.published.quantity,
                "joint": row.published.joint,
                "unit": row.published.unit,
                "published": row.published.value,
                "half_width": row.published.half_width,
                "computed": row.computed,
                "error": row.error,
                "role": row.published.role,
                "verdict": row.verdict,
                "met_share": _known(row.met),
                "prior_low": _known(row.prior[0]),
                "prior_high": _known(row.prior[1]),
                "left_out_low": _known(row.left_out[0]),
                "left_out_high": _known(row.left_out[1]),
                "remark": row.remark,
            }
            for row in rows
        ],
        {
            "id": ("short name", ""),
            "where": ("table or section of the paper", ""),
            "quantity": ("what is printed", ""),
            "joint": ("joint of the middle right leg, or empty", ""),
            "unit": ("unit of the numbers in the row", ""),
            "published": ("as printed", "see unit"),
            "half_width": (
                "half of the last printed digit, or of the words' range",
                "see unit",
            ),
            "computed": ("ours, with the calibrated files", "see unit"),
            "error": ("computed less published", "see unit"),
            "role": (_ROLE, ""),
            "verdict": (
                "reproduced: the error is within the half width; contradicted: it is not, and "
                "other printed numbers leave no way to it",
                "",
            ),
            "met_share": ("share of the posterior in which it comes out at printed precision", "1"),
            "prior_low": (
                PRIOR_LOW + "; empty where it was put in or follows from that",
                "see unit",
            ),
            "prior_high": (PRIOR_HIGH, "see unit"),
            "left_out_low": (LEFT_LOW + "; empty where nothing was", "see unit"),
            "left_out_high": (LEFT_HIGH, "see unit"),
            "remark": ("in words", ""),
        },
    )


def rotor_friction(rows: Sequence[Frictions]) -> Table:
    """How many entries of Tables IV to VI each rotor friction leaves unmet."""
    return table_from_rows(
        "rotor_friction",
        [
            {
                "from_mNm": from_si(row.low, "mN*m"),
                "to_mNm": from_si(row.high, "mN*m"),
                "unmet": len(row.unmet),
                "which": " ".join(row.unmet),
            }
            for row in rows
        ],
        {
            "from_mNm": ("least Coulomb friction of the rotor tried", "mN*m"),
            "to_mNm": ("greatest", "mN*m"),
            "unmet": (
                "entries of Tables IV to VI unmet at printed precision, at the torque constant and "
                "resistance that meet the most",
                "1",
            ),
            "which": ("their ids in reproduction.csv", ""),
        },
        "Frictions tried in steps of 0.0025 mN*m; the calibration draws from the range that leaves "
        "the fewest unmet.",
    )


def readings(rows: Sequence[Mapping[str, Any]]) -> Table:
    """The open readings of the paper, each calibrated on its own."""
    return table_from_rows(
        "readings",
        rows,
        {
            "axis_deg": ("angle of joint 1's axis from the vertical, in the frontal plane", "deg"),
            "standing_legs_counted": ("middle legs that Fig. 21 counts as loaded", "1"),
            "consumption": (
                "drawn: what the supply delivers, E_el(+); net: less what flows back, "
                "E_el(+) - E_el(-)",
                "",
            ),
            "numbers": ("with which numbers: fitted to this reading, or those of this run", ""),
            "id": ("printed value, limit:<alternative>.<quantity>, or discriminator", ""),
            "unit": ("unit of computed", ""),
            "computed": ("with these numbers", "see unit"),
            "verdict": ("for printed values and limits", ""),
        },
        "limit rows: peak over the data sheet's limit, less one; positive is a breach.",
    )


def conclusions(rows: Sequence[Conclusion]) -> Table:
    """Sections V and IV.A, sentence by sentence."""
    return table_from_rows(
        "conclusions",
        [
            {
                "where": row.sentence.where,
                "sentence": row.sentence.text,
                "joint": row.sentence.joint,
                "quantity": row.sentence.quantity,
                "unit": row.sentence.unit,
                "printed": row.sentence.printed,
                "computed": _known(row.computed),
                "holds": row.holds,
                "part": row.sentence.part,
                "prior_low": _known(row.prior[0]),
                "prior_high": _known(row.prior[1]),
                "prior_holds_share": _known(row.prior_share),
                "left_out_low": _known(row.left_out[0]),
                "left_out_high": _known(row.left_out[1]),
                "left_out_holds_share": _known(row.left_out_share),
                "posterior_holds_share": _known(row.posterior_share),
            }
            for row in rows
        ],
        {
            "where": ("section of the paper", ""),
            "sentence": ("what the paper says", ""),
            "joint": ("joint of the middle right leg, or empty", ""),
            "quantity": ("what is computed for it", ""),
            "unit": ("unit of the numbers", ""),
            "printed": ("the paper's number or word", ""),
            "computed": ("ours", "see unit"),
            "holds": ("whether the sentence holds for ours", ""),
            "part": (
                "in the calibration; put in, or fitted: asked for, so that it holds says nothing; "
                "follows: from fitted and put-in numbers",
                "",
            ),
            "prior_low": (PRIOR_LOW, "see unit"),
            "prior_high": (PRIOR_HIGH, "see unit"),
            "prior_holds_share": ("share of these draws in which the sentence holds", "1"),
            "left_out_low": (LEFT_LOW, "see unit"),
            "left_out_high": (LEFT_HIGH, "see unit"),
            "left_out_holds_share": ("share of these sets in which it holds", "1"),
            "posterior_holds_share": (
                "share of the posterior in which it holds, where that was not asked for",
                "1",
            ),
        },
    )


def omissions(rows: Sequence[Omission]) -> Table:
    """What the paper leaves out, and how far its answer moves with it."""
    others = list(rows[0].ratios)
    return table_from_rows(
        "omissions",
        [
            {
                "left_out": row.name or "nothing",
                "assumption": row.assumption,
                "value": row.number and row.number.value_as_written,
                "unit": row.number.unit if row.number else "",
                "basis": row.number.basis if row.number else "",
                "source": row.number.source if row.number else "",
                "break_even": _known(row.break_even),
                "break_even_change": _known(row.moved),
                **{f"ratio_{name}": row.ratios[name] for name in others},
                **{f"ratio_{name}_change": row.ratios_moved[name] for name in others},
                "note": row.note,
            }
            for row in rows
        ],
        {
            "left_out": ("what the paper leaves out", ""),
            "assumption": ("how it is put in", ""),
            "value": ("with which number; empty where there is none", "see unit"),
            "unit": ("unit of value", ""),
            "basis": ("of value, as in parameters.csv", ""),
            "source": ("of value", ""),
            "break_even": (
                "fraction of time standing above which the irreversible actuator uses less, both "
                "middle legs; empty where there is none",
                "1",
            ),
            "break_even_change": ("by how much it is more than in the first row", "1"),
            **{
                f"ratio_{name}": (
                    f"walking energy of the middle right leg, {name} over ideal actuator",
                    "1",
                )
                for name in others
            },
            **{
                f"ratio_{name}_change": ("by how much it is more than in the first row", "1")
                for name in others
            },
            "note": ("in words", ""),
        },
        "Each row changes one thing against the numbers of the run; nothing here is fitted.",
    )


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value


def leave_one_out(rows: Sequence[Prediction]) -> Table:
    """Each target predicted from the rest."""
    return table_from_rows(
        "leave_one_out",
        [
            {
                "id": row.name,
                "without": row.without,
                "unit": row.unit,
                "published": row.published,
                "half_width": row.half_width,
                "predicted": _known(row.median),
                "low": _known(row.interval[0]),
                "high": _known(row.interval[1]),
                "inside": row.inside,
                "sets": row.sets,
                "by": row.by,
            }
            for row in rows
        ],
        {
            "id": ("target, or the energy difference that the break-even implies", ""),
            "without": ("left out of the calibration together, with what follows from them", ""),
            "unit": ("unit of the numbers", ""),
            "published": ("as printed; walking_extra_J: implied by the break-even", "see unit"),
            "half_width": ("of the published value", "see unit"),
            "predicted": ("median of the posterior without it", "see unit"),
            "low": ("2.5 % quantile of the same, or of the data sheet's rounding", "see unit"),
            "high": ("97.5 % quantile of the same", "see unit"),
            "inside": ("whether prediction and published value overlap", ""),
            "sets": ("how many draws of that posterior have such a value", "1"),
            "by": ("what predicts it", ""),
        },
    )


def calibration(rows: Sequence[Calibrated]) -> Table:
    """Every free number before and after."""
    return table_from_rows(
        "calibration",
        [
            {
                "parameter": row.key,
                "unit": row.unit,
                "prior": None if row.prior is None else from_si(row.prior, row.unit),
                "prior_low": _end(row, 0),
                "prior_high": _end(row, 1),
                "calibrated": from_si(row.value, row.unit),
                "low": from_si(row.low, row.unit),
                "high": from_si(row.high, row.unit),
                "shift_over_prior": row.shift,
                "spread_over_prior": row.spread,
                "at_lower_share": row.at_lower,
                "at_upper_share": row.at_upper,
                "verdict": row.verdict,
                "r_hat": row.r_hat,
                "effective_sample_size": row.effective,
            }
            for row in rows
        ],
        {
            "parameter": ("robot or component, and name in its file", ""),
            "unit": ("unit of the numbers", ""),
            "prior": ("centre of prior knowledge; empty where there was none", "see unit"),
            "prior_low": ("lower end of the 95 % belief", "see unit"),
            "prior_high": ("upper end of the 95 % belief", "see unit"),
            "calibrated": ("at the set nearest to the prior", "see unit"),
            "low": (
                "2.5 % quantile of the posterior, or the calibrated number where that is less",
                "see unit",
            ),
            "high": (
                "97.5 % quantile of the posterior, or the calibrated number where that is greater",
                "see unit",
            ),
            "shift_over_prior": (
                "mean of the posterior less the prior's centre, in prior standard deviations",
                "1",
            ),
            "spread_over_prior": (
                "standard deviation of the posterior, in prior standard deviations",
                "1",
            ),
            "at_lower_share": ("share of the posterior at the number's lower bound", "1"),
            "at_upper_share": ("share of the posterior at the number's upper bound", "1"),
            "verdict": ("; ".join(f"{v}: {meaning}" for v, meaning in VERDICTS.items()), ""),
            "r_hat": ("nested R-hat of groups of walkers; 1 where they agree", "1"),
            "effective_sample_size": ("independent draws that say as much", "1"),
        },
    )


def _end(row: Calibrated, end: int) -> float | None:
    return None if row.prior_interval is None else from_si(row.prior_interval[end], row.unit)


def sensitivities(rows: Sequence[Mapping[str, Any]]) -> Table:
    """Which unpublished number moves which conclusion."""
    return table_from_rows(
        "sensitivities",
        rows,
        {
            "output": ("walking ratio, energy difference or break-even", ""),
            "parameter": ("robot or component, and name in its file", ""),
            "first_order": ("Sobol index of the number alone", "1"),
            "first_order_95": ("half width of its 95 % interval", "1"),
            "total": ("Sobol index with all interactions", "1"),
            "total_95": ("half width of its 95 % interval", "1"),
        },
        "Every number uniform within one prior standard deviation of the calibrated point.",
    )


def break_even(rows: Sequence[BreakEven]) -> Table:
    """Where the irreversible actuator begins to pay."""
    return table_from_rows(
        "break_even",
        [
            {
                "subject": row.subject,
                "standing_fraction": _known(row.fraction),
                "prior_low": _known(row.prior[0]),
                "prior_high": _known(row.prior[1]),
                "left_out_low": _known(row.left_out[0]),
                "left_out_high": _known(row.left_out[1]),
                "note": row.note,
            }
            for row in rows
        ],
        {
            "subject": ("the paper's pair of middle legs, or the robot on three or six feet", ""),
            "standing_fraction": ("fraction of time standing; empty where there is none", "1"),
            "prior_low": (PRIOR_LOW + "; of the draws that have one", "1"),
            "prior_high": (PRIOR_HIGH, "1"),
            "left_out_low": (
                LEFT_LOW + ", nor the irreversible ratio; of those that have one",
                "1",
            ),
            "left_out_high": (LEFT_HIGH, "1"),
            "note": ("in words", ""),
        },
    )


def energy_per_minute(rows: Sequence[EnergyPerMinute]) -> Table:
    """Fig. 21 as numbers."""
    count = [row.fraction.size for row in rows]

    def ends(bands: Sequence[Array | None], end: int) -> Array:
        return np.concatenate(
            [
                np.full(n, np.nan) if band is None else band[end]
                for n, band in zip(count, bands, strict=True)
            ]
        )

    prior, left_out = [row.prior for row in rows], [row.left_out for row in rows]
    return Table(
        "energy_per_minute",
        {
            "subject": np.repeat([row.subject for row in rows], count).tolist(),
            "alternative": np.repeat([row.alternative for row in rows], count).tolist(),
            "standing_fraction": np.concatenate([row.fraction for row in rows]),
            "energy_J": np.concatenate([row.energy for row in rows]),
            "prior_low_J": ends(prior, 0),
            "prior_high_J": ends(prior, 1),
            "left_out_low_J": ends(left_out, 0),
            "left_out_high_J": ends(left_out, 1),
        },
        {
            "subject": ("the paper's pair of middle legs, or the robot on three or six feet", ""),
            "alternative": ("actuator alternative of section III", ""),
            "standing_fraction": ("fraction of the minute spent standing", "1"),
            "energy_J": ("electrical energy in one minute, fitted", "J"),
            "prior_low_J": (PRIOR_LOW, "J"),
            "prior_high_J": (PRIOR_HIGH, "J"),
            "left_out_low_J": (
                "2.5 % quantile of the sets fitted without this actuator's walking figures; empty "
                "where it has none",
                "J",
            ),
            "left_out_high_J": ("97.5 % quantile of the same", "J"),
        },
    )
