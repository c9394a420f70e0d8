"""Fig. 21: energy in a minute against the share of it spent standing, and where the lines cross."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.paper.calibration.problem import EVEN
from pipeline.paper.calibration.quantities import PAIR
from pipeline.paper.calibration.whole_robot import Totals
from pipeline.paper.judgement.evidence import BAND, NONE, Evidence, Interval, Point, quantiles
from pipeline.paper.judgement.reproduction import PREDICTED_BY
from pipeline.simulation.break_even import break_even

Array = NDArray[np.float64]
MINUTE = 60.0
CYCLE = 3.0  # [s]
#: Energy per cycle and power standing, by whose energy is meant.
SUBJECTS = {
    "middle_legs": ("pair_cycle_J", "pair_stand_W"),
    "robot_on_3_feet": ("cycle_J", "stand_3_W"),
    "robot_on_6_feet": ("cycle_J", "stand_6_W"),
}


@dataclass(frozen=True)
class BreakEven:
    """Where the irreversible actuator begins to pay.

    Attributes:
        subject: Key of `SUBJECTS`.
        fraction: Of time standing; NaN where there is none.
        prior: 95 % of the prior's draws that have one; NaN without the calibration's sets.
        left_out: 95 % of the sets without the irreversible actuator's walking figures, likewise.
        note: In words.
    """

    subject: str
    fraction: float
    prior: Interval
    left_out: Interval
    note: str


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
    extra = whole["irreversible"][cycle] - whole["reversible"][cycle]
    saved = (whole["reversible"][stand] - whole["irreversible"][stand]) * CYCLE
    return break_even(extra, saved)


def break_evens(whole: Totals, known: Evidence | None) -> tuple[BreakEven, ...]:
    """The crossing for every subject; none without both actuators that may cross.

    Args:
        whole: Ours.
        known: The calibration's sets; None where they belong to other numbers.
    """
    if any(name not in whole for name in PAIR):
        return ()
    return tuple(_break_even(subject, whole, known) for subject in SUBJECTS)


def _break_even(subject: str, whole: Totals, known: Evidence | None) -> BreakEven:
    cycle, stand = SUBJECTS[subject]
    value = crossing(whole, cycle, stand)
    reversible, irreversible = whole["reversible"], whole["irreversible"]
    if not math.isnan(value):
        note = "above this share of standing the irreversible actuator uses less"
    elif irreversible[cycle] <= reversible[cycle]:
        note = "no break-even: walking, the irreversible actuator uses no more than the reversible"
    else:
        note = (
            f"no break-even: standing, the reversible actuator holds for {reversible[stand]:.3g} "
            f"W, the irreversible one for {irreversible[stand]:.3g} W"
        )
    if known is None:
        return BreakEven(subject, value, NONE, NONE, note)
    before = [crossing(p.totals, cycle, stand) for p in known.prior]
    others = [crossing(p.totals, cycle, stand) for p in known.left_out[PREDICTED_BY[EVEN]]]
    none, none_left_out = (100 * float(np.mean(np.isnan(v))) for v in (before, others))
    note += (
        f"; no break-even in {none:.0f} % of the prior's draws and in {none_left_out:.0f} % of the "
        "sets without the irreversible figures"
    )
    return BreakEven(subject, value, quantiles(before), quantiles(others), note)


def per_minute(whole: Totals, known: Evidence | None) -> tuple[EnergyPerMinute, ...]:
    """The line of every subject and alternative, with what is known of it.

    Args:
        whole: Ours.
        known: The calibration's sets; None where they belong to other numbers.
    """
    return tuple(_line(subject, name, whole, known) for subject in SUBJECTS for name in whole)


def _line(subject: str, name: str, whole: Totals, known: Evidence | None) -> EnergyPerMinute:
    fraction = np.linspace(0.0, 1.0, 101)
    energy = _energy(*SUBJECTS[subject], name, fraction)
    prior = left_out = None
    if known is not None:
        prior = _band(energy, known.prior)
        key = PREDICTED_BY.get(f"walking_ratio_{name}")
        left_out = _band(energy, known.left_out[key]) if key else None
    return EnergyPerMinute(subject, name, fraction, energy(whole), prior, left_out)


def _energy(cycle: str, stand: str, name: str, fraction: Array) -> Callable[[Totals], Array]:
    """Energy of a minute at each fraction, from a robot's totals [J]."""

    def of(totals: Totals) -> Array:
        walking = totals[name][cycle] / CYCLE  # [W]
        return MINUTE * ((1 - fraction) * walking + fraction * totals[name][stand])

    return of


def _band(energy: Callable[[Totals], Array], points: Sequence[Point]) -> Array | None:
    if not points:
        return None
    return np.quantile(np.array([energy(p.totals) for p in points]), BAND, axis=0)
