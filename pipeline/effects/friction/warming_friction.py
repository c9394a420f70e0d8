"""Friction that falls as a gear warms."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from actuators.elements.warming import ZERO_CELSIUS, Warming
from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel

#: Change of a temperature from which friction can follow it: above a sensor's steps [K].
_LEAST = 3.0


class WarmingFriction(Effect):
    """Dry and viscous friction that a joint loses per kelvin; a log with temperatures shows it."""

    name = "warming_friction"
    parameters: ClassVar = (
        Parameter("coulomb", "N*m/K", 0.0, 1e2),
        Parameter("viscous", "N*m*s/(rad*K)", 0.0, 1e2),
        Parameter("reference", "K", 100.0, 1000.0),
    )
    coordinates: ClassVar = (
        Coordinate("coulomb", 1e-3, required=False),
        Coordinate("viscous", 1e-3, required=False),
    )
    signature = "time"
    excitation = "repeats its first motion, both ways at several speeds, once the gears are warm"
    additive = True
    fixed: ClassVar = ("reference",)

    def places(self, model: MachineModel, m: Measurement) -> list[Place]:
        """Joints whose temperature is measured."""
        return [] if m.temperature is None else super().places(model, m)

    def shapes(self, model: MachineModel, m: Measurement, place: Place) -> list[dict[str, float]]:
        """The mean temperature of the first log: what falls is counted from there."""
        assert m.temperature is not None
        return [{"reference": float(np.mean(_kelvin(m, place)))}]

    def shown(self, m: Measurement, place: Place, shape: Values) -> bool:
        """Whether the temperature leaves the reference by more than a sensor's steps."""
        if m.temperature is None or place[0] not in m.joints:
            return False
        return bool(np.max(np.abs(_kelvin(m, place) - shape["reference"])) >= _LEAST)

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Let the joint's friction fall."""
        warming = Warming(**self.physical(x, shape))
        return model.with_actuator(replace(model.actuator(place[0]), warming=warming))


def _kelvin(m: Measurement, place: Place) -> np.ndarray:
    assert m.temperature is not None
    return m.temperature[:, m.joints.index(place[0])] + ZERO_CELSIUS
