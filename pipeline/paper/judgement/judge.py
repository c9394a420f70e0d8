"""Holds a robot and its actuators against the paper, as far as the calibration speaks of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from actuators.energy.energy import loss_energies
from actuators.units import from_si
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
    NONE,
    EnergyPerMinute,
    Interval,
    compared,
    evidence,
    per_minute,
)
from pipeline.paper.judgement.leave_one_out import Prediction, leave_one_out
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
    no_load_current,
)
from pipeline.paper.omissions import Omission, omissions
from pipeline.paper.published import ALTERNATIVES
from pipeline.paper.quantities import computed
from pipeline.robot.robot import Robot

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
