"""Friction in proportion to the transmitted torque (Eq. 5 and 6 of the paper)."""

from __future__ import annotations

from typing import ClassVar

from actuators.elements.friction import Friction
from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.machine.machine import MachineModel


class LoadDependentFriction(Effect):
    """Friction of loaded teeth, alike where the motor drives and where it is driven."""

    name = "load_dependent_friction"
    parameters: ClassVar = (Parameter("share", "1", 0.0, 0.99),)
    coordinates: ClassVar = (Coordinate("share", 1e-3),)
    signature = "load"
    excitation = "moves at one speed under clearly different loads, both ways"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert friction at the joint's shaft."""
        element = Friction(name=self.name, load=x["share"])
        return model.with_actuator(model.actuator(place[0]).with_element(element))
