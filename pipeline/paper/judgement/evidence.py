"""What a stored calibration says of computed quantities: before the fit, and with one left out.

Also Fig. 21, energy in a minute against the share of it spent standing, and which unpublished
number moves which conclusion.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from actuators.arrays import Array
from pipeline.column import column
from pipeline.paper.hexapod import Totals
from pipeline.paper.published import CYCLE, EVEN, EXTRA, HELD, PAIR
from pipeline.simulation.cycle_energy import break_even

if TYPE_CHECKING:
    from pandas import DataFrame

MINUTE = 60.0  # [s]
#: Quantiles shown as low and high.
BAND = (0.025, 0.975)
#: Fewer values than this have no 95 % that is worth showing.
LEAST = 10
Interval = tuple[float, float]
NONE: Interval = (math.nan, math.nan)
#: Whose energy per cycle and power standing Fig. 21 compares.
SUBJECTS = {
    "middle_legs": ("pair_cycle_J", "pair_stand_W"),
    "robot_on_3_feet": ("cycle_J", "stand_3_W"),
    "robot_on_6_feet": ("cycle_J", "stand_6_W"),
}
_RATIO = "walking_ratio_irreversible"
#: Under which name the sets stand that were fitted without a figure.
LEFT_OUT_BY = {
    **{name: name for name in (HELD, "walking_ratio_rotor", "walking_ratio_reversible")},
    **dict.fromkeys((_RATIO, EVEN, EXTRA, *SUBJECTS), f"{_RATIO}+{EXTRA}"),
}
#: Sets of numbers by what they had to meet: `posterior` every target, `prior` only the posture,
#: Tables III to V and the motor's limits, others every target but those that name them, joined by
#: ``+``. A row for each set: what the paper prints, in SI; ``<alternative> <key of the totals>``;
#: where the lines of Fig. 21 cross; what the sentences compare. Empty where the stored sets belong
#: to other numbers.
Sets = Mapping[str, "DataFrame"]
_STANDING = [f"{name}_leg_energy_3s" for name in ("ideal", "rotor", "reversible", "irreversible")]


def evidence(results: Mapping[str, Any]) -> Sets:
    """The sets of a stored calibration."""
    out = {"posterior": _frame(results["sets"]), "prior": _frame(results["prior"])}
    # Tables IV and V fix them, so that the prior says nothing of its own.
    out["prior"] = out["prior"].drop(columns=_STANDING[:2])
    return out | {key: _frame(sets) for key, sets in results["left_out"].items()}


def _frame(sets: Sequence[Mapping[str, Any]]) -> DataFrame:
    from pandas import DataFrame

    rows = []
    for one in sets:
        totals = {f"{a} {key}": x for a, own in one["totals"].items() for key, x in own.items()}
        rows.append(compared(one["values"]) | totals | crossings(one["totals"]))
    return DataFrame(rows, dtype=float)


def compared(values: Mapping[str, Any]) -> dict[str, Any]:
    """Computed quantities, and how far standing energies are apart [J in 3 s].

    ``ideal_most`` is by how much the ideal actuator draws more than any other, ``ordered`` the
    least step from one actuator to the next with more friction.
    """
    if any(name not in values for name in _STANDING):
        return dict(values)
    energies = np.array([values[name] for name in _STANDING])
    steps = {"ideal_most": energies[0] - energies[1:].max(), "ordered": -np.diff(energies).max()}
    return {**values, **{name: float(step) for name, step in steps.items()}}


def crossing(whole: Totals, cycle: str, stand: str) -> float:
    """Fraction of time standing at which reversible and irreversible cost the same.

    `cycle` and `stand` are the keys of energy per cycle and of power standing.
    """
    reversible, irreversible = (whole[name] for name in PAIR)
    saved = (reversible[stand] - irreversible[stand]) * CYCLE
    return break_even(irreversible[cycle] - reversible[cycle], saved)


def crossings(whole: Totals) -> dict[str, float]:
    """The crossing for every subject; none without both actuators that may cross."""
    if any(name not in whole for name in PAIR):
        return {}
    return {subject: crossing(whole, *keys) for subject, keys in SUBJECTS.items()}


def quantiles(values: Sequence[float]) -> Interval:
    """The middle 95 % of the values that are known; NaN where fewer than `LEAST` are."""
    known = np.array([v for v in values if not math.isnan(v)])
    if known.size < LEAST:
        return NONE
    low, high = np.quantile(known, BAND)
    return float(low), float(high)


@dataclass(frozen=True)
class EnergyPerMinute:
    """Energy in a minute against the fraction of it spent standing."""

    subject: str  #: Key of `SUBJECTS`.
    alternative: str  #: Name.
    fraction: Array  #: (F,) [1].
    energy: Array  #: (F,) [J].
    prior: Array | None  #: 95 % of what data sheets and literature say, (2, F) [J].
    left_out: Array | None  #: 95 % of the sets without this actuator's walking figures, (2, F) [J].


def per_minute(whole: Totals, sets: Sets) -> tuple[EnergyPerMinute, ...]:
    """The line of every subject and alternative, with what the sets say of it."""
    fraction = np.linspace(0.0, 1.0, 101)

    def energy(cycle: Array, stand: Array) -> Array:
        """Of powers walking and standing, (W,) each [J, W]: (W, F) [J]."""
        walking = (1 - fraction) * (cycle / CYCLE)[:, None]  # [W]
        return MINUTE * (walking + fraction * stand[:, None])

    def line(subject: str, name: str) -> EnergyPerMinute:
        def band(key: str) -> Array | None:
            if key not in sets or sets[key].empty:
                return None
            columns = (sets[key][f"{name} {total}"].to_numpy() for total in SUBJECTS[subject])
            return np.quantile(energy(*columns), BAND, axis=0)

        (ours,) = energy(*(np.array([whole[name][total]]) for total in SUBJECTS[subject]))
        left_out = LEFT_OUT_BY.get(f"walking_ratio_{name}", "")
        return EnergyPerMinute(subject, name, fraction, ours, band("prior"), band(left_out))

    return tuple(line(subject, name) for subject in SUBJECTS for name in whole)


@dataclass(frozen=True)
class Sensitivity:
    """Which unpublished number moves which conclusion."""

    table: ClassVar = "sensitivities"
    about: ClassVar = (
        "Every number uniform within one prior standard deviation of the calibrated point."
    )
    output: str = column("walking ratio, energy difference or break-even")
    parameter: str = column("robot or component, and name in its file")
    first_order: float = column("Sobol index of the number alone", "1")
    first_order_95: float = column("half width of its 95 % interval", "1")
    total: float = column("Sobol index with all interactions", "1")
    total_95: float = column("half width of its 95 % interval", "1")


def sensitivities(results: Mapping[str, Any]) -> list[Sensitivity]:
    """Sobol indices of every number on every output."""
    table = results["sensitivity"]
    outputs = {output: own for output, own in table.items() if isinstance(own, Mapping)}
    return [
        Sensitivity(output, *row)
        for output, own in outputs.items()
        for row in zip(
            table["names"], *(own[key] for key in ("S1", "S1_conf", "ST", "ST_conf")), strict=True
        )
    ]


def ranking(results: Mapping[str, Any], output: str) -> list[Sensitivity]:
    """Every number's indices on an output, the largest total first."""
    return sorted(
        (row for row in sensitivities(results) if row.output == output), key=lambda row: -row.total
    )


def leading(ranked: Sequence[Sensitivity]) -> list[Sensitivity]:
    """Those that may be the largest: their intervals reach the largest one's lower end.

    One alone stands out; with more, nothing says which of them to measure first.
    """
    least = ranked[0].total - ranked[0].total_95
    return [row for row in ranked if row.total + row.total_95 >= least]
