"""Fig. 21: energy in a minute against the share of it spent standing, and where the lines cross."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from actuators.arrays import Array
from pipeline.paper.hexapod import Totals
from pipeline.paper.judgement.evidence import BAND, Evidence, Point
from pipeline.paper.judgement.rows import PREDICTED_BY, Row, judged
from pipeline.paper.published import CYCLE, EVEN, PAIR
from pipeline.simulation.energy_change import break_even

MINUTE = 60.0  # [s]
#: Energy per cycle and power standing, by whose energy is meant.
SUBJECTS = {
    "middle_legs": ("pair_cycle_J", "pair_stand_W"),
    "robot_on_3_feet": ("cycle_J", "stand_3_W"),
    "robot_on_6_feet": ("cycle_J", "stand_6_W"),
}


@dataclass(frozen=True)
class EnergyPerMinute:
    """Energy in a minute against the fraction of it spent standing.

    Attributes:
        subject: Key of `SUBJECTS`.
        alternative: Name.
        fraction: Shape (F,) [1].
        energy: Shape (F,) [J].
        prior: 95 % of what data sheets and literature say, (2, F) [J]; None without the sets.
        left_out: 95 % of the sets without this actuator's walking figures, (2, F) [J]; None
            without the sets or where the actuator has no figure of its own.
    """

    subject: str
    alternative: str
    fraction: Array
    energy: Array
    prior: Array | None
    left_out: Array | None


def crossing(whole: Mapping[str, Mapping[str, float]], cycle: str, stand: str) -> float:
    """Fraction of time standing at which reversible and irreversible cost the same.

    Args:
        whole: Per alternative: energies per cycle [J] and powers standing [W].
        cycle: Whose energy per cycle.
        stand: Whose power standing.
    """
    reversible, irreversible = (whole[name] for name in PAIR)
    saved = (reversible[stand] - irreversible[stand]) * CYCLE
    return break_even(irreversible[cycle] - reversible[cycle], saved)


def crossings(whole: Totals) -> dict[str, float]:
    """The crossing for every subject; none without both actuators that may cross."""
    if any(name not in whole for name in PAIR):
        return {}
    return {subject: crossing(whole, *keys) for subject, keys in SUBJECTS.items()}


def break_evens(whole: Totals, known: Evidence | None) -> tuple[Row, ...]:
    """The crossing for every subject.

    Args:
        whole: Ours.
        known: The calibration's sets; None where they belong to other numbers.
    """
    rows = [
        Row(
            subject,
            "Fig. 21",
            "fraction of time standing above which the irreversible actuator uses less",
            "1",
            math.nan,
            "",
            lambda values, subject=subject: values[subject],  # type: ignore[misc]
            lambda fraction: not math.isnan(fraction),
            (subject,),
            left_out_by=PREDICTED_BY[EVEN],
        )
        for subject in SUBJECTS
    ]
    found = judged(rows, crossings(whole), known and known.of_totals(crossings))
    return tuple(replace(row, remark=_note(row, whole, known is not None)) for row in found)


def _note(row: Row, whole: Totals, known: bool) -> str:
    cycle, stand = SUBJECTS[row.id]
    reversible, irreversible = (whole[name] for name in PAIR)
    if row.holds:
        note = "above this share of standing the irreversible actuator uses less"
    elif irreversible[cycle] <= reversible[cycle]:
        note = "no break-even: walking, the irreversible actuator uses no more than the reversible"
    else:
        note = (
            f"no break-even: standing, the reversible actuator holds for {reversible[stand]:.3g} "
            f"W, the irreversible one for {irreversible[stand]:.3g} W"
        )
    if not known:
        return note
    return note + (
        f"; no break-even in {100 * (1 - row.prior_share):.0f} % of the prior's draws and in "
        f"{100 * (1 - row.left_out_share):.0f} % of the sets without the irreversible figures"
    )


def per_minute(whole: Totals, known: Evidence | None) -> tuple[EnergyPerMinute, ...]:
    """The line of every subject and alternative, with what is known of it.

    Args:
        whole: Ours.
        known: The calibration's sets; None where they belong to other numbers.
    """
    fraction = np.linspace(0.0, 1.0, 101)

    def line(subject: str, name: str) -> EnergyPerMinute:
        cycle, stand = SUBJECTS[subject]

        def energy(totals: Totals) -> Array:
            walking = totals[name][cycle] / CYCLE  # [W]
            return MINUTE * ((1 - fraction) * walking + fraction * totals[name][stand])

        def band(points: Sequence[Point]) -> Array | None:
            return np.quantile([energy(p.totals) for p in points], BAND, axis=0) if points else None

        key = PREDICTED_BY.get(f"walking_ratio_{name}")
        prior = band(known.prior) if known else None
        left_out = band(known.left_out[key]) if known and key else None
        return EnergyPerMinute(subject, name, fraction, energy(whole), prior, left_out)

    return tuple(line(subject, name) for subject in SUBJECTS for name in whole)
