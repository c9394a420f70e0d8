"""Each target as everything else predicts it: what a fitted number is worth as a test."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from actuators.units import from_si
from pipeline.paper.calibration.problem import EVEN, EXTRA, extra_target
from pipeline.paper.constants.data_sheet import data_sheet
from pipeline.paper.constants.table_entries import joint_torques
from pipeline.paper.judgement.evidence import LEAST, NONE, Evidence, Interval, quantiles
from pipeline.paper.published import Published

_OTHERS = "the other targets and the prior"
_DATA_SHEET = "the motor's data sheet"
#: What each exactly met target fixes; nothing else knows these numbers of the robot.
_FIXES = {
    "standing_reaction_rm": "trunk_com_left",
    "standing_torque_2": "joint_2_lateral",
    "standing_torque_3": "body_height",
    "rotor_current_2": "rotor_re40.coulomb",
}


@dataclass(frozen=True)
class Prediction:
    """A target as the rest predicts it, in its unit.

    Attributes:
        name: Its id.
        without: Targets left out together, joined with ``+``.
        unit: Of the numbers.
        published: Printed, or implied by the printed break-even.
        half_width: Of it.
        median: Predicted; NaN where nothing or too few sets predict it.
        interval: 95 % of the prediction.
        sets: How many sets met the others and have such a value; 0 for a data sheet.
        by: What predicts it.
    """

    name: str
    without: str
    unit: str
    published: float
    half_width: float
    median: float
    interval: Interval
    sets: int
    by: str

    @property
    def inside(self) -> bool | None:
        """Whether prediction and printed value overlap; None where nothing predicts it."""
        if math.isnan(self.median):
            return None
        low, high = self.interval
        return low <= self.published + self.half_width and high >= self.published - self.half_width


def leave_one_out(published: Mapping[str, Published], known: Evidence) -> list[Prediction]:
    """Every target, left out.

    Args:
        published: The printed values.
        known: The calibration's sets.
    """
    rows = [
        Prediction(
            *(name, name, published[name].unit, published[name].value, published[name].half_width),
            *(math.nan, NONE, 0, f"nothing: it fixes {fixes}"),
        )
        for name, fixes in _FIXES.items()
    ]
    rows += [_by_data_sheet(published, name) for name in ("ideal_current_2", "ideal_voltage_2")]
    for key, points in known.left_out.items():
        for target in key.split("+"):
            rows.append(_by_sets(published, target, key, [p.values[target] for p in points]))
            if target == EXTRA:
                rows.append(_by_sets(published, EVEN, key, [p.values[EVEN] for p in points]))
    return rows


def _by_sets(
    published: Mapping[str, Published], name: str, without: str, values: list[float]
) -> Prediction:
    if name == EXTRA:
        target = extra_target(published, 1)
        unit, centre, half = "J", target.centre, target.half_width
    else:
        row = published[name]
        unit, centre, half = row.unit, row.value, row.half_width
        values = [from_si(v, unit) for v in values]
    known = [v for v in values if not math.isnan(v)]
    median = float(np.median(known)) if len(known) >= LEAST else math.nan
    return Prediction(
        *(name, without, unit, centre, half, median, quantiles(known), len(known), _OTHERS)
    )


def _by_data_sheet(published: Mapping[str, Published], name: str) -> Prediction:
    """Current from the data sheet's k, voltage from its R and the printed current."""
    row, sheet = published[name], data_sheet()
    torque = joint_torques(published)["2"]
    current = published["ideal_current_2"]
    sign = math.copysign(1.0, row.value)
    if name == "ideal_current_2":
        least, most = sheet.parameter("torque_constant").interval or NONE
        edges = [torque / most, torque / sheet["torque_constant"], torque / least]
    else:
        least, most = sheet.parameter("resistance").interval or NONE
        printed = abs(current.value)
        edges = [
            least * (printed - current.half_width),
            sheet["resistance"] * printed,
            most * (printed + current.half_width),
        ]
    low, middle, high = sorted(sign * edge for edge in edges)
    return Prediction(
        *(name, name, row.unit, row.value, row.half_width, middle, (low, high), 0, _DATA_SHEET)
    )
