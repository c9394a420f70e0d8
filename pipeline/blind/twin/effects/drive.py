"""Hidden properties of motor and transmission."""

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
from pipeline.blind.twin.laws.extra import Ripple, Spring
from pipeline.blind.twin.plant import MAGNET, Heating
from pipeline.blind.twin.reference import Reference, rms
from pipeline.blind.twin.setup import Setup

#: Loss time of an elastic transmission: damping over stiffness [s].
_LOSS_TIME = 5e-4
#: Stiffness of the flanks that bound a backlash, a Harmonic Drive of size 17 [N*m/rad].
FLANKS = 1e4
#: Periods per turn of the joint: wave generator once and twice a turn, motor once a turn.
_ORDERS = (50.0, 100.0, 200.0, 400.0)


class RotorInertia(Effect):
    """A rotor with more inertia than its data sheet says: brake, encoder, pulley."""

    name = "rotor_inertia"
    units: ClassVar[Units] = {"added": "kg*m^2"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint; 8 to 80 % more, at the motor's shaft."""
        j = any_joint(rng, ref)
        machine = ref.setup.plant.machine
        per_unit = machine.reflected_inertia * float(rms(ref.acceleration[:, j]))
        size, torque = sized(torque, per_unit, 0.08, 0.8)
        return self.hidden((ref.joints[j],), torque, added=size * machine.rotor_inertia)

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Add it, reflected."""
        plant = setup.plant
        by = hidden.parameters["added"] * plant.machine.ratio**2
        inertia = raised(plant.rotor_inertia, column(setup, hidden.place[0]), by)
        return replace(setup, plant=replace(plant, rotor_inertia=inertia))


class JointElasticity(Effect):
    """A transmission that winds up."""

    name = "joint_elasticity"
    units: ClassVar[Units] = {"stiffness": "N*m/rad"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint; felt where the motor must follow the wind-up with its inertia."""
        softest = 2500.0 if ref.robot.floating else 800.0
        j = any_joint(rng, ref)
        bend = ref.rate_of(ref.rate_of(ref.torque))[:, j]
        # Torque rates jump with the support; the controller's bandwidth rounds them.
        bend = np.clip(bend, *np.quantile(bend, [0.02, 0.98]))
        inertia = float(ref.setup.plant.rotor_inertia[j])
        compliance, torque = sized(torque, inertia * float(rms(bend)), 1 / 2e4, 1 / softest)
        return self.hidden((ref.joints[j],), torque, stiffness=1 / compliance)

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Part motor and link."""
        return _parted(setup, hidden.place[0], hidden.parameters["stiffness"], 0.0)


class Backlash(Effect):
    """Play between motor and link."""

    name = "backlash"
    units: ClassVar[Units] = {"width": "rad"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint; 1 to 30 mrad, whatever torque that makes."""
        j = any_joint(rng, ref)
        width = float(np.exp(rng.uniform(np.log(1e-3), np.log(3e-2))))
        return self.hidden((ref.joints[j],), float("nan"), width=width)

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Part motor and link by flanks with a gap."""
        return _parted(setup, hidden.place[0], FLANKS, hidden.parameters["width"])


def _parted(setup: Setup, joint: str, stiffness: float, gap: float) -> Setup:
    plant, j = setup.plant, column(setup, joint)
    stiff, damping = plant.stiffness.copy(), plant.damping.copy()
    # A second compliance in series with one that is already there.
    stiff[j] = 1 / (1 / stiff[j] + 1 / stiffness)
    damping[j] = _LOSS_TIME * stiff[j]
    plant = replace(plant, stiffness=stiff, damping=damping, gap=raised(plant.gap, j, gap))
    return replace(setup, plant=plant)


class TorqueRipple(Effect):
    """Torque periodic in the joint's angle, as a Harmonic Drive's error makes it."""

    name = "torque_ripple"
    units: ClassVar[Units] = {"amplitude": "N*m", "order": "1", "phase": "rad"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint; orders of wave generator or motor."""
        j = any_joint(rng, ref)
        amplitude, torque = sized(torque, np.sqrt(0.5), 0.05, 3.0)
        order = float(rng.choice(_ORDERS))
        phase = rng.uniform(0, 2 * np.pi)
        return self.hidden((ref.joints[j],), torque, amplitude=amplitude, order=order, phase=phase)

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Add it to the joint."""
        p = hidden.parameters
        law = Ripple(column(setup, hidden.place[0]), p["amplitude"], p["order"], p["phase"])
        return replace(setup, plant=replace(setup.plant, extra=(*setup.plant.extra, law)))


class TransmissionCoupling(Effect):
    """A motor that also turns with the joint before its own in the same leg."""

    name = "transmission_coupling"
    units: ClassVar[Units] = {"ratio": "1"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Motor of joint 2 or 3 with joint 1 or 2 of its leg."""
        layout = ref.robot.layout
        leg = layout.of(int(rng.integers(layout.columns.shape[0])))
        k = int(rng.integers(1, leg.size))
        j, other = int(leg[k]), int(leg[k - 1])
        trial = 0.1
        plant, w = ref.setup.plant, ref.velocity
        turned = np.sign(w[:, j] + trial * w[:, other]) - np.sign(w[:, j])
        own = plant.rotor.coulomb[j] * turned
        own = own + plant.rotor_inertia[j] * trial * ref.acceleration[:, other]
        felt = max(float(rms(own)), float(rms(trial * ref.torque[:, j])))
        size, torque = sized(torque, felt / trial, 0.03, 1.0)
        ratio = size * rng.choice([-1.0, 1.0])
        return self.hidden((ref.joints[j], ref.joints[other]), torque, ratio=ratio)

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Let the first joint's motor turn with the second joint, too."""
        j, other = (column(setup, name) for name in hidden.place)
        coupling = setup.plant.coupling.copy()
        coupling[j, other] += hidden.parameters["ratio"]
        return replace(setup, plant=replace(setup.plant, coupling=coupling))


class ParallelSpring(Effect):
    """A spring from base to joint beside the motor."""

    name = "parallel_spring"
    units: ClassVar[Units] = {"stiffness": "N*m/rad", "rest": "rad"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint; its rest position lies inside the motion."""
        j = any_joint(rng, ref)
        q = ref.position[:, j]
        rest = float(rng.uniform(*np.quantile(q, [0.1, 0.9])))
        size, torque = sized(torque, float(rms(q - rest)), 0.1, 40.0)
        return self.hidden((ref.joints[j],), torque, stiffness=size, rest=rest)

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Add it to the joint."""
        p = hidden.parameters
        law = Spring(column(setup, hidden.place[0]), rest=p["rest"], linear=p["stiffness"])
        return replace(setup, plant=replace(setup.plant, extra=(*setup.plant.extra, law)))


class TorqueConstantError(Effect):
    """A motor whose torque constant is not its data sheet's."""

    name = "torque_constant_error"
    units: ClassVar[Units] = {"relative": "1"}

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint; 7 to 30 %, above the tolerance."""
        j = any_joint(rng, ref)
        size, torque = sized(torque, float(rms(ref.motor_torque[:, j])), 0.07, 0.3)
        return self.hidden((ref.joints[j],), torque, relative=size * rng.choice([-1.0, 1.0]))

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Scale k_t."""
        constant = setup.plant.torque_constant.copy()
        constant[column(setup, hidden.place[0])] *= 1 + hidden.parameters["relative"]
        return replace(setup, plant=replace(setup.plant, torque_constant=constant))


class WindingHeating(Effect):
    """Windings that warm up during the log: resistance rises, torque constant falls."""

    name = "winding_heating"
    units: ClassVar[Units] = {
        "rise": "K",
        "thermal_resistance": "K/W",
        "time_constant": "s",
    }

    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Any joint; 15 to 100 K, driven by the losses and by what is around the motor."""
        j = any_joint(rng, ref)
        per_kelvin = -MAGNET * float(rms(ref.motor_torque[:, j]))
        size, torque = sized(torque, per_kelvin, 15.0, 100.0)
        return self.hidden(
            (ref.joints[j],),
            torque,
            rise=size,
            thermal_resistance=1.93 + 4.65,
            time_constant=rng.uniform(2.0, 6.0),
        )

    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """Give the motor a thermal circuit."""
        p = hidden.parameters
        n = len(setup.plant.joints)
        j = column(setup, hidden.place[0])
        heating = Heating(
            rise=raised(np.zeros(n), j, p["rise"]),
            thermal_resistance=raised(np.zeros(n), j, p["thermal_resistance"]),
            time_constant=p["time_constant"],
        )
        return replace(setup, plant=replace(setup.plant, heating=heating))
