"""Effects for which the workflow has no name: it should call them unexplained."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from pipeline.blind.twin.effects.base import Effect, Hidden, Units, any_joint, column, sized
from pipeline.blind.twin.laws.extra import CableDrag, QuadraticDrag, StickingSpot
from pipeline.blind.twin.reference import Reference, rms
from pipeline.blind.twin.setup import Setup


class CableLoom(Effect):
    """A cable along the joint: stiffening spring with hysteresis."""

    name = "cable_loom"
    in_catalogue: ClassVar[bool] = False
    units: ClassVar[Units] = {
        "rest": "rad",
        "cubic": "N*m/rad^3",
        "hysteresis": "N*m",
        "width": "rad",
    }

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint; spring and hysteresis of like size."""
        j = any_joint(rng, ref)
        q = ref.position[:, j]
        rest = float(rng.uniform(*np.quantile(q, [0.1, 0.9])))
        cubic, expected = sized(torque, float(rms((q - rest) ** 3)), 0.2, 2000.0)
        hysteresis = min(expected, 4.0) * rng.uniform(0.5, 1.0)
        width = float(np.ptp(q)) * rng.uniform(0.1, 0.3)
        return self.hidden(
            (ref.joints[j],), expected, rest=rest, cubic=cubic, hysteresis=hysteresis, width=width
        )

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Add it to the joint."""
        law = CableDrag(column(setup, hidden.place[0]), **hidden.parameters)
        return replace(setup, plant=replace(setup.plant, extra=(*setup.plant.extra, law)))


class FluidDrag(Effect):
    """Drag with the square of the velocity."""

    name = "quadratic_drag"
    in_catalogue: ClassVar[bool] = False
    units: ClassVar[Units] = {"coefficient": "N*m*s^2/rad^2"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint."""
        j = any_joint(rng, ref)
        size, torque = sized(torque, float(rms(ref.velocity[:, j] ** 2)), 0.1, 30.0)
        return self.hidden((ref.joints[j],), torque, coefficient=size)

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Add it to the joint."""
        law = QuadraticDrag(column(setup, hidden.place[0]), hidden.parameters["coefficient"])
        return replace(setup, plant=replace(setup.plant, extra=(*setup.plant.extra, law)))


class Sticking(Effect):
    """A dented bearing: a joint that sticks over a short stretch of its travel."""

    name = "sticking_spot"
    in_catalogue: ClassVar[bool] = False
    units: ClassVar[Units] = {"centre": "rad", "width": "rad", "torque": "N*m"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint, at a position that the motion crosses."""
        j = any_joint(rng, ref)
        q = ref.position[:, j]
        centre = float(rng.uniform(*np.quantile(q, [0.2, 0.8])))
        width = float(np.ptp(q)) * rng.uniform(0.03, 0.08)
        felt = np.exp(-0.5 * ((q - centre) / width) ** 2)
        size, expected = sized(torque, float(rms(felt)), 0.1, 6.0)
        return self.hidden((ref.joints[j],), expected, centre=centre, width=width, torque=size)

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Add it to the joint's bristles."""
        law = StickingSpot(column(setup, hidden.place[0]), **hidden.parameters)
        return replace(setup, plant=replace(setup.plant, sticking=(*setup.plant.sticking, law)))


class MagneticSaturation(Effect):
    """A torque constant that falls with the current."""

    name = "magnetic_saturation"
    in_catalogue: ClassVar[bool] = False
    units: ClassVar[Units] = {"half_current": "A"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint; up to a third of the torque at the largest current."""
        j = any_joint(rng, ref)
        machine = ref.setup.plant.machine
        moment = ref.motor_torque[:, j]
        current = moment / (machine.ratio * machine.torque_constant)
        felt = float(rms(moment * current**2))
        largest = 0.5 / float(np.abs(current).max()) ** 2
        size, expected = sized(torque, felt, 1e-6, largest)
        return self.hidden((ref.joints[j],), expected, half_current=size**-0.5)

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Let k_t fall."""
        current = setup.plant.saturation_current.copy()
        current[column(setup, hidden.place[0])] = hidden.parameters["half_current"]
        return replace(setup, plant=replace(setup.plant, saturation_current=current))
