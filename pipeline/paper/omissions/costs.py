"""What walking and standing cost with some of the actuators' numbers changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from actuators.chain import Chain
from actuators.elements.hypoid import Hypoid
from actuators.loading.build import Catalog
from pipeline.paper.calibration.machine import (
    MIDDLE_LEGS,
    PUBLISHED_LEG,
    Array,
    RobotPart,
    actuator_part,
)
from pipeline.paper.calibration.quantities import PAIR
from pipeline.paper.judgement.fig_21 import CYCLE, crossing

#: Alternatives that are compared, the first with each of the others.
NEEDED = ("ideal", "rotor", *PAIR)
JOINTS_PER_LEG = 3


@dataclass(frozen=True)
class Costs:
    """Energy per cycle by alternative and leg [J]; power standing, both middle legs [W]."""

    cycle: Mapping[str, Mapping[str, float]]
    stand: Mapping[str, float]

    @property
    def break_even(self) -> float:
        """Fraction of time standing; NaN where there is none."""
        pair = {n: {"cycle": sum(self.cycle[n].values()), "stand": self.stand[n]} for n in PAIR}
        return crossing(pair, "cycle", "stand")

    @property
    def ratios(self) -> dict[str, float]:
        """Of the middle right leg."""
        first, *others = NEEDED
        return {n: self.cycle[n][PUBLISHED_LEG] / self.cycle[first][PUBLISHED_LEG] for n in others}

    def with_power(self, each: float, walking: set[str], standing: set[str]) -> Costs:
        """With a constant power per joint in some alternatives.

        Args:
            each: Per joint of both legs [W].
            walking: Alternatives that draw it walking.
            standing: Alternatives that draw it standing.
        """
        per_leg = each * JOINTS_PER_LEG  # [W]
        return Costs(
            {
                n: {leg: e + (per_leg * CYCLE if n in walking else 0.0) for leg, e in legs.items()}
                for n, legs in self.cycle.items()
            },
            {
                n: p + (per_leg * len(MIDDLE_LEGS) if n in standing else 0.0)
                for n, p in self.stand.items()
            },
        )


def costs_of(part: RobotPart, catalog: Catalog, *, net: bool = False) -> Costs:
    """What the alternatives cost; see `pipeline.paper.calibration.machine.actuator_part`."""
    found = actuator_part(part, catalog, net=net)
    return Costs(found.energy, {n: float(h.power.sum()) for n, h in found.holding.items()})


def with_factors(catalog: Catalog, factors: Mapping[str, float]) -> Catalog:
    """The catalogue with some numbers times a factor, wherever their bounds are.

    Args:
        catalog: To start from.
        factors: By `component.parameter`.
    """
    for key, factor in factors.items():
        catalog = catalog.replaced(key, factor * catalog.parameter(key).value, bounds=None)
    return catalog


def holding_friction(chain: Chain, gear: Hypoid, torque: Array) -> float:
    """Least friction at a hypoid's teeth with which its actuator holds joints without current [1].

    Bearings, gears and rotor help to hold, so that it is less than the gear's `locking_friction`;
    zero where they hold alone.

    Args:
        chain: The actuator.
        gear: The hypoid gear in it.
        torque: To hold (J,) [N*m].
    """

    def spare(friction: float) -> float:
        """How far the motor torque zero is inside what holds [N*m]; negative outside."""
        held = chain.replaced(replace(gear, friction=friction)).holding(torque)
        return float(np.minimum(held.high, -held.low).min())

    if spare(0.0) >= 0.0:
        return 0.0
    return float(brentq(spare, 0.0, float(gear.locking_friction)))
