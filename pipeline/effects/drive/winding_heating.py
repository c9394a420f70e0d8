"""Windings that warm up: resistance rises, torque constant falls."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from actuators.elements.heating import Heating
from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel

_TIMES = (1.5, 4.0, 10.0, 30.0)  # [s]
_HOTTEST = 150.0  # above or below what the data sheet's values hold for [K]; insulation gives way


class WindingHeating(Effect):
    """One thermal node per motor, warmed by R I^2 and by what surrounds it."""

    name = "winding_heating"
    parameters: ClassVar = (
        Parameter("rise", "K", -_HOTTEST, _HOTTEST),
        Parameter("thermal_resistance", "K/W", 0.0, 1e3),
        Parameter("time_constant", "s", 0.01, 1e5),
        Parameter("sensor_gain", "1", 0.0, 30.0, optional=True),
    )
    coordinates: ClassVar[tuple[Coordinate, ...]] = (
        Coordinate("rise", 1.0, signed=True, required=False),
        Coordinate("thermal_resistance", 0.5, required=False),
    )
    signature = "time"
    excitation = "works hard for several thermal time constants, then repeats its first motion"

    def places(self, model: MachineModel, m: Measurement) -> list[Place]:
        """Joints with a motor, where an electrical channel is measured."""
        return [] if m.temperature is not None else _places(model, m)

    def shapes(self, model: MachineModel, m: Measurement, place: Place) -> list[dict[str, float]]:
        """Time constants that a log of this length can show."""
        length = float(m.time[-1] - m.time[0])
        return [{"time_constant": t} for t in _TIMES if t < 1.5 * length]

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Give the motor a thermal node."""
        return model.with_actuator(
            replace(model.actuator(place[0]), heating=Heating(**self.physical(x, shape)))
        )

    def physical(self, x: Values, shape: Values) -> dict[str, float]:
        """Of the node."""
        return {"rise": 0.0, "thermal_resistance": 0.0, **x, **shape}


class SensedHeating(WindingHeating):
    """The same where a sensor on the motor's housing is read: it shows what warmed it before."""

    coordinates: ClassVar[tuple[Coordinate, ...]] = (
        Coordinate("sensor_gain", 0.1, required=False),
        Coordinate("thermal_resistance", 0.5, required=False),
    )

    def places(self, model: MachineModel, m: Measurement) -> list[Place]:
        """Joints with a motor whose temperature and an electrical channel are measured."""
        return _places(model, m) if m.temperature is not None else []


def _places(model: MachineModel, m: Measurement) -> list[Place]:
    if "torque" in m.channels:
        return []
    return [(a.name,) for a in model.actuators if a.motor is not None and a.heating is None]
