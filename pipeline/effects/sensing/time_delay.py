"""Effort channels that lag behind the positions."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel

#: Skew between channels that sampling leaves, one standard deviation [s].
SKEW_TOLERANCE = 3e-4


#: Place of a delay that all joints share.
ALL: Place = ("effort channels",)


class TimeDelay(Effect):
    """One delay between position and effort, of all joints alike or of one joint.

    Only one of all joints competes by itself; a joint's own comes of a machine fitted as a whole.
    """

    name = "time_delay"
    place_kind = "effort channels"
    parameters: ClassVar = (Parameter("delay", "s", -0.5, 0.5),)
    coordinates: ClassVar = (Coordinate("delay", 2e-4, signed=True),)
    signature = "effort rate"
    reaches: ClassVar = (1.0, 20.0, 60.0, 150.0)
    excitation = "changes its torque fast: accelerates, brakes and reverses"

    def places(self, model: MachineModel, m: Measurement) -> list[Place]:
        """All effort channels."""
        return [ALL]

    def absorbs(self, place: Place) -> tuple[tuple[str, str], ...]:
        """The skew of the channels."""
        return (("skew", ""),)

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Delay them further, or one joint's alone."""
        if place != ALL:
            model.index(place[0])  # refuses a joint that is not there
        changed = tuple(
            replace(a, delay=a.delay + x["delay"]) if place in (ALL, (a.name,)) else a
            for a in model.actuators
        )
        return replace(model, actuators=changed)
