"""The machine as it truly is: friction and its bristles, gears, sensors, torques at a joint.

Both sources evaluate these laws: the inverse steps bristles along the motion, forward dynamics sets
the engine's own dry friction to the level and applies the torques from outside.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
#: Torque on the joint in its positive sense [N*m] of time [s], angle [rad] and speed [rad/s].
Law = Callable[[float, float, float], float]
FRICTION = (*("coulomb", "excess", "viscous", "quadratic"), "driving", "driven", "asymmetry")
#: Keeps the bristle's steady deflection defined where a shaft has no friction [N*m].
_NONE = 1e-12
#: Deflection of bristles in steady sliding [rad] (presliding of a gear's teeth and seals).
_DEFLECTION = 2e-4


@dataclass(frozen=True)
class Plant:
    """Machine and sensors; arrays of shape (J,) at the joint, friction on the motor's side."""

    model: pin.Model  #: Bodies and gravity.
    coulomb: Array  #: Dry friction [N*m].
    excess: Array  #: Break-away above it [N*m].
    stribeck: Array  #: Velocity over which that falls off [rad/s].
    viscous: Array  #: [N*m*s/rad].
    quadratic: Array  #: [N*m*s^2/rad^2].
    driving: Array  #: Share of the load lost while the motor drives it [1].
    driven: Array  #: Likewise while the load drives the motor [1].
    asymmetry: Array  #: Added to dry friction in positive motion, taken off in negative [N*m].
    inertia: Array  #: Of the rotors, as far as the URDF lacks it [kg*m^2].
    compliance: Array  #: Of the gears [rad/(N*m)].
    play: Array  #: Whole width [rad].
    coupling: Array  #: Motor speeds over joint speeds, shape (J, J); friction and rotors feel both.
    gain: Array  #: By which torques read too much [1].
    offset: Array  #: Added to torques [N*m].
    zero: Array  #: Added to positions [rad].
    white: Array  #: Noise of the torque in every row, standard deviation [N*m].
    coloured: Array  #: Slow part of that noise [N*m].
    memory: float = 0.02  #: Time over which that part forgets [s].
    rate: float = 500.0  #: Of the log [Hz].
    bits: int = 16  #: Of the joints' encoders.
    velocity: float = 0.0  #: Noise of a velocity column [rad/s]; zero for none.
    delay: float = 0.0  #: Of the torques behind the positions [s].
    sides: str = "joint"  #: Where positions are measured: ``"joint"``, ``"motor"`` or ``"both"``.
    #: Joint to a further level of dry friction [N*m] over time [s] and angle [rad].
    spots: tuple[tuple[int, Callable[[float, float], float]], ...] = ()
    #: Joint to a law begun for a time step [s].
    extra: tuple[tuple[int, Callable[[float], Law]], ...] = ()

    @classmethod
    def rigid(cls, model: pin.Model, joints: int) -> Plant:
        """Bodies alone, measured without bias."""
        one = np.ones(joints)
        absent = ("inertia", "compliance", "play", "offset", "zero", "white", "coloured")
        return cls(
            model,
            **dict.fromkeys((*FRICTION, *absent), 0.0 * one),
            **{"stribeck": 0.1 * one, "coupling": np.eye(joints), "gain": one},
        )

    def at(self, joint: int, **values: float) -> Plant:
        """The same with numbers of one joint replaced."""
        changed = {name: getattr(self, name).copy() for name in values}
        for name, value in values.items():
            changed[name][joint] = value
        return replace(self, **changed)

    def rubbing(self, joint: int, **values: float) -> Plant:
        """The same with a joint that has these terms of friction alone."""
        return self.at(joint, **dict.fromkeys(FRICTION, 0.0) | values)

    def terms(self, joints: tuple[str, ...]) -> dict[str, list[str]]:
        """Terms of friction that are there, by joint."""
        return {
            joint: [name for name in FRICTION if getattr(self, name)[j]]
            + ["spot" for at, _ in self.spots if at == j]
            for j, joint in enumerate(joints)
        }

    @property
    def resolution(self) -> float:
        """Of the joints' encoders [rad]."""
        return float(2 * np.pi / 2**self.bits)

    @property
    def parted(self) -> Array:
        """Which joints have a motor that turns apart from its link, shape (J,)."""
        return np.asarray((self.compliance > 0) | (self.play > 0))

    def level(self, time: float, q: Array, v: Array, load: Array) -> Array:
        """Magnitude of dry friction [N*m], shape (J,)."""
        g = self.coulomb + self.excess * np.exp(-((v / self.stribeck) ** 2))
        share = np.where(load * v > 0, self.driving, self.driven)
        g = g + share * np.abs(load) + self.asymmetry * np.sign(v)
        for joint, law in self.spots:
            g[joint] += law(time, float(q[joint]))
        return np.maximum(g, _NONE)

    def drag(self, v: Array) -> Array:
        """What opposes motion and vanishes at rest [N*m]."""
        return self.viscous * v + self.quadratic * v * np.abs(v)


def bristles(plant: Plant, time: Array, q: Array, v: Array, load: Array) -> Array:
    """Friction along a motion by the deflection z of bristles (LuGre).

    Canudas de Wit, Olsson, Astrom and Lischinsky, "A new model for control of systems with
    friction", IEEE TAC 40(3), 1995: dz/dt = v - s0 |v| z / g, F = s0 z + drag(v). The equation is
    linear in z while speed and load stand still, so each step takes its exact solution.

    Of shafts that rub at speeds v (N, J) [rad/s] while they pass on a load [N*m], at uniform times;
    opposing positive motion with a positive value, shape (N, J) [N*m].
    """
    if not (plant.spots or any(getattr(plant, name).any() for name in FRICTION)):
        return np.zeros_like(v)
    dt, z = float(time[1] - time[0]), np.zeros(v.shape[1])
    top = plant.coulomb + plant.excess
    top = top + np.maximum(plant.driving, plant.driven) * np.abs(load).max(axis=0)
    for joint, law in plant.spots:
        top[joint] += max(law(float(t), float(x)) for t, x in zip(time, q[:, joint], strict=True))
    stiffness = np.maximum(top, _NONE) / _DEFLECTION
    out = np.empty_like(v)
    for k in range(time.size):
        deflection = plant.level(float(time[k]), q[k], v[k], load[k]) / stiffness
        steady = np.copysign(deflection, v[k])
        z = steady + (z - steady) * np.exp(-np.abs(v[k]) * (dt / deflection))
        out[k] = stiffness * z
    return out + plant.drag(v)


def hysteresis(torque: float, width: float, dt: float) -> Law:
    """A cable or belt that winds up over an angle (Dahl 1968): dz = (sgn v - z) |dq| / width."""
    z = 0.0

    def law(t: float, q: float, v: float) -> float:
        nonlocal z
        side = float(np.sign(v))
        z = side + (z - side) * float(np.exp(-abs(v) * dt / width))
        return -torque * z

    return law
