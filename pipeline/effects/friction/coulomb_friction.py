"""Dry friction: constant torque against the motion (Coulomb)."""

from __future__ import annotations

from typing import ClassVar

from actuators.elements.friction import Friction
from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.machine.machine import MachineModel


class CoulombFriction(Effect):
    """Friction that has one level at every speed and load."""

    name = "coulomb_friction"
    parameters: ClassVar = (Parameter("torque", "N*m", 0.0, 1e3),)
    coordinates: ClassVar = (Coordinate("torque", 1e-2),)
    excitation = "moves in both directions at several speeds"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert friction at the joint's shaft."""
        element = Friction(name=self.name, coulomb=x["torque"])
        return model.with_actuator(model.actuator(place[0]).with_element(element))
