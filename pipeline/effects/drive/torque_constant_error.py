"""A motor whose torque constant is not its data sheet's."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.logs.errors import EffectError
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel

CONSTANT_TOLERANCE = 0.02  # one standard deviation [1]


class TorqueConstantError(Effect):
    """Torque per current, and voltage per speed, off by a factor.

    Fitted as the factor more of current (x > 0: k / (1 + x)) or of back-EMF (x < 0: k (1 - x)), in
    which the larger one is linear: a factor of five is found in one step. Where current alone is
    measured, a current sensor's wrong gain is the same and goes by this name.
    """

    name = "torque_constant_error"
    parameters: ClassVar = (Parameter("relative", "1", -0.99, 99.0),)
    coordinates: ClassVar = (Coordinate("more", 1e-3, signed=True),)
    signature = "load"
    rescales = True
    kinds_absorbed: ClassVar = ("torque_constant",)
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
        more = self.physical(x, shape)["relative"]
        constant = np.asarray(actuator.motor.torque_constant) * (1.0 + more)
        motor = replace(actuator.motor, torque_constant=float(constant))
        return model.with_actuator(replace(actuator, motor=motor))

    def physical(self, x: Values, shape: Values) -> dict[str, float]:
        """How much larger than stated, as a share."""
        more = x["more"]
        return {"relative": 1.0 / (1.0 + more) - 1.0 if more > 0.0 else -more}

    def internal(self, values: Values) -> tuple[dict[str, float], dict[str, float]]:
        """How much more current, or less than nothing: how much more back-EMF."""
        relative = float(values["relative"])
        return {"more": -relative / (1.0 + relative) if relative < 0.0 else -relative}, {}
