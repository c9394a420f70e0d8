"""What the paper says beside what is computed here: one table, of which the files are views.

A row is a printed number, a sentence about numbers, or a crossing of the lines of Fig. 21.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from actuators.units import from_si
from pipeline.paper.calibration.problem import fixed_before
from pipeline.paper.constants.motor_constants import asked_frictions
from pipeline.paper.judgement.evidence import NONE, Evidence, Interval, Point, quantiles
from pipeline.paper.published import EVEN, EXTRA, HELD, ROLES, Published

REPRODUCED = "reproduced"
MISSED = "not reproduced"
CONTRADICTED = "contradicted"
#: Part that a sentence plays in the calibration; printed numbers have one of `ROLES`.
PUT_IN, FITTED, FOLLOWS = "put in", "fitted", "follows"
#: Targets that the others predict when they are left out, and under which name the sets stand.
PREDICTED_BY = {
    HELD: HELD,
    "walking_ratio_rotor": "walking_ratio_rotor",
    "walking_ratio_reversible": "walking_ratio_reversible",
    "walking_ratio_irreversible": f"walking_ratio_irreversible+{EXTRA}",
    EVEN: f"walking_ratio_irreversible+{EXTRA}",
}


@dataclass(frozen=True)
class Row:
    """One statement of the paper and, once judged, what it comes to here.

    Attributes:
        id: Short name: of the printed value it rests on, where there is one.
        where: Table or section.
        quantity: What is computed.
        unit: Of the numbers.
        published: As printed; NaN for a sentence.
        role: One of `ROLES`, or of `PUT_IN`, `FITTED` and `FOLLOWS` for a sentence.
        value: The quantity in `unit`, from the printed values' computed counterparts in SI.
        test: Whether the statement is true of such a value.
        needs: The computed counterparts without which there is no value.
        sentence: In the paper's terms; empty for a number.
        words: What the paper has for a number in it.
        joint: Of the middle right leg; empty for all of it.
        half_width: Half of the last printed digit, or of the words' range.
        left_out_by: Key of the sets that predict it; empty where none do.
        computed: Ours, in `unit`.
        verdict: `REPRODUCED`, `MISSED`, or `CONTRADICTED` where other printed values leave no way.
        prior: 95 % of what data sheets and literature say; NaN where other rows fix it.
        prior_share: Share of the prior's draws that pass the test.
        left_out: 95 % of what the other targets predict; NaN where it is no target.
        left_out_share: Share of these sets that pass the test.
        posterior_share: Share of the posterior that does; NaN where that was asked for.
        remark: In words, may be empty.
    """

    id: str
    where: str
    quantity: str
    unit: str
    published: float
    role: str
    value: Callable[[Mapping[str, float]], float]
    test: Callable[[float], bool]
    needs: tuple[str, ...]
    sentence: str = ""
    words: str = ""
    joint: str = ""
    half_width: float = 0.0
    left_out_by: str = ""
    computed: float = math.nan
    verdict: str = ""
    prior: Interval = NONE
    prior_share: float = math.nan
    left_out: Interval = NONE
    left_out_share: float = math.nan
    posterior_share: float = math.nan
    remark: str = ""

    @property
    def holds(self) -> bool:
        """Whether the statement is true of ours."""
        return self.verdict == REPRODUCED


def judged(
    rows: Iterable[Row],
    ours: Mapping[str, float],
    known: Evidence | None,
    *,
    fixed: Iterable[str] = (),
    unmet: Sequence[str] = (),
) -> tuple[Row, ...]:
    """Every row that can be computed, with what is known of it.

    Args:
        rows: Not judged yet.
        ours: Computed counterparts, SI; without those for which the catalogue has no actuator.
        known: The calibration's sets; None where they belong to other numbers.
        fixed: Ids of rows of which the prior says nothing.
        unmet: Ids that stay unmet at the rotor friction that leaves the fewest.
    """
    out = []
    for row in rows:
        if any(name not in ours for name in row.needs):
            continue
        value = row.value(ours)
        verdict = REPRODUCED if row.test(value) else MISSED
        if verdict == MISSED and row.id in unmet:
            verdict = CONTRADICTED
        row = replace(row, computed=value, verdict=verdict)
        out.append(row if known is None else _with_sets(row, known, row.id in set(fixed)))
    return tuple(out)


def _with_sets(row: Row, known: Evidence, is_fixed: bool) -> Row:
    """A row with what the calibration's sets say of it."""

    def of(points: Sequence[Point]) -> tuple[Interval, float]:
        values = [row.value(p.values) for p in points]
        share = float(np.mean([row.test(v) for v in values])) if values else math.nan
        return quantiles(values), share

    prior = (NONE, math.nan) if is_fixed else of(known.prior)
    left_out = of(known.left_out[row.left_out_by]) if row.left_out_by else (NONE, math.nan)
    asked_for = row.role in (PUT_IN, FITTED)
    posterior = math.nan if asked_for else of(known.posterior)[1]
    return replace(
        row,
        prior=prior[0],
        prior_share=prior[1],
        left_out=left_out[0],
        left_out_share=left_out[1],
        posterior_share=posterior,
    )


def printed_numbers(
    published: Mapping[str, Published],
    ours: Mapping[str, float],
    unmet: Sequence[str],
    known: Evidence | None,
) -> tuple[Row, ...]:
    """A row for every printed value that was computed; for the arguments see `judged`."""
    fixed = fixed_before(published) | {f"{a}_leg_energy_3s" for a in ("ideal", "rotor")}
    rows = [
        Row(
            p.id,
            p.where,
            p.quantity,
            p.unit,
            p.value,
            p.role,
            lambda values, p=p: from_si(values[p.id], p.unit),  # type: ignore[misc]
            p.reproduced,
            (p.id,),
            joint=p.joint,
            half_width=p.half_width,
            left_out_by=PREDICTED_BY.get(p.id, ""),
            remark=_remark(p, published, known),
        )
        for p in published.values()
    ]
    return judged(rows, ours, known, fixed=fixed, unmet=unmet)


def _remark(row: Published, published: Mapping[str, Published], known: Evidence | None) -> str:
    asked = asked_frictions(published)
    if row.id in asked:
        return "asks for a rotor friction of " + ", ".join(
            f"{from_si(friction, 'mN*m'):.4g} +- {from_si(half_width, 'mN*m'):.2g} mN*m"
            + ("" if key == row.id else f" is asked by {key}")
            for key, (friction, half_width) in sorted(asked.items(), key=lambda a: a[0] != row.id)
        )
    if row.id == "rotor_leg_energy_3s":
        text = f"3 s times the rounded {published['rotor_power_2'].value:g} W"
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


def headline(rows: Iterable[Row]) -> dict[str, tuple[int, int]]:
    """Per role of printed numbers: how many rows are reproduced, and how many there are."""
    verdicts = [(row.role, row.verdict) for row in rows if not row.sentence]
    return {
        role: (verdicts.count((role, REPRODUCED)), sum(r == role for r, _ in verdicts))
        for role in ROLES
    }
