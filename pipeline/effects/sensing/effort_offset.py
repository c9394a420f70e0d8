"""A sensor of torque, current or voltage whose zero is off."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.machine.machine import MachineModel


class EffortOffset(Effect):
    """A constant added by the effort sensor."""

    name = "effort_offset"
    additive = True
    parameters: ClassVar = (Parameter("offset", "channel", -1e4, 1e4),)
    coordinates: ClassVar = (Coordinate("offset", 1e-3, signed=True),)
    signature = "time"
    kinds_absorbed: ClassVar = ("effort_zero",)
    excitation = "stands still without load, then moves both ways"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Shift the sensor's zero."""
        actuator = model.actuator(place[0])
        offset = actuator.effort_offset + x["offset"]
        return model.with_actuator(replace(actuator, effort_offset=offset))
