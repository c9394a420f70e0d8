"""Tables that hold the model against the paper: reproduction, readings, conclusions, Fig. 21."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from actuators.units import from_si
from pipeline.calibration.judge import (
    BreakEven,
    Conclusion,
    EnergyPerMinute,
    Prediction,
    ReproducedRow,
)
from pipeline.calibration.store import Calibrated
from reports.table import Table, table_from_rows

LOW = "2.5 % quantile over the ensemble"
HIGH = "97.5 % quantile over the ensemble"


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
                "low": row.low,
                "high": row.high,
                "error": row.error,
                "role": row.published.role,
                "verdict": row.verdict,
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
            "low": (LOW, "see unit"),
            "high": (HIGH, "see unit"),
            "error": ("computed less published", "see unit"),
            "role": ("input: put in; target: fitted to; check: predicted", ""),
            "verdict": ("reproduced: the error is within the half width", ""),
        },
    )


def readings(rows: Sequence[Mapping[str, Any]]) -> Table:
    """Both open readings of the paper, each calibrated on its own."""
    return table_from_rows(
        "readings",
        rows,
        {
            "axis_deg": ("angle of joint 1's axis from the vertical, in the frontal plane", "deg"),
            "standing_legs_counted": ("middle legs that Fig. 21 counts as loaded", "1"),
            "id": ("printed value, limit:<alternative>.<quantity>, or discriminator", ""),
            "unit": ("unit of computed", ""),
            "computed": ("at this reading's own calibration", "see unit"),
            "verdict": ("for printed values and limits", ""),
        },
        "limit rows: peak over the data sheet's limit, less one; positive is a breach.",
    )


def conclusions(rows: Sequence[Conclusion]) -> Table:
    """Section V, sentence by sentence."""
    return table_from_rows(
        "conclusions",
        [
            {
                "sentence": row.sentence,
                "quantity": row.quantity,
                "unit": row.unit,
                "printed": row.printed,
                "computed": _known(row.computed),
                "low": _known(row.low),
                "high": _known(row.high),
                "prior_low": _known(row.prior_low),
                "prior_high": _known(row.prior_high),
                "holds_share": row.holds_share,
                "prior_holds_share": row.prior_holds_share,
            }
            for row in rows
        ],
        {
            "sentence": ("what section V says", ""),
            "quantity": ("what is computed for it", ""),
            "unit": ("unit of the numbers", ""),
            "printed": ("the paper's number or word", ""),
            "computed": ("ours", "see unit"),
            "low": (LOW, "see unit"),
            "high": (HIGH, "see unit"),
            "prior_low": ("2.5 % quantile with data sheets and literature alone", "see unit"),
            "prior_high": ("97.5 % quantile with data sheets and literature alone", "see unit"),
            "holds_share": ("share of the ensemble in which the sentence holds", "1"),
            "prior_holds_share": ("share of the prior's draws in which it holds", "1"),
        },
    )


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value


def leave_one_out(rows: Sequence[Prediction]) -> Table:
    """Each target predicted from the others."""
    return table_from_rows(
        "leave_one_out",
        [
            {
                "id": row.name,
                "unit": row.unit,
                "published": row.published,
                "half_width": row.half_width,
                "predicted": _known(row.median),
                "low": _known(row.low),
                "high": _known(row.high),
                "inside": bool(row.low <= row.published <= row.high),
                "sets": row.sets,
            }
            for row in rows
        ],
        {
            "id": ("target left out of the calibration", ""),
            "unit": ("unit of the numbers", ""),
            "published": ("as printed; walking_extra_J: implied by the break-even", "see unit"),
            "half_width": ("of the published value", "see unit"),
            "predicted": ("median over sets that meet all other targets", "see unit"),
            "low": ("2.5 % quantile of these sets", "see unit"),
            "high": ("97.5 % quantile of these sets", "see unit"),
            "inside": ("whether the published value lies between low and high", ""),
            "sets": ("how many sets met the others", "1"),
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
                "prior": from_si(row.prior, row.unit),
                "prior_low": from_si(row.prior_interval[0], row.unit),
                "prior_high": from_si(row.prior_interval[1], row.unit),
                "calibrated": from_si(row.value, row.unit),
                "low": from_si(row.low, row.unit),
                "high": from_si(row.high, row.unit),
                "spread_over_prior": row.spread,
                "verdict": row.verdict,
                "at_bound": row.at_bound or None,
            }
            for row in rows
        ],
        {
            "parameter": ("robot or component, and name in its file", ""),
            "unit": ("unit of the numbers", ""),
            "prior": ("centre of prior knowledge", "see unit"),
            "prior_low": ("lower end of the 95 % belief", "see unit"),
            "prior_high": ("upper end of the 95 % belief", "see unit"),
            "calibrated": ("at the admissible point nearest to the prior", "see unit"),
            "low": (LOW, "see unit"),
            "high": (HIGH, "see unit"),
            "spread_over_prior": ("standard deviation over the ensemble, in prior sigmas", "1"),
            "verdict": ("determined, narrowed, or not determined by the targets", ""),
            "at_bound": ("lower or upper, where the calibrated value lies at its bound", ""),
        },
    )


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
                "low": _known(row.low),
                "high": _known(row.high),
                "note": row.note,
            }
            for row in rows
        ],
        {
            "subject": ("the paper's pair of middle legs, or the robot on three or six feet", ""),
            "standing_fraction": ("fraction of time standing; empty where there is none", "1"),
            "low": (LOW, "1"),
            "high": (HIGH, "1"),
            "note": ("in words", ""),
        },
    )


def energy_per_minute(rows: Sequence[EnergyPerMinute]) -> Table:
    """Fig. 21 as numbers."""
    count = [row.fraction.size for row in rows]
    return Table(
        "energy_per_minute",
        {
            "subject": np.repeat([row.subject for row in rows], count).tolist(),
            "alternative": np.repeat([row.alternative for row in rows], count).tolist(),
            "standing_fraction": np.concatenate([row.fraction for row in rows]),
            "energy_J": np.concatenate([row.energy for row in rows]),
            "low_J": np.concatenate([row.low for row in rows]),
            "high_J": np.concatenate([row.high for row in rows]),
        },
        {
            "subject": ("the paper's pair of middle legs, or the robot on three or six feet", ""),
            "alternative": ("actuator alternative of section III", ""),
            "standing_fraction": ("fraction of the minute spent standing", "1"),
            "energy_J": ("electrical energy in one minute", "J"),
            "low_J": (LOW, "J"),
            "high_J": (HIGH, "J"),
        },
    )
