"""Friction in proportion to the speed."""

from __future__ import annotations

from typing import ClassVar

from actuators.elements.friction import Friction
from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.machine.machine import MachineModel


class ViscousFriction(Effect):
    """Friction of grease and bearings that grows with the speed."""

    name = "viscous_friction"
    parameters: ClassVar = (Parameter("coefficient", "N*m*s/rad", 0.0, 1e3),)
    coordinates: ClassVar = (Coordinate("coefficient", 1e-2),)
    excitation = "moves at clearly different speeds, the fastest near the limit"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert friction at the joint's shaft."""
        element = Friction(name=self.name, viscous=x["coefficient"])
        return model.with_actuator(model.actuator(place[0]).with_element(element))
