"""Holds a robot and its actuators against the paper, as far as the calibration speaks of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from actuators.energy.energy import loss_energies
from actuators.loading.build import Catalog
from actuators.units import from_si
from pipeline.paper.calibration.prior import Prior
from pipeline.paper.constants.data_sheet import data_sheet, no_load_current
from pipeline.paper.constants.motor_constants import (
    ROTOR_FRICTION,
    TORQUE_CONSTANT,
    Frictions,
    best_frictions,
    friction_ranges,
)
from pipeline.paper.hexapod import (
    PUBLISHED_LEG,
    Outcome,
    outcomes,
    printed_leg,
    robot_part,
    totals,
)
from pipeline.paper.judgement.evidence import NONE, Interval, evidence
from pipeline.paper.judgement.fig_21 import EnergyPerMinute, break_evens, per_minute
from pipeline.paper.judgement.leave_one_out import Prediction, leave_one_out
from pipeline.paper.judgement.rows import Row, judged, printed_numbers
from pipeline.paper.judgement.sentences import SECTION_V, section_iv_a, stage_values
from pipeline.paper.omissions.omissions import Omission, omissions
from pipeline.paper.published import ALTERNATIVES, Published
from pipeline.paper.quantities import computed
from pipeline.robot.robot import Robot

ROTOR_VISCOUS = "rotor_re40.viscous"
GEAR_FRICTION = "planetary.coulomb"
GEAR_ELEMENT = "planetary_friction"
#: A no-load current above the data sheet's by more than this is called out.
NOTABLE = 1.3


@dataclass(frozen=True)
class Price:
    """What the fit of "almost 15" and "4 times" asks of single numbers.

    Attributes:
        gear_friction: Coulomb friction of the planetary gear [mN*m].
        gear_prior: Centre of what gear data say of it [mN*m].
        gear_interval: Their 95 % belief [mN*m].
        gear_known: 95 % of the posterior of it [mN*m]; NaN without.
        gear_heat: What it dissipates in the middle right leg in one cycle [J].
        leg_energy: What that leg draws in one cycle with the irreversible actuator [J].
        no_load_sheet: The data sheet's [A].
        no_load_share: Share of the posterior above `NOTABLE` times the data sheet's; NaN without.
    """

    gear_friction: float
    gear_prior: float
    gear_interval: Interval
    gear_known: Interval
    gear_heat: float
    leg_energy: float
    no_load_sheet: float
    no_load_share: float


@dataclass(frozen=True)
class Judgement:
    """Ours against the paper's.

    Attributes:
        rows: Every printed number, every sentence of section V, then of section IV.A joint by
            joint: what of them can be computed.
        break_even: Where the lines of Fig. 21 cross, by whose energy is meant.
        per_minute: The lines.
        predictions: Each target as the rest predicts it; empty without the calibration's sets.
        ranges: Rotor frictions by which entries they leave unmet.
        best: The one that leaves the fewest.
        price: What the fit asks of single numbers; None without the actuator it was asked of.
        missing: Ids of printed values for which the catalogue has no actuator.
        omissions: What the paper leaves out; empty without its four alternatives.
    """

    rows: tuple[Row, ...]
    break_even: tuple[Row, ...]
    per_minute: tuple[EnergyPerMinute, ...]
    predictions: tuple[Prediction, ...]
    ranges: tuple[Frictions, ...]
    best: Frictions
    price: Price | None
    missing: tuple[str, ...] = ()
    omissions: tuple[Omission, ...] = ()

    @property
    def reproduction(self) -> tuple[Row, ...]:
        """The printed numbers."""
        return tuple(row for row in self.rows if not row.sentence)

    @property
    def conclusions(self) -> tuple[Row, ...]:
        """The sentences."""
        return tuple(row for row in self.rows if row.sentence)


def judge(
    robot: Robot,
    catalog: Catalog,
    published: Mapping[str, Published],
    prior: Prior,
    results: Mapping[str, Any] | None,
    *,
    samples: int = 751,
) -> Judgement:
    """Judge the robot and the catalogue as they stand.

    Args:
        robot: With a floating base.
        catalog: Actuators: the paper's, or some of them; what the others print is left out.
        published: The printed values.
        prior: What was known before.
        results: The stored calibration, if it was made with these very numbers; else None, and
            everything that needs its sets is left out.
        samples: Per half period.
    """
    part = robot_part(robot.spec, samples)
    found = outcomes(part.demand, catalog)
    ours = computed(part, found)
    chains = {name: outcome.chain for name, outcome in found.items()}
    whole = totals(robot, chains, samples)
    known = None if results is None else evidence(results)
    if results is None:
        ranges = friction_ranges(published)
    else:
        stored = results["rotor_friction"]
        ranges = tuple(Frictions(r["low"], r["high"], tuple(r["unmet"])) for r in stored)
    best = best_frictions(ranges, published)
    priced = all(name in found for name in ("rotor", "irreversible"))
    return Judgement(
        printed_numbers(published, ours, best.unmet, known)
        + judged(SECTION_V, ours, known)
        + judged(section_iv_a(), stage_values(found), None),
        break_evens(whole, known),
        per_minute(whole, known),
        () if known is None else tuple(leave_one_out(published, known)),
        ranges,
        best,
        price(found["irreversible"], catalog, prior, results) if priced else None,
        tuple(name for name in published if name not in ours),
        omissions(part.demand, catalog, published)
        if all(name in found for name in ALTERNATIVES)
        else (),
    )


def price(
    irreversible: Outcome, catalog: Catalog, prior: Prior, results: Mapping[str, Any] | None
) -> Price:
    """The price of the fit at the numbers as they stand.

    Args:
        irreversible: The middle legs' walk with the irreversible actuator.
        catalog: The actuators.
        prior: What was known before.
        results: The stored calibration; None where it belongs to other numbers.
    """
    gear = next(free for free in prior.free if free.key == GEAR_FRICTION)

    def shown(ends: Interval) -> Interval:
        return from_si(ends[0], gear.unit), from_si(ends[1], gear.unit)

    heat = loss_energies(irreversible.walking).get(GEAR_ELEMENT)
    sheet = data_sheet()["no_load_current"]
    share, known = math.nan, NONE
    if results is not None:
        own = results["posterior"]["numbers"][GEAR_FRICTION]
        known = shown((gear.value(own["low"]), gear.value(own["high"])))
        at = prior.keys.index(ROTOR_VISCOUS)
        currents = [
            no_load_current(
                m["constants"][TORQUE_CONSTANT],
                m["constants"][ROTOR_FRICTION],
                prior.free[at].value(m["z"][at]),
            )
            for m in results["sets"]
        ]
        share = float(np.mean(np.array(currents) > NOTABLE * sheet))
    return Price(
        from_si(catalog.parameter(GEAR_FRICTION).value, gear.unit),
        from_si(gear.centre, gear.unit),
        shown(gear.interval),
        known,
        0.0 if heat is None else float(printed_leg(heat).sum()),
        irreversible.consumed(PUBLISHED_LEG),
        sheet,
        share,
    )
