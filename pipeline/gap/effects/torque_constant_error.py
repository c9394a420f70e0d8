"""A motor whose torque constant is not its data sheet's."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from pipeline.gap.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.gap.errors import EffectError
from pipeline.gap.measurement import Measurement
from pipeline.gap.model import MachineModel

CONSTANT_TOLERANCE = 0.02  # one standard deviation [1]


class TorqueConstantError(Effect):
    """Torque per current, and voltage per speed, off by a factor."""

    name = "torque_constant_error"
    parameters: ClassVar = (Parameter("relative", "1", -0.8, 2.0),)
    coordinates: ClassVar = (Coordinate("relative", 1e-3, signed=True),)
    signature = "load"
    is_tolerance = True
    excitation = "carries clearly different known loads"

    def places(self, model: MachineModel, m: Measurement) -> list[Place]:
        """Joints with a motor, where the torque itself is not sensed."""
        if "torque" in m.channels:
            return []
        return [(a.name,) for a in model.actuators if a.motor is not None]

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Scale it."""
        actuator = model.actuator(place[0])
        if actuator.motor is None:
            raise EffectError(f"{self.name}: joint '{place[0]}' has no motor in the model")
        constant = np.asarray(actuator.motor.torque_constant) * (1.0 + x["relative"])
        motor = replace(actuator.motor, torque_constant=float(constant))
        return model.with_actuator(replace(actuator, motor=motor))

    def absorbs(self, place: Place) -> tuple[tuple[str, str], ...]:
        """The constant's tolerance."""
        return (("torque_constant", place[0]),)

    def tolerance(self, model: MachineModel, place: Place) -> dict[str, float]:
        """Two per cent, or what the motor's file states where that is more."""
        motor = model.actuator(place[0]).motor
        stated = 0.0 if motor is None else motor.torque_constant_spread
        return {"relative": max(CONSTANT_TOLERANCE, stated)}
