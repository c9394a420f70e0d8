"""A spring beside the motor, from one link to the next."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from actuators.elements.position_torque import ParallelSpring as Spring
from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.machine.machine import MachineModel


class ParallelSpring(Effect):
    """Torque in proportion to the distance from a rest position."""

    name = "parallel_spring"
    additive = True
    parameters: ClassVar = (
        Parameter("stiffness", "N*m/rad", -1e4, 1e4),
        Parameter("rest", "rad", -1e3, 1e3),
    )
    coordinates: ClassVar = (
        Coordinate("stiffness", 1e-2, signed=True),
        Coordinate("preload", 1e-2, signed=True, required=False),
    )
    signature = "position"
    excitation = "holds many positions over the whole travel, in several postures of the others"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Add it at the joint; the preload is its torque at position zero."""
        actuator = model.actuator(place[0])
        stiffness = x["stiffness"] if abs(x["stiffness"]) > 1e-9 else 1e-9
        law = Spring(self.name, stiffness, -x["preload"] / stiffness)
        laws = (*actuator.position_torques, law)
        return model.with_actuator(replace(actuator, position_torques=laws))

    def physical(self, x: Values, shape: Values) -> dict[str, float]:
        """Stiffness and rest."""
        stiffness = x["stiffness"] if abs(x["stiffness"]) > 1e-9 else 1e-9
        return {"stiffness": stiffness, "rest": -x["preload"] / stiffness}

    def internal(self, values: Values) -> tuple[dict[str, float], dict[str, float]]:
        """Stiffness and preload."""
        k = values["stiffness"]
        return {"stiffness": k, "preload": -k * values["rest"]}, {}
