"""Dry friction that differs with the sign of the velocity."""

from __future__ import annotations

from typing import ClassVar

from actuators.elements.directional import DirectionalFriction
from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.machine.machine import MachineModel


class DirectionDependentFriction(Effect):
    """Coulomb friction with a level for each direction.

    Note:
        In motion it is Coulomb friction with a constant offset.
    """

    name = "direction_dependent_friction"
    parameters: ClassVar = (
        Parameter("positive", "N*m", 0.0, 1e3),
        Parameter("negative", "N*m", 0.0, 1e3),
    )
    coordinates: ClassVar = (
        Coordinate("positive", 1e-2, required=False),
        Coordinate("negative", 1e-2, required=False),
    )
    excitation = "moves in both directions, with stops in between"
    contains: ClassVar = ("coulomb_friction",)

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert friction at the joint's shaft."""
        element = DirectionalFriction(
            name=self.name, positive=x["positive"], negative=x["negative"]
        )
        return model.with_actuator(model.actuator(place[0]).with_element(element))
