"""An encoder whose zero is off."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.machine.machine import MachineModel

ENCODER_TOLERANCE = 2.5e-3  # one standard deviation [rad]


class PositionOffset(Effect):
    """A constant added by the position sensor."""

    name = "position_offset"
    parameters: ClassVar = (Parameter("angle", "rad", -1.6, 1.6),)
    coordinates: ClassVar = (Coordinate("angle", 1e-3, signed=True),)
    signature = "position"
    kinds_absorbed: ClassVar = ("encoder",)
    excitation = "holds the link in postures all around its axis"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Shift the sensor's zero."""
        actuator = model.actuator(place[0])
        offset = actuator.encoder_offset + x["angle"]
        return model.with_actuator(replace(actuator, encoder_offset=offset))
