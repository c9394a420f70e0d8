"""Holds a robot and its actuators against the paper, as far as the calibration speaks of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from actuators.loading.build import Catalog
from pipeline.paper.calibration.machine import actuator_part, part_of
from pipeline.paper.calibration.prior import Prior
from pipeline.paper.calibration.problem import EXTRA
from pipeline.paper.calibration.quantities import PAIR, computed, walking_extra
from pipeline.paper.calibration.whole_robot import totals
from pipeline.paper.constants.rotor_friction import Frictions, friction_ranges
from pipeline.paper.judgement.conclusions import Conclusion, conclusions
from pipeline.paper.judgement.contradictions import Contradiction, contradiction, stored_ranges
from pipeline.paper.judgement.evidence import Evidence, evidence
from pipeline.paper.judgement.fig_21 import BreakEven, EnergyPerMinute, break_evens, per_minute
from pipeline.paper.judgement.leave_one_out import Prediction, leave_one_out
from pipeline.paper.judgement.price import PRICED, Price, price
from pipeline.paper.judgement.reproduction import ReproducedRow, reproduction
from pipeline.paper.judgement.stage_sentences import STAGE_SENTENCES, stage_values
from pipeline.paper.omissions.costs import NEEDED
from pipeline.paper.omissions.omissions import Omission, omissions
from pipeline.paper.published import Published
from pipeline.robot.robot import Robot


@dataclass(frozen=True)
class Judgement:
    """Ours against the paper's.

    Attributes:
        reproduction: Every printed value.
        conclusions: Every sentence of section V, then of section IV.A joint by joint.
        break_even: Where the irreversible actuator begins to pay.
        per_minute: The lines of Fig. 21.
        predictions: Each target as the rest predicts it; empty without the calibration's sets.
        ranges: Rotor frictions by which entries they leave unmet.
        contradiction: Of Table V with itself.
        price: What the fit asks of single numbers; None without the actuator it was asked of.
        missing: Ids of printed values for which the catalogue has no actuator.
        omissions: What the paper leaves out; empty without its four alternatives.
    """

    reproduction: tuple[ReproducedRow, ...]
    conclusions: tuple[Conclusion, ...]
    break_even: tuple[BreakEven, ...]
    per_minute: tuple[EnergyPerMinute, ...]
    predictions: tuple[Prediction, ...]
    ranges: tuple[Frictions, ...]
    contradiction: Contradiction
    price: Price | None
    missing: tuple[str, ...] = ()
    omissions: tuple[Omission, ...] = ()


def judge(
    robot: Robot,
    catalog: Catalog,
    published: Mapping[str, Published],
    prior: Prior,
    results: Mapping[str, Any] | None,
    *,
    standing_legs: int = 1,
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
        standing_legs: Middle legs that Fig. 21 counts as loaded.
        samples: Per half period.
    """
    part = part_of(robot.spec, samples)
    actuators = actuator_part(part, catalog)
    ours = computed(part, actuators, standing_legs)
    if all(name in catalog.alternatives for name in PAIR):
        ours[EXTRA] = walking_extra(actuators.energy)
    asked = all(name in catalog.alternatives for name in PRICED)
    whole = totals(robot, catalog, samples)
    known: Evidence | None = None if results is None else evidence(results)
    ranges = friction_ranges(published) if results is None else tuple(stored_ranges(results))
    against = contradiction(published, ranges)
    return Judgement(
        reproduction(published, ours, against.best.unmet, known),
        conclusions(ours, known)
        + conclusions(stage_values(actuators, robot.spec), None, STAGE_SENTENCES),
        break_evens(whole, known),
        per_minute(whole, known),
        () if known is None else tuple(leave_one_out(published, known)),
        ranges,
        against,
        price(actuators, catalog, prior, results) if asked else None,
        tuple(name for name in published if name not in ours),
        omissions(part, catalog, published)
        if all(name in catalog.alternatives for name in NEEDED)
        else (),
    )
