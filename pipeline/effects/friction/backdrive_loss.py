"""Load friction that differs between driving a load and being driven by it."""

from __future__ import annotations

from typing import ClassVar

from actuators.elements.quadrant import QuadrantFriction
from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.machine.machine import MachineModel


class BackdriveLoss(Effect):
    """Load friction with a coefficient for each power quadrant."""

    name = "backdrive_loss"
    parameters: ClassVar = (
        Parameter("driving", "1", 0.0, 10.0),
        Parameter("driven", "1", 0.0, 0.99),
    )
    coordinates: ClassVar = (
        Coordinate("driving", 1e-3, required=False),
        Coordinate("driven", 1e-3, required=False),
    )
    signature = "load"
    excitation = "raises and lowers clearly different loads"
    contains: ClassVar = ("load_dependent_friction",)

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert friction at the joint's shaft."""
        element = QuadrantFriction(
            name=self.name, when_driving=x["driving"], when_driven=x["driven"]
        )
        return model.with_actuator(model.actuator(place[0]).with_element(element))
