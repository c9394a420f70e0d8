"""What the fit asks of numbers that data sheets and literature speak of: its price."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from actuators.energy.energy import loss_energies
from actuators.loading.build import Catalog
from actuators.units import from_si
from pipeline.paper.calibration.machine import PUBLISHED_LEG, ActuatorPart
from pipeline.paper.calibration.prior import Prior
from pipeline.paper.constants.data_sheet import data_sheet, no_load_current
from pipeline.paper.constants.motor_constants import ROTOR_FRICTION, TORQUE_CONSTANT

ROTOR_VISCOUS = "rotor_re40.viscous"
GEAR_FRICTION = "planetary.coulomb"
GEAR_ELEMENT = "planetary_friction"
ALTERNATIVE = "irreversible"
#: Actuators of whose numbers it speaks.
PRICED = ("rotor", ALTERNATIVE)
#: A no-load current above the data sheet's by more than this is called out.
NOTABLE = 1.3


@dataclass(frozen=True)
class Price:
    """What "almost 15" and "4 times" cost.

    Attributes:
        gear_friction: Coulomb friction of the planetary gear [mN*m].
        gear_prior: Centre of what gear data say of it [mN*m].
        gear_interval: Their 95 % belief [mN*m].
        gear_known: 95 % of the posterior of it [mN*m]; NaN without.
        gear_heat: What it dissipates in the middle right leg in one cycle [J].
        leg_energy: What that leg draws in one cycle with the irreversible actuator [J].
        no_load: No-load current of the motor [A].
        no_load_sheet: The data sheet's [A].
        no_load_share: Share of the posterior above `NOTABLE` times the data sheet's; NaN without.
    """

    gear_friction: float
    gear_prior: float
    gear_interval: tuple[float, float]
    gear_known: tuple[float, float]
    gear_heat: float
    leg_energy: float
    no_load: float
    no_load_sheet: float
    no_load_share: float


def price(
    actuators: ActuatorPart, catalog: Catalog, prior: Prior, results: Mapping[str, Any] | None
) -> Price:
    """The price at the numbers as they stand.

    Args:
        actuators: The middle legs' walk with these numbers.
        catalog: The actuators.
        prior: What was known before.
        results: The stored calibration; None where it belongs to other numbers.
    """
    gear = next(free for free in prior.free if free.key == GEAR_FRICTION)
    walking = actuators.walking[ALTERNATIVE]
    heat = loss_energies(walking).get(GEAR_ELEMENT, np.zeros(len(walking.joint.joints)))
    own = [j for j, name in enumerate(walking.joint.joints) if name.startswith(PUBLISHED_LEG)]
    limit = NOTABLE * data_sheet()["no_load_current"]
    share, known = math.nan, (math.nan, math.nan)
    if results is not None:
        own_gear = results["posterior"]["numbers"][GEAR_FRICTION]
        ends = (gear.value(own_gear["low"]), gear.value(own_gear["high"]))
        known = (from_si(ends[0], gear.unit), from_si(ends[1], gear.unit))
        viscous = prior.keys.index(ROTOR_VISCOUS)
        currents = [
            no_load_current(
                m["constants"][TORQUE_CONSTANT],
                m["constants"][ROTOR_FRICTION],
                prior.free[viscous].value(m["z"][viscous]),
            )
            for m in results["sets"]
        ]
        share = float(np.mean(np.array(currents) > limit))
    values = [catalog.parameter(key).value for key in (ROTOR_FRICTION, ROTOR_VISCOUS)]
    return Price(
        from_si(catalog.parameter(GEAR_FRICTION).value, gear.unit),
        from_si(gear.centre, gear.unit),
        (from_si(gear.interval[0], gear.unit), from_si(gear.interval[1], gear.unit)),
        known,
        float(heat[own].sum()),
        actuators.energy[ALTERNATIVE][PUBLISHED_LEG],
        no_load_current(catalog.parameter(TORQUE_CONSTANT).value, *values),
        data_sheet()["no_load_current"],
        share,
    )
