"""Holds what the model computes against what the paper prints, with its spread."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuators.build import Catalog
from actuators.units import from_si
from pipeline.calibration.calibrate import OUTPUTS
from pipeline.calibration.machine import actuator_part, part_of
from pipeline.calibration.problem import EXTRA, extra_target
from pipeline.calibration.published import Published, load_published
from pipeline.calibration.quantities import DIMENSIONS, IDS, computed, walking_extra
from pipeline.calibration.whole_robot import Totals, totals
from pipeline.robot import Robot

Array = NDArray[np.float64]
MINUTE = 60.0
#: Quantiles shown as low and high.
BAND = (0.025, 0.975)
SUBJECTS = {
    "middle_legs": ("pair_cycle_J", "pair_stand_W"),
    "robot_on_3_feet": ("cycle_J", "stand_3_W"),
    "robot_on_6_feet": ("cycle_J", "stand_6_W"),
}


@dataclass(frozen=True)
class ReproducedRow:
    """One printed value beside ours, in the printed unit.

    Attributes:
        published: The printed value.
        computed: Ours.
        low: 2.5 % quantile over the ensemble.
        high: 97.5 % quantile.
    """

    published: Published
    computed: float
    low: float
    high: float

    @property
    def error(self) -> float:
        """Computed less published."""
        return self.computed - self.published.value

    @property
    def verdict(self) -> str:
        """``reproduced`` or ``not reproduced``."""
        fits = self.published.reproduced(self.computed)
        return "reproduced" if fits else "not reproduced"


@dataclass(frozen=True)
class Conclusion:
    """A sentence of section V as a number.

    Attributes:
        sentence: In the paper's terms.
        quantity: What is computed.
        unit: Of the numbers.
        printed: What the paper says.
        computed: Ours.
        low: Over the ensemble.
        high: Over the ensemble.
        prior_low: Over the prior, without the paper's energy figures.
        prior_high: Likewise.
        holds_share: Share of the ensemble in which the sentence holds.
        prior_holds_share: Share of the prior in which it holds.
    """

    sentence: str
    quantity: str
    unit: str
    printed: str
    computed: float
    low: float
    high: float
    prior_low: float
    prior_high: float
    holds_share: float
    prior_holds_share: float


@dataclass(frozen=True)
class BreakEven:
    """Where the irreversible actuator begins to pay.

    Attributes:
        subject: Key of `SUBJECTS`.
        fraction: Of time standing; NaN where there is none.
        low: Over the ensemble.
        high: Over the ensemble.
        note: In words.
    """

    subject: str
    fraction: float
    low: float
    high: float
    note: str


@dataclass(frozen=True)
class EnergyPerMinute:
    """Energy in a minute against the fraction of it spent standing.

    Attributes:
        subject: Key of `SUBJECTS`.
        alternative: Name.
        fraction: Shape (F,) [1].
        energy: Shape (F,) [J].
        low: Over the ensemble [J].
        high: Over the ensemble [J].
    """

    subject: str
    alternative: str
    fraction: Array
    energy: Array
    low: Array
    high: Array


@dataclass(frozen=True)
class Judgement:
    """All of it."""

    reproduction: tuple[ReproducedRow, ...]
    conclusions: tuple[Conclusion, ...]
    break_even: tuple[BreakEven, ...]
    per_minute: tuple[EnergyPerMinute, ...]


def judge(
    robot: Robot,
    catalog: Catalog,
    results: Mapping[str, Any],
    *,
    standing_legs: int = 1,
    samples: int = 751,
) -> Judgement:
    """Judge the robot and the catalogue as they stand.

    Args:
        robot: With a floating base.
        catalog: Actuators.
        results: Of the stored calibration: the ensemble and the prior's draws.
        standing_legs: Middle legs that Fig. 21 counts as loaded.
        samples: Per segment.
    """
    published = load_published(IDS, DIMENSIONS)
    part = part_of(robot.spec, samples)
    actuators = actuator_part(part, catalog)
    ours = computed(part, actuators, standing_legs)
    ours[EXTRA] = walking_extra(actuators.energy)
    members = [_numbers(m["values"]) for m in results["ensemble"]]
    prior = [_numbers(values) for values in results["prior"]]
    whole = totals(robot, catalog, samples)
    spread = [m["totals"] for m in results["ensemble"]]
    return Judgement(
        tuple(_row(published[name], ours[name], [m[name] for m in members]) for name in published),
        tuple(_conclusions(ours, members, prior)),
        tuple(_break_even(subject, whole, spread) for subject in SUBJECTS),
        tuple(_per_minute(subject, name, whole, spread) for subject in SUBJECTS for name in whole),
    )


def _numbers(values: Mapping[str, Any]) -> dict[str, float]:
    return {key: math.nan if value is None else float(value) for key, value in values.items()}


def _quantiles(values: Sequence[float]) -> tuple[float, float]:
    known = np.array([v for v in values if not math.isnan(v)])
    if known.size == 0:
        return math.nan, math.nan
    low, high = np.quantile(known, BAND)
    return float(low), float(high)


def _row(published: Published, value: float, members: Sequence[float]) -> ReproducedRow:
    low, high = _quantiles(members)
    unit = published.unit
    return ReproducedRow(
        published, *(from_si(x, unit) for x in (value, min(low, value), max(high, value)))
    )


def _conclusions(
    ours: Mapping[str, float],
    members: Sequence[Mapping[str, float]],
    prior: Sequence[Mapping[str, float]],
) -> list[Conclusion]:
    def row(
        sentence: str, quantity: str, unit: str, printed: str, name: str, test: Any
    ) -> Conclusion:
        own = [m[name] for m in members]
        before = [m[name] for m in prior]
        return Conclusion(
            sentence,
            quantity,
            unit,
            printed,
            ours[name],
            *_quantiles(own),
            *_quantiles(before),
            float(np.mean([bool(test(v)) for v in own])),
            float(np.mean([bool(test(v)) for v in before])),
        )

    rows = [
        row(
            "rotor inertia and friction make walking 4 times as costly as the ideal actuator",
            "walking energy of the middle right leg over the ideal actuator's",
            "1",
            "4",
            "walking_ratio_rotor",
            lambda v: 3.5 <= v <= 4.5,
        ),
        row(
            "the reversible actuator needs more than 10 times the ideal energy",
            "walking energy of the middle right leg over the ideal actuator's",
            "1",
            "more than 10",
            "walking_ratio_reversible",
            lambda v: v > 10,
        ),
        row(
            "the ratio is almost 15 for the irreversible actuator",
            "walking energy of the middle right leg over the ideal actuator's",
            "1",
            "almost 15",
            "walking_ratio_irreversible",
            lambda v: 14.5 <= v <= 15,
        ),
        row(
            "walking, the irreversible actuator needs more than the reversible one",
            "irreversible less reversible, per middle leg and cycle",
            "J",
            "more",
            EXTRA,
            lambda v: v > 0,
        ),
        row(
            "standing, friction saves: the ideal actuator draws most",
            "power of the loaded leg's joint 2, ideal actuator",
            "W",
            "2.04",
            "ideal_power_2",
            lambda v: v > 0,
        ),
        row(
            "standing, the reversible actuator draws less than the ideal one",
            "power of the loaded leg's joint 2, reversible actuator",
            "W",
            "0.866",
            "reversible_power_2",
            lambda v: v < 2.04,
        ),
        row(
            "standing, the irreversible actuator draws nothing",
            "energy of the loaded leg in 3 s",
            "J",
            "0",
            "irreversible_leg_energy_3s",
            lambda v: v == 0,
        ),
        row(
            "the reversible actuator is cheaper unless the robot stands over 94 % of the time",
            "break-even fraction of time standing, both middle legs",
            "1",
            "0.94",
            "break_even_standing_fraction",
            lambda v: 0.935 <= v <= 0.945,
        ),
    ]
    return rows


def crossing(whole: Mapping[str, Mapping[str, float]], cycle: str, stand: str) -> float:
    """Fraction of time standing at which reversible and irreversible cost the same.

    (1 - f) dW/T = f dP with dW the extra walking energy of the irreversible actuator and dP the
    power it saves standing. NaN where it never costs more walking or saves nothing standing.
    """
    extra = whole["irreversible"][cycle] - whole["reversible"][cycle]
    saved = (whole["reversible"][stand] - whole["irreversible"][stand]) * 3.0
    if extra <= 0 or saved <= 0:
        return math.nan
    return extra / (extra + saved)


def _break_even(subject: str, whole: Totals, spread: Sequence[Totals]) -> BreakEven:
    cycle, stand = SUBJECTS[subject]
    value = crossing(whole, cycle, stand)
    others = [crossing(m, cycle, stand) for m in spread]
    low, high = _quantiles(others)
    none = float(np.mean(np.isnan(others)))
    if math.isnan(value):
        note = (
            "no break-even: standing, the reversible actuator holds for "
            f"{whole['reversible'][stand]:.3g} W, the irreversible one for "
            f"{whole['irreversible'][stand]:.3g} W; {none:.0%} of the ensemble agree"
        )
    else:
        note = (
            f"above this fraction the irreversible actuator uses less; none in {none:.0%} of sets"
        )
    return BreakEven(subject, value, low, high, note)


def _per_minute(
    subject: str, name: str, whole: Totals, spread: Sequence[Totals]
) -> EnergyPerMinute:
    cycle, stand = SUBJECTS[subject]
    fraction = np.linspace(0.0, 1.0, 101)

    def energy(of: Mapping[str, Mapping[str, float]]) -> Array:
        walking = of[name][cycle] / 3.0  # [W]
        return MINUTE * ((1 - fraction) * walking + fraction * of[name][stand])

    band = np.quantile(np.array([energy(m) for m in spread]), BAND, axis=0)
    return EnergyPerMinute(subject, name, fraction, energy(whole), band[0], band[1])


@dataclass(frozen=True)
class Prediction:
    """A target predicted from the others, in its unit.

    Attributes:
        name: Its id.
        unit: Of the numbers.
        published: Printed, or implied by the printed break-even.
        half_width: Of it.
        median: Over the sets that meet the others.
        low: 2.5 % quantile.
        high: 97.5 % quantile.
        sets: How many sets met the others.
    """

    name: str
    unit: str
    published: float
    half_width: float
    median: float
    low: float
    high: float
    sets: int


def leave_one_out(results: Mapping[str, Any]) -> list[Prediction]:
    """Each target as the others predict it."""
    published = load_published(IDS, DIMENSIONS)
    extra = extra_target(published, 1)
    out = []
    for name, tries in results["left_out"].items():
        values = [float(t["values"][name]) for t in tries if t.get("admissible")]
        if name == EXTRA:
            unit, centre, half = "J", extra.centre, extra.half_width
        else:
            row = published[name]
            unit, centre, half = row.unit, row.value, row.half_width
            values = [from_si(v, unit) for v in values]
        low, high = _quantiles(values)
        median = float(np.median(values)) if values else math.nan
        out.append(Prediction(name, unit, centre, half, median, low, high, len(values)))
    return out


def reading_rows(results: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Every reading with every printed value, its constraints and the discriminators."""
    published = load_published(IDS, DIMENSIONS)
    rows = []
    for reading in results["readings"]:
        head = {"axis_deg": reading["axis_deg"], "standing_legs_counted": reading["legs"]}
        point = reading["point"]
        if point is None:
            rows.append(head | _reading("search", "1", math.nan, "no point: the robot cannot walk"))
            continue
        values = _numbers(point["values"])
        for row in published.values():
            ours = from_si(values[row.id], row.unit)
            fits = "reproduced" if row.reproduced(ours) else "not reproduced"
            rows.append(head | _reading(row.id, row.unit, ours, fits))
        for name, excess in point["excess"].items():
            word = "within the data sheet" if excess <= 0 else "breach"
            rows.append(head | _reading(f"limit:{name}", "1", excess, word))
        rows.append(
            head | _reading("ideal_leg_energy_cycle", "J", point["energy"]["ideal"]["rm"], "")
        )
        for joint, ratio in point["electrical_over_mechanical"].items():
            rows.append(head | _reading(f"electrical_over_mechanical:{joint}", "1", ratio, ""))
        rows.append(head | _reading("prior_distance", "1", point["prior_distance"], ""))
    return rows


def _reading(name: str, unit: str, value: float | None, verdict: str) -> dict[str, Any]:
    return {"id": name, "unit": unit, "computed": value, "verdict": verdict}


def sensitivity_rows(results: Mapping[str, Any]) -> list[dict[str, Any]]:
    """First-order and total Sobol indices, one row per output and number."""
    table = results["sensitivity"]
    return [
        {
            "output": output,
            "parameter": name,
            "first_order": table[output]["S1"][i],
            "first_order_95": table[output]["S1_conf"][i],
            "total": table[output]["ST"][i],
            "total_95": table[output]["ST_conf"][i],
        }
        for output in OUTPUTS
        for i, name in enumerate(table["names"])
    ]


def headline(rows: Sequence[ReproducedRow]) -> dict[str, tuple[int, int]]:
    """Per role: how many rows are reproduced, and how many there are."""
    out = {}
    for role in ("check", "target", "input"):
        own = [row for row in rows if row.published.role == role]
        out[role] = (sum(row.verdict == "reproduced" for row in own), len(own))
    return out
