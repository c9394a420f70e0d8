"""Torque periodic in the angle: error of a gear, cogging of a motor."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.elements.position_torque import Ripple
from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel

_LEAST_ORDER = 4.0  # periods per turn; below it is a spring rather than a ripple
_PERIODS = 1.5  # least number of periods inside the travel


class TorqueRipple(Effect):
    """A sine of the joint's angle that the drive puts into the joint; its order is found.

    The torque amplitude sin(order position + phase) acts on the joint in its positive sense: the
    actuator has to supply so much less.
    """

    name = "torque_ripple"
    additive = True
    parameters: ClassVar = (
        Parameter("amplitude", "N*m", 0.0, 1e3),
        Parameter("order", "1", 0.0, 1e6),
        Parameter("phase", "rad", -10.0, 10.0),
    )
    coordinates: ClassVar = (
        Coordinate("sine", 1e-2, signed=True, required=False),
        Coordinate("cosine", 1e-2, signed=True, required=False),
    )
    signature = "position"
    excitation = "turns slowly and evenly through the whole travel"

    def orders(self, m: Measurement, joint: int) -> Array:
        """Orders that this motion can show, so dense that none lies between two."""
        q, v = m.q[:, joint], m.v[:, joint]
        travel = float(np.ptp(q))
        speed = float(np.quantile(np.abs(v), 0.3)) + float(m.rest_speed[joint])
        if travel < 1e-3:
            return np.empty(0)
        top = min(2 * np.pi * 0.6 * m.bandwidth / speed, 2000.0)
        low = max(_LEAST_ORDER, _PERIODS * 2 * np.pi / travel)
        return np.arange(low, max(top, low), 0.35 * 2 * np.pi / travel)

    def strongest(
        self, m: Measurement, joint: int, rows: slice | NDArray[np.intp], series: Array, count: int
    ) -> list[dict[str, float]]:
        """Orders of the joint's angle that a series (R,) on some rows holds most of."""
        orders, q = self.orders(m, joint), m.q[rows, joint]
        power = np.array([abs(np.exp(-1j * order * q) @ series) for order in orders])
        return [{"order": float(orders[k])} for k in np.argsort(power)[::-1][:count]]

    def shown(self, m: Measurement, place: Place, shape: Values) -> bool:
        """Whether it repeats inside the travel: else it is any function of the position."""
        travel = float(np.ptp(m.q[:, m.joints.index(place[0])]))
        return shape["order"] >= max(_LEAST_ORDER, _PERIODS * 2 * np.pi / max(travel, 1e-9))

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Add it at the joint."""
        p = self.physical(x, shape)
        actuator = model.actuator(place[0])
        law = Ripple(self.name, -p["amplitude"], p["order"], p["phase"])
        laws = (*actuator.position_torques, law)
        return model.with_actuator(replace(actuator, position_torques=laws))

    def physical(self, x: Values, shape: Values) -> dict[str, float]:
        """Amplitude and phase."""
        return {
            "amplitude": float(np.hypot(x["sine"], x["cosine"])),
            "order": shape["order"],
            "phase": float(np.arctan2(x["cosine"], x["sine"])),
        }

    def internal(self, values: Values) -> tuple[dict[str, float], dict[str, float]]:
        """Sine and cosine."""
        a, phase = values["amplitude"], values["phase"]
        return {"sine": a * np.cos(phase), "cosine": a * np.sin(phase)}, {"order": values["order"]}
