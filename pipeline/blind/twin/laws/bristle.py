"""Friction by the deflection of bristles (LuGre), at one shaft of every joint.

Canudas de Wit, Olsson, Astrom and Lischinsky, "A new model for control of systems with friction",
IEEE TAC 40(3), 1995:

    dz/dt = w - s0 |w| z / g,    F = s0 z + s1 dz/dt + s2 w,
    g(w) = Fc + (Fs - Fc) exp(-(w / ws)^2)

with Fc raised by the transmitted load, differently where the shaft drives the load and where the
load drives the shaft, and by a part that changes sign with the velocity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: Keeps the bristle's steady deflection defined where a shaft has no friction [N*m].
_NONE = 1e-12


@dataclass(frozen=True)
class BristleLaw:
    """Parameters per joint, all of shape (J,), referred to the joint.

    Attributes:
        coulomb: Fc [N*m].
        excess: Fs - Fc, break-away above Coulomb friction [N*m].
        stribeck_velocity: ws [rad/s].
        viscous: s2 [N*m*s/rad].
        load_driving: Share of the transmitted torque lost while the shaft drives the load [1].
        load_driven: Likewise while the load drives the shaft [1].
        asymmetry: Added to Fc in positive motion, taken off it in negative motion [N*m].
        stiffness: s0 [N*m/rad].
        damping_time: s1 / s0 [s].
    """

    coulomb: Array
    excess: Array
    stribeck_velocity: Array
    viscous: Array
    load_driving: Array
    load_driven: Array
    asymmetry: Array
    stiffness: Array
    damping_time: float = 5e-4

    @classmethod
    def none(cls, joints: int, stiffness: float = 2e4) -> BristleLaw:
        """No friction at this shaft."""
        zero = np.zeros(joints)
        return cls(
            coulomb=zero,
            excess=zero,
            stribeck_velocity=np.full(joints, 0.1),
            viscous=zero,
            load_driving=zero,
            load_driven=zero,
            asymmetry=zero,
            stiffness=np.full(joints, stiffness),
        )

    def steady(self, velocity: Array, load: Array) -> Array:
        """Friction torque in steady sliding [N*m], shape (J,), for tests and sizing."""
        return self.level(velocity, load) * np.sign(velocity) + self.viscous * velocity

    def level(self, velocity: Array, load: Array) -> Array:
        """g, the magnitude of dry friction [N*m], shape (J,)."""
        g = self.coulomb + self.excess * np.exp(-((velocity / self.stribeck_velocity) ** 2))
        share = np.where(load * velocity > 0, self.load_driving, self.load_driven)
        g = g + share * np.abs(load) + self.asymmetry * np.sign(velocity)
        return np.maximum(g, _NONE)


class BristleFriction:
    """A `BristleLaw` stepped in time.

    The bristle equation is linear in z while velocity and load stand still, so each step takes its
    exact solution: stable at any speed.
    """

    def __init__(self, law: BristleLaw, dt: float) -> None:
        self.law = law
        self._dt = dt
        self._z = np.zeros(law.coulomb.shape)
        self._plain = not (
            law.excess.any()
            or law.load_driving.any()
            or law.load_driven.any()
            or law.asymmetry.any()
        )
        self._coulomb = np.maximum(law.coulomb, _NONE)
        self._absent = self._plain and not (law.coulomb.any() or law.viscous.any())

    @property
    def stored(self) -> float:
        """Energy in the bristles [J]."""
        return float(0.5 * np.dot(self.law.stiffness, self._z**2))

    def torque(self, velocity: Array, load: Array, extra: Array | None = None) -> Array:
        """Friction torque over one step, opposing positive velocity with a positive value.

        Args:
            velocity: Of the shaft, referred to the joint [rad/s], shape (J,).
            load: Torque transmitted to what lies outboard [N*m], shape (J,).
            extra: Dry friction on top of the law's, e.g. of a sticking spot [N*m], shape (J,).

        Returns:
            [N*m], shape (J,).
        """
        law = self.law
        if self._absent and extra is None:
            return law.viscous  # zeros
        g = self._coulomb if self._plain else law.level(velocity, load)
        if extra is not None:
            g = g + extra
        deflection = g / law.stiffness
        decay = np.exp(-np.abs(velocity) * (self._dt / deflection))
        steady = np.copysign(deflection, velocity)
        z = steady + (self._z - steady) * decay
        rate = (z - self._z) * (law.damping_time / self._dt)
        self._z = z
        result: Array = law.stiffness * (z + rate) + law.viscous * velocity
        return result
