"""A transmission that winds up under its torque."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.machine.machine import MachineModel

#: Wind-up of what a robot file calls rigid, one standard deviation [rad/(N*m)].
COMPLIANCE_TOLERANCE = 1.2e-5


class JointElasticity(Effect):
    """A spring between motor and joint: one turns ahead of the other by torque / stiffness.

    Spong, J. Dyn. Sys. Meas. Control 109, 1987. With the encoder at the joint the motor's speed
    and acceleration follow; with the encoder at the motor the joint's do.
    """

    name = "joint_elasticity"
    parameters: ClassVar = (Parameter("stiffness", "N*m/rad", 1.0, 1e12),)
    coordinates: ClassVar = (Coordinate("compliance", 1e-6),)
    signature = "torque rate"
    reaches: ClassVar = (1.0, 100.0, 600.0)
    kinds_absorbed: ClassVar = ("compliance",)
    excitation = "changes its torque fast: accelerates, brakes and steps hard"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Put it in series with what winds up already."""
        actuator = model.actuator(place[0])
        compliance = actuator.compliance + x["compliance"]
        return model.with_actuator(replace(actuator, compliance=compliance))

    def physical(self, x: Values, shape: Values) -> dict[str, float]:
        """Stiffness."""
        return {"stiffness": 1.0 / max(x["compliance"], 1e-12)}

    def internal(self, values: Values) -> tuple[dict[str, float], dict[str, float]]:
        """Compliance."""
        return {"compliance": 1.0 / values["stiffness"]}, {}
