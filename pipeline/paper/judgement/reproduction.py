"""Every printed value beside ours, with its part in the calibration and what is known of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from actuators.units import from_si
from pipeline.paper.calibration.problem import EVEN, EXTRA, fixed_before
from pipeline.paper.constants.rotor_friction import HELD, asked_frictions, asked_widths
from pipeline.paper.judgement.evidence import NONE, Evidence, Interval, quantiles
from pipeline.paper.published import ROLES, Published

REPRODUCED = "reproduced"
MISSED = "not reproduced"
CONTRADICTED = "contradicted"
#: Targets that the others predict when they are left out, and under which name the sets stand.
PREDICTED_BY = {
    HELD: HELD,
    "walking_ratio_rotor": "walking_ratio_rotor",
    "walking_ratio_reversible": "walking_ratio_reversible",
    "walking_ratio_irreversible": f"walking_ratio_irreversible+{EXTRA}",
    EVEN: f"walking_ratio_irreversible+{EXTRA}",
}


@dataclass(frozen=True)
class ReproducedRow:
    """One printed value beside ours, in the printed unit.

    Attributes:
        published: The printed value.
        computed: Ours.
        verdict: `REPRODUCED` within the half width, else `MISSED`, or `CONTRADICTED` where other
            printed values leave no way to meet it.
        met: Share of the posterior that meets the row at printed precision; NaN without it.
        prior: 95 % of what data sheets and literature say; NaN where other rows fix the quantity.
        left_out: 95 % of what the other targets predict; NaN where it is no target.
        remark: In words, may be empty.
    """

    published: Published
    computed: float
    verdict: str
    met: float
    prior: Interval
    left_out: Interval
    remark: str

    @property
    def error(self) -> float:
        """Computed less published."""
        return self.computed - self.published.value


def reproduction(
    published: Mapping[str, Published],
    ours: Mapping[str, float],
    unmet: Sequence[str],
    known: Evidence | None,
) -> tuple[ReproducedRow, ...]:
    """A row for every printed value that was computed.

    Args:
        published: All of them.
        ours: Computed, SI; without those for which the catalogue has no actuator.
        unmet: Ids that stay unmet at the rotor friction that leaves the fewest.
        known: The calibration's sets; None where they belong to other numbers.
    """
    fixed = fixed_before(published) | {f"{a}_leg_energy_3s" for a in ("ideal", "rotor")}
    rows = []
    for name, row in published.items():
        if name not in ours:
            continue
        value = from_si(ours[name], row.unit)
        verdict = REPRODUCED
        if not row.reproduced(value):
            verdict = CONTRADICTED if name in unmet else MISSED
        met, prior, left_out = math.nan, NONE, NONE
        if known is not None:
            own = [from_si(p.values[name], row.unit) for p in known.posterior]
            met = float(np.mean([row.reproduced(v) for v in own]))
            if name not in fixed:
                prior = quantiles([from_si(p.values[name], row.unit) for p in known.prior])
            if name in PREDICTED_BY:
                sets = known.left_out[PREDICTED_BY[name]]
                left_out = quantiles([from_si(p.values[name], row.unit) for p in sets])
        remark = _remark(row, published, known)
        rows.append(ReproducedRow(row, value, verdict, met, prior, left_out, remark))
    return tuple(rows)


def _remark(row: Published, published: Mapping[str, Published], known: Evidence | None) -> str:
    asked, widths = asked_frictions(published), asked_widths(published)
    if row.id in asked:
        return "asks for a rotor friction of " + ", ".join(
            f"{from_si(asked[k], 'mN*m'):.4g} +- {from_si(widths[k], 'mN*m'):.2g} mN*m"
            + ("" if k == row.id else f" is asked by {k}")
            for k in sorted(asked, key=lambda k: k != row.id)
        )
    if row.id == "rotor_leg_energy_3s":
        power = published["rotor_power_2"]
        text = f"3 s times the rounded {power.value:g} W"
        if known is not None:
            sets = [from_si(p.values[row.id], row.unit) for p in known.posterior]
            text += f"; unrounded {min(sets):.4g} to {max(sets):.4g} J"
        return text
    if row.id == EVEN and known is not None:
        none = float(np.mean([math.isnan(p.values[EVEN]) for p in known.prior]))
        return (
            f"prior: of the draws that have one; {100 * none:.0f} % have none, see conclusions.csv"
        )
    return ""


def headline(rows: Sequence[ReproducedRow]) -> dict[str, tuple[int, int]]:
    """Per role: how many rows are reproduced, and how many there are."""
    out = {}
    for role in ROLES:
        own = [row for row in rows if row.published.role == role]
        out[role] = (sum(row.verdict == REPRODUCED for row in own), len(own))
    return out
