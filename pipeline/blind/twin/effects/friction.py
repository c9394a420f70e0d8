"""Hidden friction at a joint, by the bristle law."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from pipeline.blind.twin.effects.base import Effect, Hidden, Units, any_joint, column, raised, sized
from pipeline.blind.twin.reference import Reference, rms
from pipeline.blind.twin.setup import Setup


def _with_gear(setup: Setup, hidden: Hidden, **added: float) -> Setup:
    """Raise parameters of the bristle law at the joint."""
    j = column(setup, hidden.place[0])
    law = setup.plant.gear
    changed: dict[str, Any] = {
        name: raised(getattr(law, name), j, by) for name, by in added.items()
    }
    return replace(setup, plant=replace(setup.plant, gear=replace(law, **changed)))


class CoulombFriction(Effect):
    """Dry friction at the joint."""

    name = "coulomb_friction"
    units: ClassVar[Units] = {"torque": "N*m"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint."""
        j = any_joint(rng, ref)
        share = float(rms(np.sign(ref.velocity[:, j])))
        size, torque = sized(torque, share, 0.02, 8.0)
        return self.hidden((ref.joints[j],), torque, torque=size)

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Raise Fc."""
        return _with_gear(setup, hidden, coulomb=hidden.parameters["torque"])


class ViscousFriction(Effect):
    """Friction in proportion to the joint's velocity."""

    name = "viscous_friction"
    units: ClassVar[Units] = {"coefficient": "N*m*s/rad"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint."""
        j = any_joint(rng, ref)
        size, torque = sized(torque, float(rms(ref.velocity[:, j])), 0.05, 15.0)
        return self.hidden((ref.joints[j],), torque, coefficient=size)

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Raise s2."""
        return _with_gear(setup, hidden, viscous=hidden.parameters["coefficient"])


class StribeckFriction(Effect):
    """Dry friction that falls from break-away to Coulomb level as the joint speeds up."""

    name = "stribeck_friction"
    units: ClassVar[Units] = {"coulomb": "N*m", "excess": "N*m", "velocity": "rad/s"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint; the excess alone is sized, the Coulomb part is of its order."""
        j = any_joint(rng, ref)
        w = ref.velocity[:, j]
        velocity = float(np.exp(rng.uniform(np.log(0.03), np.log(0.2))))
        moving = np.exp(-((w / velocity) ** 2)) * (np.abs(w) > 1e-6)
        size, torque = sized(torque, float(rms(moving)), 0.05, 6.0)
        coulomb = size * rng.uniform(0.4, 1.2)
        return self.hidden(
            (ref.joints[j],), torque, coulomb=coulomb, excess=size, velocity=velocity
        )

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Raise Fc and Fs - Fc, set ws."""
        p = hidden.parameters
        setup = _with_gear(setup, hidden, coulomb=p["coulomb"], excess=p["excess"])
        velocity = setup.plant.gear.stribeck_velocity.copy()
        velocity[column(setup, hidden.place[0])] = p["velocity"]
        gear = replace(setup.plant.gear, stribeck_velocity=velocity)
        return replace(setup, plant=replace(setup.plant, gear=gear))


class LoadDependentFriction(Effect):
    """Dry friction in proportion to the transmitted torque."""

    name = "load_dependent_friction"
    units: ClassVar[Units] = {"share": "1"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint."""
        j = any_joint(rng, ref)
        size, torque = sized(torque, float(rms(ref.torque[:, j])), 0.01, 0.35)
        return self.hidden((ref.joints[j],), torque, share=size)

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """The same share driving and driven."""
        share = hidden.parameters["share"]
        return _with_gear(setup, hidden, load_driving=share, load_driven=share)


class DirectionDependentFriction(Effect):
    """Dry friction that differs with the sign of the velocity."""

    name = "direction_dependent_friction"
    units: ClassVar[Units] = {"positive": "N*m", "negative": "N*m"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint; the weaker direction has 10 to 60 % of the stronger one's."""
        j = any_joint(rng, ref)
        share = float(rms(np.sign(ref.velocity[:, j])))
        mean, torque = sized(torque, share, 0.03, 6.0)
        weaker = rng.uniform(0.1, 0.6)
        strong = 2 * mean / (1 + weaker)
        pair = [strong, weaker * strong]
        if rng.random() < 0.5:
            pair.reverse()
        return self.hidden((ref.joints[j],), torque, positive=pair[0], negative=pair[1])

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Mean into Fc, half the difference into the asymmetry."""
        p = hidden.parameters
        return _with_gear(
            setup,
            hidden,
            coulomb=0.5 * (p["positive"] + p["negative"]),
            asymmetry=0.5 * (p["positive"] - p["negative"]),
        )


class BackdriveLoss(Effect):
    """Load friction that differs between driving and being driven."""

    name = "backdrive_loss"
    units: ClassVar[Units] = {"driving": "1", "driven": "1"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint; one quadrant has 0 to 40 % of the other's."""
        j = any_joint(rng, ref)
        size, torque = sized(torque, float(rms(ref.torque[:, j])), 0.03, 0.4)
        pair = [size, size * rng.uniform(0.0, 0.4)]
        if rng.random() < 0.5:
            pair.reverse()
        return self.hidden((ref.joints[j],), torque, driving=pair[0], driven=pair[1])

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Each its own share."""
        p = hidden.parameters
        return _with_gear(setup, hidden, load_driving=p["driving"], load_driven=p["driven"])
