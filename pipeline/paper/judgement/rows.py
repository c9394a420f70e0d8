"""What the paper says beside what is computed here: one table, of which the files are views.

A row is a printed number, a sentence about numbers, or a crossing of the lines of Fig. 21. *Much
higher* has no number in the paper: `sentences.csv` takes it for at least twice as high.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from actuators.arrays import Array
from actuators.elements.element import Inertia
from actuators.energy.energy import integral, stage_energies
from actuators.loading.build import WINDING
from actuators.units import from_si
from pipeline.paper.hexapod import Outcome, printed_leg
from pipeline.paper.judgement.evidence import NONE, Interval, known
from pipeline.paper.motor_constants import UNMET, asked_frictions
from pipeline.paper.published import PAIR, Published
from pipeline.paper.quantities import CROSSING

SENTENCES_FILE = Path(__file__).parent / "sentences.csv"
REPRODUCED = "reproduced"
MISSED = "not reproduced"
CONTRADICTED = "contradicted"
#: Part that a sentence plays in the calibration; printed numbers have one of `ROLES`.
PUT_IN, FITTED, FOLLOWS = "put in", "fitted", "follows"


@dataclass(frozen=True)
class Row:
    """One statement of the paper and, once judged, what it comes to here."""

    id: str  #: Short name of what is computed.
    where: str  #: Table or section.
    quantity: str  #: What is computed.
    unit: str  #: Of the numbers.
    role: str = ""  #: One of `ROLES`; of `PUT_IN`, `FITTED` and `FOLLOWS` for a sentence.
    at_least: float = -math.inf  #: True of numbers from here, in `unit`,
    at_most: float = math.inf  #: to here.
    published: float = math.nan  #: As printed; NaN for a sentence.
    half_width: float = 0.0  #: Half of the last printed digit, or of the words' range.
    sentence: str = ""  #: In the paper's terms; empty for a number.
    words: str = ""  #: What the paper has for a number in it.
    joint: str = ""  #: Of the middle right leg; empty for all of it.
    computed: float = math.nan  #: Ours, in `unit`.
    verdict: str = ""  #: `CONTRADICTED` where other printed values leave no way to the number.
    prior: Interval = NONE  #: 95 % of what data sheets and literature say; NaN where fixed.
    prior_share: float = math.nan  #: Share of the prior's draws of which it is true.
    left_out: Interval = NONE  #: 95 % of what the other targets predict; NaN where no target.
    left_out_share: float = math.nan  #: Share of these sets of which it is true.
    posterior_share: float = math.nan  #: Share of the posterior; NaN where that was asked for.
    remark: str = ""  #: In words, may be empty.

    @property
    def holds(self) -> bool:
        """Whether the statement is true of ours."""
        return self.verdict == REPRODUCED

    def true_of(self, value: float) -> bool:
        """Whether the statement is true of a value in `unit`; never of NaN."""
        return self.at_least <= value <= self.at_most


def judged(
    table: str, rows: Iterable[Row], ours: Mapping[str, float], fitted: bool
) -> tuple[Row, ...]:
    """Every row that can be computed, with what is known of it.

    Args:
        table: Of the study.
        rows: Not judged yet.
        ours: What is computed, SI, by the rows' ids; without those for which the catalogue has no
            actuator.
        fitted: Whether the study belongs to these numbers.
    """
    out = []
    for row in rows:
        if row.id not in ours:
            continue
        value = from_si(ours[row.id], row.unit)
        missed = CONTRADICTED if row.id in UNMET else MISSED
        verdict = REPRODUCED if row.true_of(value) else missed
        more = dict(known().get((table, row.id), {})) if fitted else {}
        more["remark"] = "; ".join(filter(None, (row.remark, more.get("remark"))))
        out.append(replace(row, computed=value, verdict=verdict, **more))
    return tuple(out)


def printed_numbers(published: Mapping[str, Published]) -> list[Row]:
    """A row for every printed value."""
    asked = asked_frictions(published)
    rows = []
    for p in published.values():
        remark = ""
        if p.id in asked:
            remark = "asks for a rotor friction of " + ", ".join(
                f"{from_si(friction, 'mN*m'):.4g} +- {from_si(half_width, 'mN*m'):.2g} mN*m"
                + ("" if key == p.id else f" is asked by {key}")
                for key, (friction, half_width) in sorted(asked.items(), key=lambda a: a[0] != p.id)
            )
        elif p.id == "rotor_leg_energy_3s":
            remark = f"3 s times the rounded {published['rotor_power_2'].value:g} W"
        known_by = (p.id, p.where, p.quantity, p.unit, p.role, *p.ends, p.value, p.half_width)
        rows.append(Row(*known_by, joint=p.joint, remark=remark))
    return rows


@cache
def sentences() -> tuple[Row, ...]:
    """The sentences of sections V and IV.A, the latter at every joint that they speak of."""
    with SENTENCES_FILE.open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    rows = []
    for said in lines:
        at_least = float(said["at_least"] or -math.inf)
        if said["more_than"]:
            at_least = math.nextafter(float(said["more_than"]), math.inf)
        row = Row(
            *(said["id"], f"Section {said['section']}", said["quantity"], said["unit"]),
            *(said["role"], at_least, float(said["at_most"] or math.inf)),
            sentence=said["sentence"],
            words=said["words"],
        )
        joints = said["joints"].split()
        rows += [replace(row, id=f"{row.id} {j}", joint=j) for j in joints] or [row]
    return tuple(rows)


def stage_ratios(outcomes: Mapping[str, Outcome]) -> dict[str, float]:
    """What the sentences of section IV.A compare, by their ids: ``<energy> / <energy> <joint>``.

    Args:
        outcomes: The middle legs' walk with the paper's alternatives, or some of them.

    Returns:
        Ratios of energies of the middle right leg per cycle; NaN where nothing is below.
    """
    walks = {name: outcome.walking for name, outcome in outcomes.items()}
    if "rotor" in walks:
        chain = outcomes["rotor"].chain
        rotor = chain.element("rotor_inertia")
        assert isinstance(rotor, Inertia)
        light = chain.replaced(replace(rotor, inertia=0.0))
        walks["rotor without inertia"] = light.inverse(walks["rotor"].joint)
    energy: dict[str, Array] = {}
    for name, walk in walks.items():
        for e in stage_energies(walk):
            energy |= {f"{name}:{e.stage}+": e.forward, f"{name}:{e.stage}-": e.reverse}
        losses = [power for element, power in walk.losses.items() if element != WINDING]
        if losses:
            energy[f"{name}:dissipated"] = integral(walk.joint.time, np.sum(losses, axis=0))
    legs = {name: printed_leg(own)[0] for name, own in energy.items()}
    out = {}
    for row in sentences():
        above, _, below = row.id.removesuffix(f" {row.joint}").partition(" / ")
        if above in legs and below in legs:
            over, under = (float(legs[name][int(row.joint) - 1]) for name in (above, below))
            out[row.id] = over / under if under else math.nan
    return out


def break_evens(costs: Mapping[str, float], fitted: bool) -> tuple[Row, ...]:
    """Where the lines of Fig. 21 cross; for the costs see `pair_costs`."""
    quantity = "fraction of time standing above which the irreversible actuator uses less"
    found = judged("break_even", [Row(CROSSING, "Fig. 21", quantity, "1")], costs, fitted)
    return tuple(replace(row, remark=_note(row, costs)) for row in found)


def _note(row: Row, costs: Mapping[str, float]) -> str:
    cycle, stand = ([costs[f"{a} {key}"] for a in PAIR] for key in ("cycle_J", "stand_W"))
    if row.holds:
        note = "above this share of standing the irreversible actuator uses less"
    elif cycle[1] <= cycle[0]:
        note = "no break-even: walking, the irreversible actuator uses no more than the reversible"
    else:
        note = (
            f"no break-even: standing, the reversible actuator holds for {stand[0]:.3g} "
            f"W, the irreversible one for {stand[1]:.3g} W"
        )
    if math.isnan(row.prior_share):
        return note
    return note + (
        f"; no break-even in {100 * (1 - row.prior_share):.0f} % of the prior's draws and in "
        f"{100 * (1 - row.left_out_share):.0f} % of the sets without the irreversible figures"
    )
