"""Play between motor and joint."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from pipeline.gap.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.gap.model import MachineModel

#: Play of a gear that counts as free of it, one standard deviation [rad].
PLAY_TOLERANCE = 1e-4


class Backlash(Effect):
    """Motor and joint lie half the width apart, on the side of the flank that carries.

    The flanks give under the torque; their stiffness comes with the width.
    """

    name = "backlash"
    parameters: ClassVar = (
        Parameter("width", "rad", 0.0, 1.0),
        Parameter("stiffness", "N*m/rad", 1.0, 1e12),
    )
    coordinates: ClassVar = (
        Coordinate("width", 1e-5),
        Coordinate("compliance", 1e-6, required=False),
    )
    signature = "load"
    excitation = "lets the torque change its sign often, slowly and fast"
    contains: ClassVar = ("joint_elasticity",)

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Widen what is there."""
        actuator = model.actuator(place[0])
        changed = replace(
            actuator,
            backlash=actuator.backlash + x["width"],
            compliance=actuator.compliance + x["compliance"],
        )
        return model.with_actuator(changed)

    def absorbs(self, place: Place) -> tuple[tuple[str, str], ...]:
        """What counts as rigid."""
        return (("compliance", place[0]),)

    def tolerance(self, model: MachineModel, place: Place) -> dict[str, float]:
        """What a gear without play has."""
        return {"width": PLAY_TOLERANCE}

    def physical(self, x: Values, shape: Values) -> dict[str, float]:
        """Width and stiffness."""
        return {"width": x["width"], "stiffness": 1.0 / max(x["compliance"], 1e-12)}

    def internal(self, values: Values) -> tuple[dict[str, float], dict[str, float]]:
        """Width and compliance."""
        return {"width": values["width"], "compliance": 1.0 / values["stiffness"]}, {}
