"""Holds a robot and its actuators against the paper, as far as the calibration speaks of them.

Each target is also predicted by everything else: what a fitted number is worth as a test.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from actuators.energy.energy import loss_energies
from actuators.units import from_si
from pipeline.column import column
from pipeline.paper.calibration.problem import extra_target
from pipeline.paper.hexapod import (
    PUBLISHED_LEG,
    Outcome,
    outcomes,
    printed_leg,
    robot_part,
    totals,
)
from pipeline.paper.judgement.basis import Basis
from pipeline.paper.judgement.evidence import (
    LEAST,
    NONE,
    EnergyPerMinute,
    Interval,
    Sets,
    compared,
    evidence,
    per_minute,
    quantiles,
)
from pipeline.paper.judgement.rows import (
    Row,
    break_evens,
    judged,
    printed_numbers,
    sentences,
    stage_ratios,
)
from pipeline.paper.motor_constants import (
    ROTOR_FRICTION,
    TORQUE_CONSTANT,
    Frictions,
    best_frictions,
    data_sheet,
    friction_ranges,
    joint_torques,
    no_load_current,
)
from pipeline.paper.omissions import Omission, omissions
from pipeline.paper.published import ALTERNATIVES, EVEN, EXTRA, Published
from pipeline.paper.quantities import computed
from pipeline.robot.robot import Robot

#: What each exactly met target fixes; nothing else knows these numbers of the robot.
_FIXES = {
    "standing_reaction_rm": "trunk_com_left",
    "standing_torque_2": "joint_2_lateral",
    "standing_torque_3": "body_height",
    "rotor_current_2": "rotor_re40.coulomb",
}
ROTOR_VISCOUS = "rotor_re40.viscous"
GEAR_FRICTION = "planetary.coulomb"
GEAR_ELEMENT = "planetary_friction"
#: A no-load current above the data sheet's by more than this is called out.
NOTABLE = 1.3


@dataclass(frozen=True)
class Price:
    """What the fit of "almost 15" and "4 times" asks of single numbers."""

    gear_friction: float  #: Coulomb friction of the planetary gear [mN*m].
    gear_prior: float  #: Centre of what gear data say of it [mN*m].
    gear_interval: Interval  #: Their 95 % belief [mN*m].
    gear_heat: float  #: What it dissipates in the middle right leg in one cycle [J].
    leg_energy: float  #: What that leg draws in one cycle with the irreversible actuator [J].
    no_load_sheet: float  #: The data sheet's current without load [A].
    gear_known: Interval = NONE  #: 95 % of the posterior of the friction [mN*m].
    no_load_share: float = math.nan  #: Share of the posterior above `NOTABLE` times the sheet's.


@dataclass(frozen=True)
class Judgement:
    """Ours against the paper's."""

    by: Basis  #: What it was judged by.
    #: Every printed number and sentence of sections V and IV.A that can be computed.
    rows: tuple[Row, ...]
    break_even: tuple[Row, ...]  #: Where the lines of Fig. 21 cross, by whose energy is meant.
    per_minute: tuple[EnergyPerMinute, ...]  #: The lines.
    predictions: tuple[Prediction, ...]  #: Empty without the calibration's sets.
    ranges: tuple[Frictions, ...]  #: Rotor frictions by which entries they leave unmet.
    best: Frictions  #: The one that leaves the fewest.
    price: Price | None  #: None without the actuator it was asked of.
    missing: tuple[str, ...]  #: Ids of printed values for which the catalogue has no actuator.
    omissions: tuple[Omission, ...]  #: Empty without the paper's four alternatives.

    @property
    def reproduction(self) -> tuple[Row, ...]:
        """The printed numbers."""
        return tuple(row for row in self.rows if not row.sentence)

    @property
    def conclusions(self) -> tuple[Row, ...]:
        """The sentences."""
        return tuple(row for row in self.rows if row.sentence)


def judge(robot: Robot, by: Basis, *, samples: int = 751) -> Judgement:
    """Judge the robot and its actuators as they stand, with so many samples per half period."""
    catalog, published, results = by.catalog, by.published, by.results
    part = robot_part(robot.spec, samples)
    found = outcomes(part.demand, catalog)
    ours = computed(part, found)
    whole = totals(robot, {name: outcome.chain for name, outcome in found.items()}, samples)
    sets = {} if results is None else evidence(results)
    if results is None:
        ranges = friction_ranges(published)
    else:
        stored = results["rotor_friction"]
        ranges = tuple(Frictions(r["low"], r["high"], tuple(r["unmet"])) for r in stored)
    best = best_frictions(ranges, published)
    price = None
    if {"rotor", "irreversible"} <= found.keys():
        price = _price(found["irreversible"], by)
    return Judgement(
        by,
        printed_numbers(published, ours, best.unmet, sets)
        + judged(sentences(), compared(ours) | stage_ratios(found), sets),
        break_evens(whole, sets),
        per_minute(whole, sets),
        tuple(leave_one_out(published, sets) if sets else ()),
        ranges,
        best,
        price,
        tuple(name for name in published if name not in ours),
        omissions(part.demand, catalog, published) if {*ALTERNATIVES} <= found.keys() else (),
    )


def _price(irreversible: Outcome, by: Basis) -> Price:
    """The price of the fit at the numbers as they stand."""
    gear = next(free for free in by.prior.free if free.key == GEAR_FRICTION)

    def shown(low: float, high: float) -> Interval:
        return from_si(low, gear.unit), from_si(high, gear.unit)

    heat, sheet = loss_energies(irreversible.walking), data_sheet()["no_load_current"]
    known, share = NONE, math.nan
    if by.results is not None:
        own = by.results["posterior"]["numbers"][GEAR_FRICTION]
        known = shown(gear.value(own["low"]), gear.value(own["high"]))
        at = by.prior.keys.index(ROTOR_VISCOUS)
        currents = [
            no_load_current(
                one["constants"][TORQUE_CONSTANT],
                one["constants"][ROTOR_FRICTION],
                by.prior.free[at].value(one["z"][at]),
            )
            for one in by.results["sets"]
        ]
        share = float(np.mean(np.array(currents) > NOTABLE * sheet))
    return Price(
        from_si(by.catalog.parameter(GEAR_FRICTION).value, gear.unit),
        from_si(gear.centre, gear.unit),
        shown(*gear.interval),
        float(printed_leg(heat[GEAR_ELEMENT]).sum()) if GEAR_ELEMENT in heat else 0.0,
        irreversible.consumed(PUBLISHED_LEG),
        sheet,
        known,
        share,
    )


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
