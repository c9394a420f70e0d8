"""Dry friction that falls from break-away to Coulomb level with speed (Stribeck)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from actuators.elements.friction import Friction
from actuators.elements.stribeck import Stribeck
from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel

_SPEEDS = (0.012, 0.025, 0.05, 0.1, 0.2, 0.4)  # [rad/s]


_LARGEST = 0.5  # [rad/s]


class StribeckFriction(Effect):
    """Coulomb friction with an excess near standstill."""

    name = "stribeck_friction"
    parameters: ClassVar = (
        Parameter("coulomb", "N*m", 0.0, 1e3),
        Parameter("excess", "N*m", 0.0, 1e3),
        Parameter("velocity", "rad/s", 1e-4, 1e2),
    )
    coordinates: ClassVar = (
        Coordinate("coulomb", 1e-2, required=False),
        Coordinate("excess", 1e-2),
    )
    excitation = "slow passages through many speeds below the Stribeck speed"
    contains: ClassVar = ("coulomb_friction",)

    def shapes(self, model: MachineModel, m: Measurement, place: Place) -> list[dict[str, float]]:
        """Stribeck speeds above where friction changes sign and below the fastest motion."""
        k = model.index(place[0])
        fastest = float(np.quantile(np.abs(m.v[:, k]), 0.98))
        slowest = 1.5 * float(m.rest_speed[k])
        speeds = [s for s in _SPEEDS if slowest <= s <= 0.6 * fastest]
        return [{"velocity": s} for s in speeds]

    def plausible(self, model: MachineModel, place: Place, x: Values, shape: Values) -> bool:
        """Slow enough to be a Stribeck speed."""
        return super().plausible(model, place, x, shape) and shape["velocity"] < _LARGEST

    def refined(self, shape: Values, factor: float) -> list[dict[str, float]]:
        """Speeds to either side."""
        return [{"velocity": shape["velocity"] * 2.0**e} for e in (-factor, factor)]

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert both at the joint's shaft."""
        excess = Stribeck(name=self.name, excess=x["excess"], speed=shape["velocity"])
        level = Friction(name=f"{self.name}_level", coulomb=x["coulomb"])
        actuator = model.actuator(place[0]).with_element(excess).with_element(level)
        return model.with_actuator(actuator)
