"""Holds a robot and its actuators against the paper, as far as the fit's study speaks of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.energy.energy import loss_energies
from actuators.units import from_si
from pipeline.columns import frame
from pipeline.paper.hexapod import PUBLISHED_LEG, Outcome, outcomes, printed_leg, robot_part
from pipeline.paper.judgement.basis import Basis
from pipeline.paper.judgement.evidence import EnergyPerMinute, Interval, per_minute
from pipeline.paper.judgement.rows import (
    Row,
    break_evens,
    judged,
    printed_numbers,
    sentences,
    stage_ratios,
)
from pipeline.paper.motor_constants import NO_LOAD_CURRENT
from pipeline.paper.omissions import omissions
from pipeline.paper.published import ALTERNATIVES
from pipeline.paper.quantities import computed, pair_costs
from pipeline.robot.robot import Robot

if TYPE_CHECKING:
    from pandas import DataFrame

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
    gear_known: Interval  #: 95 % of the posterior of the friction [mN*m].
    no_load_share: float  #: Share of the posterior above `NOTABLE` times the sheet's.


@dataclass(frozen=True)
class Judgement:
    """Ours against the paper's."""

    by: Basis  #: What it was judged by.
    #: Every printed number and sentence of sections V and IV.A that can be computed.
    rows: tuple[Row, ...]
    break_even: tuple[Row, ...]  #: Where the lines of Fig. 21 cross; empty where none can.
    per_minute: tuple[EnergyPerMinute, ...]  #: The lines.
    price: Price | None  #: None where the study belongs to other numbers.
    missing: tuple[str, ...]  #: Ids of printed values for which the catalogue has no actuator.
    omissions: DataFrame | None  #: None without the paper's four alternatives.

    @property
    def tables(self) -> dict[str, DataFrame]:
        """By the name of their file."""
        out = {
            "reproduction": frame("reproduction", map(_reproduced, self.reproduction)),
            "conclusions": frame("conclusions", map(_concluded, self.conclusions)),
            "break_even": frame(
                "break_even",
                [(r.id, r.computed, *r.prior, *r.left_out, r.remark) for r in self.break_even],
            ),
            "energy_per_minute": frame("energy_per_minute", _minutes(self.per_minute)),
        }
        return out if self.omissions is None else {**out, "omissions": self.omissions}

    @property
    def reproduction(self) -> tuple[Row, ...]:
        """The printed numbers."""
        return tuple(row for row in self.rows if not row.sentence)

    @property
    def conclusions(self) -> tuple[Row, ...]:
        """The sentences."""
        return tuple(row for row in self.rows if row.sentence)


def _reproduced(r: Row) -> Sequence[Any]:
    head = (r.id, r.where, r.quantity, r.joint, r.unit, r.published, r.half_width, r.computed)
    verdict = (r.computed - r.published, r.role, r.verdict, r.posterior_share)
    return (*head, *verdict, *r.prior, *r.left_out, r.remark)


def _concluded(r: Row) -> Sequence[Any]:
    head = (r.where, r.sentence, r.joint, r.quantity, r.unit, r.words, r.computed, r.holds, r.role)
    known = (*r.prior, r.prior_share, *r.left_out, r.left_out_share, r.posterior_share)
    return (*head, *known)


def _minutes(lines: Sequence[EnergyPerMinute]) -> Iterator[Sequence[Any]]:
    """The lines of Fig. 21, point by point."""
    for line in lines:
        nothing = np.full((2, line.fraction.size), np.nan)
        bands = (nothing if band is None else band for band in (line.prior, line.left_out))
        prior, left_out = bands
        points = zip(line.fraction, line.energy, *prior, *left_out, strict=True)
        yield from ((line.subject, line.alternative, *point) for point in points)


def judge(robot: Robot, by: Basis, *, samples: int = 751) -> Judgement:
    """Judge the robot and its actuators as they stand, with so many samples per half period."""
    catalog, published, fitted = by.catalog, by.published, by.results is not None
    part = robot_part(robot.spec, samples)
    found = outcomes(part.demand, catalog)
    ours, costs = computed(part, found), pair_costs(found)
    return Judgement(
        by,
        judged("reproduction", printed_numbers(published), ours, fitted)
        + judged("conclusions", sentences(), ours | stage_ratios(found), fitted),
        break_evens(costs, fitted),
        per_minute(costs, found, with_bands=fitted),
        _price(found["irreversible"], by) if fitted else None,
        tuple(name for name in published if name not in ours),
        omissions(part.demand, catalog, published) if {*ALTERNATIVES} <= found.keys() else None,
    )


def _price(irreversible: Outcome, by: Basis) -> Price:
    """The price of the fit."""
    gear, heat = by.stored["gear"], loss_energies(irreversible.walking)
    return Price(
        from_si(by.catalog.parameter("planetary.coulomb").value, "mN*m"),
        gear["prior"],
        (gear["prior_low"], gear["prior_high"]),
        float(printed_leg(heat["planetary_friction"]).sum()),
        irreversible.consumed(PUBLISHED_LEG),
        NO_LOAD_CURRENT,
        (gear["low"], gear["high"]),
        by.stored["no_load_share"],
    )
