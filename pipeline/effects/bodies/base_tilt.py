"""Ground, or a stand, that is not level."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel


class BaseTilt(Effect):
    """Gravity that does not point along the ground's normal."""

    name = "base_tilt"
    additive = True
    place_kind = "ground"
    parameters: ClassVar = (
        Parameter("roll", "rad", -0.6, 0.6),
        Parameter("pitch", "rad", -0.6, 0.6),
    )
    coordinates: ClassVar = tuple(
        Coordinate(axis, 1e-3, signed=True, required=False) for axis in ("roll", "pitch")
    )
    signature = "position"
    excitation = "holds links outstretched in several directions"

    def places(self, model: MachineModel, m: Measurement) -> list[Place]:
        """The ground."""
        return [("ground",)]

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Tilt it further."""
        roll, pitch = model.bodies.tilt
        return model.with_bodies(replace(model.bodies, tilt=(roll + x["roll"], pitch + x["pitch"])))
