"""Laws of the simulated machines: dry friction and its bristles, torques at a joint.

Both sources evaluate these: the inverse steps bristles along the motion, forward dynamics sets the
engine's own dry friction to the level and applies the torques from outside.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from actuators.arrays import Array

#: Torque on the joint in its positive sense [N*m] of time [s], angle [rad] and speed [rad/s].
Law = Callable[[float, float, float], float]
_TERMS = (*("coulomb", "excess", "viscous", "quadratic"), "driving", "driven", "asymmetry")
#: Keeps the bristle's steady deflection defined where a shaft has no friction [N*m].
_NONE = 1e-12
#: Deflection of bristles in steady sliding [rad] (presliding of a gear's teeth and seals).
_DEFLECTION = 2e-4


@dataclass(frozen=True)
class Friction:
    """Friction at every joint, arrays of shape (J,), referred to the joint."""

    coulomb: Array  #: [N*m].
    excess: Array  #: Break-away above it [N*m].
    stribeck: Array  #: Velocity over which that falls off [rad/s].
    viscous: Array  #: [N*m*s/rad].
    quadratic: Array  #: [N*m*s^2/rad^2].
    driving: Array  #: Share of the load lost while the motor drives it [1].
    driven: Array  #: Likewise while the load drives the motor [1].
    asymmetry: Array  #: Added to Coulomb friction in positive motion, taken off in negative [N*m].
    #: Joint to a further level of dry friction over time [s] and angle [rad], or none.
    spots: tuple[tuple[int, Callable[[float, float], float]], ...] = ()

    @classmethod
    def none(cls, joints: int) -> Friction:
        """No friction."""
        zero = np.zeros(joints)
        return cls(zero, zero, np.full(joints, 0.1), zero, zero, zero, zero, zero)

    def at(self, joint: int, **values: float) -> Friction:
        """The same with numbers of one joint replaced."""
        changed = {name: getattr(self, name).copy() for name in values}
        for name, value in values.items():
            changed[name][joint] = value
        return replace(self, **changed)

    def without(self, joint: int) -> Friction:
        """The same with a joint that has none."""
        return self.at(joint, **dict.fromkeys(_TERMS, 0.0))

    def with_spot(self, joint: int, law: Callable[[float, float], float]) -> Friction:
        """The same with a further level of dry friction."""
        return replace(self, spots=(*self.spots, (joint, law)))

    def terms(self, joints: tuple[str, ...]) -> dict[str, list[str]]:
        """Terms that are there, by joint."""
        return {
            joint: [name for name in _TERMS if getattr(self, name)[j]]
            + ["spot" for at, _ in self.spots if at == j]
            for j, joint in enumerate(joints)
        }

    @property
    def plain(self) -> bool:
        """Whether dry friction has the same level all along."""
        changing = (self.excess, self.driving, self.driven, self.asymmetry)
        return not (self.spots or any(x.any() for x in changing))

    @property
    def absent(self) -> bool:
        """Whether there is none."""
        return self.plain and not (self.coulomb.any() or self.viscous.any() or self.quadratic.any())

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


def bristles(friction: Friction, time: Array, q: Array, v: Array, load: Array) -> Array:
    """Friction along a motion by the deflection z of bristles (LuGre).

    Canudas de Wit, Olsson, Astrom and Lischinsky, "A new model for control of systems with
    friction", IEEE TAC 40(3), 1995: dz/dt = v - s0 |v| z / g, F = s0 z + drag(v). The equation is
    linear in z while speed and load stand still, so each step takes its exact solution.

    Args:
        friction: At every joint.
        time: Uniform, shape (N,) [s].
        q: Shape (N, J) [rad].
        v: Of the shafts that rub [rad/s].
        load: Torque passed on to the links [N*m].

    Returns:
        Opposing positive motion with a positive value, shape (N, J) [N*m].
    """
    if friction.absent:
        return np.zeros_like(v)
    dt, z = float(time[1] - time[0]), np.zeros(v.shape[1])
    top = friction.coulomb + friction.excess
    top = top + np.maximum(friction.driving, friction.driven) * np.abs(load).max(axis=0)
    for joint, law in friction.spots:
        top[joint] += max(law(float(t), float(x)) for t, x in zip(time, q[:, joint], strict=True))
    stiffness = np.maximum(top, _NONE) / _DEFLECTION
    out = np.empty_like(v)
    for k in range(time.size):
        deflection = friction.level(float(time[k]), q[k], v[k], load[k]) / stiffness
        steady = np.copysign(deflection, v[k])
        z = steady + (z - steady) * np.exp(-np.abs(v[k]) * (dt / deflection))
        out[k] = stiffness * z
    return out + friction.drag(v)


def spring(rest: float, linear: float, cubic: float = 0.0) -> Law:
    """-k (q - q0) - k3 (q - q0)^3."""
    return lambda t, q, v: -(q - rest) * (linear + cubic * (q - rest) ** 2)


def ripple(amplitude: float, order: float, phase: float) -> Law:
    """A sin(n q + phase)."""
    return lambda t, q, v: amplitude * float(np.sin(order * q + phase))


def detents(amplitude: float, count: float) -> Law:
    """Notches: narrow wells between flat stretches, n per turn; no sine."""

    def law(t: float, q: float, v: float) -> float:
        x = float(np.sin(count * q))
        return -amplitude * x * abs(x) ** 3 * (1.0 + float(np.cos(count * q)))

    return law


def hysteresis(torque: float, width: float, dt: float) -> Law:
    """A cable or belt that winds up over an angle (Dahl 1968): dz = (sgn v - z) |dq| / width."""
    z = 0.0

    def law(t: float, q: float, v: float) -> float:
        nonlocal z
        side = float(np.sign(v))
        z = side + (z - side) * float(np.exp(-abs(v) * dt / width))
        return -torque * z

    return law


def cable(start: float, stiffness: float, dt: float) -> Law:
    """A cable that pulls from an angle on, harder outward than back: -k max(0, q - q0)^2."""
    drag = hysteresis(0.3, 0.1, dt)

    def law(t: float, q: float, v: float) -> float:
        return -stiffness * max(0.0, q - start) ** 2 * (1.0 - drag(t, q, v))

    return law
