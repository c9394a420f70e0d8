"""Hidden errors of the measurement: biased current, displaced encoder, late channel."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from pipeline.blind.twin.effects.base import (
    Effect,
    Hidden,
    Units,
    any_joint,
    column,
    raised,
    sized,
)
from pipeline.blind.twin.reference import Reference, rms
from pipeline.blind.twin.setup import Setup


class EffortOffset(Effect):
    """A current sensor whose zero has drifted."""

    name = "effort_offset"
    units: ClassVar[Units] = {"current": "A"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint."""
        j = any_joint(rng, ref)
        machine = ref.setup.plant.machine
        size, torque = sized(torque, machine.ratio * machine.torque_constant, 0.004, 0.4)
        return self.hidden((ref.joints[j],), torque, current=size * rng.choice([-1.0, 1.0]))

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Shift the sensor's zero."""
        j = column(setup, hidden.place[0])
        offset = raised(setup.sensors.current_offset, j, hidden.parameters["current"])
        return replace(setup, sensors=replace(setup.sensors, current_offset=offset))


class PositionOffset(Effect):
    """A joint encoder mounted at a wrong angle; the controller's own encoder is right."""

    name = "position_offset"
    units: ClassVar[Units] = {"angle": "rad"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint; 10 to 200 mrad, above the tolerance."""
        j = any_joint(rng, ref)
        trial = 2e-3  # [rad]
        shift = raised(np.zeros(len(ref.joints)), j, trial)
        per_radian = ref.change(ref.setup.plant, shift) / trial
        size, torque = sized(torque, per_radian, 0.01, 0.2)
        return self.hidden((ref.joints[j],), torque, angle=size * rng.choice([-1.0, 1.0]))

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Shift the encoder's zero."""
        j = column(setup, hidden.place[0])
        offset = raised(setup.sensors.position_offset, j, hidden.parameters["angle"])
        return replace(setup, sensors=replace(setup.sensors, position_offset=offset))


class TimeDelay(Effect):
    """Effort channels that arrive later than the positions."""

    name = "time_delay"
    units: ClassVar[Units] = {"delay": "s"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """All joints alike; 1 to 30 ms in steps of the simulation."""
        per_second = float(np.median(rms(ref.rate_of(ref.motor_torque))))
        size, torque = sized(torque, per_second, 1e-3, 3e-2)
        return self.hidden(("effort channels",), torque, delay=round(size, 3))

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Read the effort channels late."""
        delay = hidden.parameters["delay"]
        return replace(setup, sensors=replace(setup.sensors, delay=delay))
