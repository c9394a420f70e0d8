"""Inertia of the rotor and of what turns with it, beyond the data sheet."""

from __future__ import annotations

from typing import ClassVar

from actuators.elements.inertia import Inertia
from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.machine.machine import MachineModel


class RotorInertia(Effect):
    """Inertia added at the motor's shaft (at the joint's, where there is no gear)."""

    name = "rotor_inertia"
    additive = True
    parameters: ClassVar = (Parameter("added", "kg*m^2", 0.0, 1e3),)
    coordinates: ClassVar = (Coordinate("added", 1e-7),)
    signature = "acceleration"
    excitation = "accelerates hard on an axis whose load does not change"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert it at the motor."""
        element = Inertia(name=self.name, inertia=x["added"])
        actuator = model.actuator(place[0]).with_element(element, at_motor=True)
        return model.with_actuator(actuator)
