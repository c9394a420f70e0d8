"""Each target as everything else predicts it: what a fitted number is worth as a test."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from actuators.units import from_si
from pipeline.column import column
from pipeline.paper.calibration.problem import extra_target
from pipeline.paper.judgement.evidence import LEAST, NONE, Sets, quantiles
from pipeline.paper.motor_constants import data_sheet, joint_torques
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
    """Each target predicted from the rest."""

    table: ClassVar = "leave_one_out"
    id: str = column("target, or the energy difference that the break-even implies")
    without: str = column("left out of the calibration together, with what follows from them")
    unit: str = column("unit of the numbers")
    published: float = column("as printed; walking_extra_J: implied by the break-even", "see unit")
    half_width: float = column("of the published value", "see unit")
    predicted: float = column("median of the posterior without it", "see unit")
    low: float = column("2.5 % quantile of the same, or of the data sheet's rounding", "see unit")
    high: float = column("97.5 % quantile of the same", "see unit")
    inside: bool | None = column("whether prediction and published value overlap")
    sets: int = column("how many draws of that posterior have such a value", "1")
    by: str = column("what predicts it")


def leave_one_out(published: Mapping[str, Published], sets: Sets) -> list[Prediction]:
    """Every target, left out, as the calibration's sets without it have it."""

    def predicted(
        name: str, without: str, by: str, found: Sequence[float], sets: int
    ) -> Prediction:
        """A row; `found` is what is predicted, least and most, NaN where nothing predicts it."""
        if name == EXTRA:
            target = extra_target(published, 1)
            unit, value, half = "J", target.centre, target.half_width
        else:
            row = published[name]
            unit, value, half = row.unit, row.value, row.half_width
        median, low, high = found
        overlap = low <= value + half and high >= value - half
        inside = None if math.isnan(median) else overlap
        return Prediction(name, without, unit, value, half, median, low, high, inside, sets, by)

    rows = [
        predicted(name, name, f"nothing: it fixes {of}", [math.nan] * 3, 0)
        for name, of in _FIXES.items()
    ]
    for name, edges in _from_data_sheet(published).items():
        low, middle, high = sorted(math.copysign(e, published[name].value) for e in edges)
        rows.append(predicted(name, name, "the motor's data sheet", (middle, low, high), 0))
    for without, frame in sets.items():
        targets = without.split("+") if without not in ("posterior", "prior") else []
        for name in [*targets, EVEN] if EXTRA in targets else targets:
            unit = "J" if name == EXTRA else published[name].unit
            values = [from_si(value, unit) for value in frame[name].dropna()]
            median = float(np.median(values)) if len(values) >= LEAST else math.nan
            found = (median, *quantiles(values))
            by = "the other targets and the prior"
            rows.append(predicted(name, without, by, found, len(values)))
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
