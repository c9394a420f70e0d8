"""A torque over the position of a joint that has no law in the catalogue, as a curve."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Final

from actuators.elements.position_torque import PositionCurve
from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.effects.flexible.knots import place_knots
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel

_PLACES: Final = range(1, 10)


class PositionCurveEffect(Effect):
    """Torque over position that the actuator has to supply in addition: cable, spring, cogging."""

    name = "position_curve"
    additive = True
    parameters: ClassVar = (
        *(Parameter(f"place_{k}", "rad", -1e4, 1e4) for k in _PLACES),
        *(Parameter(f"level_{k}", "N*m", -1e4, 1e4) for k in _PLACES),
    )
    coordinates: ClassVar = tuple(
        Coordinate(f"level_{k}", 1e-2, signed=True, required=False) for k in _PLACES
    )
    has_law: ClassVar = False
    fixed: ClassVar = tuple(f"place_{k}" for k in _PLACES)
    signature = "position"
    excitation = "turns slowly through the whole travel, in both directions"

    def shapes(self, model: MachineModel, m: Measurement, place: Place) -> list[dict[str, float]]:
        """Knots over the travel."""
        places = place_knots(m, m.joints.index(place[0]), len(_PLACES))
        return [{f"place_{k}": x for k, x in zip(_PLACES, places, strict=True)}] if places else []

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Add it at the joint."""
        actuator = model.actuator(place[0])
        law = PositionCurve(
            self.name,
            tuple(shape[f"place_{k}"] for k in _PLACES),
            tuple(x[f"level_{k}"] for k in _PLACES),
        )
        laws = (*actuator.position_torques, law)
        return model.with_actuator(replace(actuator, position_torques=laws))
