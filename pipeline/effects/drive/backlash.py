"""Backlash between motor and joint."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel

_SHARES = (0.02, 0.1, 0.3, 1.0)  # of the joint's torque, at which a flank may be seated


class Backlash(Effect):
    """Motor and joint lie half the width apart, on the side of the flank that carries.

    The motor leads by width / 2 tanh(torque / crossing) + torque / stiffness: a describing
    function of backlash with seated flanks (Nordin and Gutman, Automatica 38, 2002, treat backlash
    with elastic flanks). Below the crossing torque the joint floats between the flanks, where its
    place does not follow from the torque alone; the flanks give, and their stiffness comes with the
    width.
    """

    name = "backlash"
    parameters: ClassVar = (
        Parameter("width", "rad", 0.0, 1.0),
        Parameter("stiffness", "N*m/rad", 1.0, 1e12),
        Parameter("crossing", "N*m", 0.0, 1e4),
    )
    coordinates: ClassVar = (
        Coordinate("width", 1e-5),
        Coordinate("compliance", 1e-6, required=False),
    )
    signature = "load"
    kinds_absorbed: ClassVar = ("compliance",)
    excitation = "lets the torque change its sign often, slowly and fast"
    contains: ClassVar = ("joint_elasticity",)

    def shapes(self, model: MachineModel, m: Measurement, place: Place) -> list[dict[str, float]]:
        """Crossing torques, as shares of what the joint's actuator gives on the whole."""
        scale = _torque_scale(model, m, place[0])
        return [{"crossing": share * scale} for share in _SHARES]

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Widen what is there."""
        actuator = model.actuator(place[0])
        changed = replace(
            actuator,
            backlash=actuator.backlash + x["width"],
            compliance=actuator.compliance + x["compliance"],
            crossing=shape["crossing"],
        )
        return model.with_actuator(changed)

    def physical(self, x: Values, shape: Values) -> dict[str, float]:
        """Width, stiffness and crossing torque."""
        stiffness = 1.0 / max(x["compliance"], 1e-12)
        return {"width": x["width"], "stiffness": stiffness, "crossing": shape["crossing"]}

    def internal(self, values: Values) -> tuple[dict[str, float], dict[str, float]]:
        """Width, compliance and crossing torque."""
        x = {"width": values["width"], "compliance": 1.0 / values["stiffness"]}
        return x, {"crossing": values["crossing"]}


def _torque_scale(model: MachineModel, m: Measurement, joint: str) -> float:
    """RMS torque of a joint's actuator by the measured channel, transmission without loss [N*m]."""
    actuator = model.actuator(joint)
    channel, rows = m.channels[0], m.effort[m.has_say, model.index(joint), 0]
    size = float(np.sqrt(np.nanmean(rows**2)))
    if channel == "torque" or actuator.motor is None:
        return max(size, 1e-9)
    constant = float(np.asarray(actuator.motor.torque_constant))
    resistance = float(np.asarray(actuator.motor.resistance))
    current = {"current": size, "voltage": size / resistance}.get(
        channel, float(np.sqrt(size / resistance))
    )
    return max(abs(actuator.ratio) * constant * current, 1e-9)
