"""Each target as everything else predicts it: what a fitted number is worth as a test."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from actuators.units import from_si
from pipeline.paper.calibration.problem import extra_target
from pipeline.paper.constants.data_sheet import data_sheet
from pipeline.paper.constants.table_entries import joint_torques
from pipeline.paper.judgement.evidence import LEAST, NONE, Evidence, Interval, quantiles
from pipeline.paper.published import EVEN, EXTRA, Published

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
        by: What predicts it.
        median: Predicted; NaN where nothing or too few sets predict it.
        interval: 95 % of the prediction.
        sets: How many sets met the others and have such a value; 0 for a data sheet.
    """

    name: str
    without: str
    unit: str
    published: float
    half_width: float
    by: str
    median: float = math.nan
    interval: Interval = NONE
    sets: int = 0

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

    def head(name: str, without: str) -> tuple[str, str, str, float, float]:
        if name == EXTRA:
            target = extra_target(published, 1)
            return name, without, "J", target.centre, target.half_width
        row = published[name]
        return name, without, row.unit, row.value, row.half_width

    rows = [Prediction(*head(name, name), f"nothing: it fixes {of}") for name, of in _FIXES.items()]
    for name, edges in _from_data_sheet(published).items():
        low, middle, high = sorted(math.copysign(e, published[name].value) for e in edges)
        rows.append(Prediction(*head(name, name), "the motor's data sheet", middle, (low, high)))
    for without, points in known.left_out.items():
        targets = without.split("+")
        for name in [*targets, EVEN] if EXTRA in targets else targets:
            own = Prediction(*head(name, without), "the other targets and the prior")
            values = [from_si(p.values[name], own.unit) for p in points]
            values = [v for v in values if not math.isnan(v)]
            median = float(np.median(values)) if len(values) >= LEAST else math.nan
            interval = quantiles(values)
            rows.append(replace(own, median=median, interval=interval, sets=len(values)))
    return rows


def _from_data_sheet(published: Mapping[str, Published]) -> dict[str, Sequence[float]]:
    """Magnitudes of current from the data sheet's k, of voltage from its R and printed current."""
    sheet, current = data_sheet(), published["ideal_current_2"]
    torque, _ = joint_torques(published)
    constants = [sheet["torque_constant"], *(sheet.parameter("torque_constant").interval or NONE)]
    least, most = sheet.parameter("resistance").interval or NONE
    printed = abs(current.value)
    return {
        "ideal_current_2": [torque / constant for constant in constants],
        "ideal_voltage_2": [
            least * (printed - current.half_width),
            sheet["resistance"] * printed,
            most * (printed + current.half_width),
        ],
    }
