"""Friction of one joint: named laws as nested sets of columns, and a general member above them.

Every law is linear in its sizes once its shape is fixed; shapes (a Stribeck speed, a speed of
saturation) come as a few fixed steps. Motion reverses within one low-pass's memory, so columns that
jump or bend there are computed before rows are thinned and go through the filter of the torque.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
import scipy.special
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Shapes tried, as shares of the joint's 95 % speed.
STRIBECK_SPEEDS: Final = (0.03, 0.055, 0.1, 0.17, 0.3)
SATURATION_SPEEDS: Final = (0.3,)
#: Speeds over which Coulomb friction may rise after a reversal (presliding), as such shares; a rise
#: over more than that is saturation.
TRANSITIONS: Final = (0.0, 0.003, 0.01, 0.03, 0.1)
#: ... or the travel over which it does [rad].
TRAVELS: Final = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2)
#: Shares of motor torque tried for the convention "per motor torque".
MOTOR_SHARES: Final = (0.1, 0.25)
#: Inner knots of the general member, as quantiles of the speed.
KNOTS: Final = (0.1, 0.25, 0.4, 0.55, 0.7, 0.85)


@dataclass(frozen=True)
class Sense:
    """Sign of a velocity that is known with noise.

    Attributes:
        sign: Its mean, -1 to 1, (N,).
        doubt: Variance of the sign from the noise of the velocity, 0 to 1, (N,).
    """

    sign: Array
    doubt: Array


def sense(v: Array, sigma_v: float, rise: float = 0.0) -> Sense:
    """Sign of one joint's velocity.

    Args:
        v: (N,) [rad/s].
        sigma_v: Noise of the velocity [rad/s].
        rise: Speed over which friction rises after a reversal [rad/s].
    """
    tiny = 1e-12 + 1e-9 * float(np.abs(v).max(initial=0.0))
    noise = max(sigma_v, tiny)
    width = np.hypot(noise, rise)
    sign = scipy.special.erf(v / (np.sqrt(2) * width))
    doubt = 1.0 - scipy.special.erf(v / (np.sqrt(2) * noise)) ** 2
    return Sense(np.asarray(sign), np.asarray(doubt))


@dataclass(frozen=True)
class Law:
    """A named law of friction.

    Attributes:
        name: In the field's terms.
        terms: Columns it is made of.
    """

    name: str
    terms: tuple[str, ...]

    @property
    def size(self) -> int:
        """Number of sizes."""
        return len(self.terms)

    @property
    def shapes(self) -> int:
        """Number of sizes and shapes: what the law can bend with."""
        return len(self.terms) + sum("@" in t for t in self.terms)


#: Terms that may have either sign; every other one takes energy out or is none.
SIGNED: Final = frozenset({"offset", "even"})
#: Terms that are as smooth as the motion: it went through the filter already.
SMOOTH: Final = frozenset({"offset", "rotor", "viscous", "quadratic", "inertia"})
#: How terms begin that the load changes.
BY_LOAD: Final = ("load", "driving", "driven", "quadrant", "motor", "rising_load", "sliding_load")
#: Share of a size, or of a torque, that no law of a textbook holds better than, one standard
#: deviation.
LAW: Final = 0.01
#: Terms beside friction, decided on their own.
BESIDE: Final = ("offset", "rotor")


def _laws() -> tuple[Law, ...]:
    c, v = "coulomb", "viscous"
    out = [
        Law("none", ()),
        Law("Coulomb", (c,)),
        Law("viscous", (v,)),
        Law("load-dependent", ("load",)),
        Law("Coulomb and viscous", (c, v)),
        Law("Coulomb and load-dependent", (c, "load")),
        Law("viscous and load-dependent", (v, "load")),
        Law("Coulomb, viscous and load-dependent", (c, v, "load")),
        Law("Coulomb and quadratic", (c, "quadratic")),
        Law("quadratic", ("quadratic",)),
        Law("Coulomb, viscous and quadratic", (c, v, "quadratic")),
        Law("load-dependent by quadrant", ("driving", "driven")),
        Law("Coulomb and load-dependent by quadrant", (c, "driving", "driven")),
        Law("viscous and load-dependent by quadrant", (v, "driving", "driven")),
        Law("Coulomb, viscous and load-dependent by quadrant", (c, v, "driving", "driven")),
        Law("Coulomb and viscous by direction", (c, v, "even")),
    ]
    for k in range(len(STRIBECK_SPEEDS)):
        out.append(Law("Stribeck", (c, f"stribeck@{k}")))
        out.append(Law("Stribeck and viscous", (c, v, f"stribeck@{k}")))
        out.append(Law("Stribeck, viscous and load-dependent", (c, v, "load", f"stribeck@{k}")))
    for k in range(len(SATURATION_SPEEDS)):
        out.append(Law("Coulomb and saturating", (c, f"saturating@{k}")))
        out.append(Law("saturating", (f"saturating@{k}",)))
    for k in range(len(MOTOR_SHARES)):
        out.append(Law("Coulomb, viscous and per motor torque", (c, v, f"motor@{k}")))
    return tuple(out)


LAWS: Final = _laws()


@dataclass(frozen=True)
class Shape:
    """What turns one joint's motion into columns; fixed by the training rows.

    Attributes:
        speed: 95 % quantile of the speed in motion [rad/s].
        knots: Of the general member, on the speed [rad/s].
        sigma_v: Noise of the velocity [rad/s].
        rise: Speed over which Coulomb friction rises after a reversal [rad/s].
        travel: Travel over which it does, in place of a speed [rad].
    """

    speed: float
    knots: Array
    sigma_v: float
    rise: float = 0.0
    travel: float = 0.0

    @classmethod
    def of(cls, v: Array, sigma_v: float) -> Shape:
        """Take the shape from training rows."""
        speed = np.abs(v)
        moving = speed[speed > max(3 * sigma_v, 0.02 * float(speed.max(initial=0.0)))]
        top = float(np.quantile(moving, 0.95)) if moving.size > 20 else max(1.0, 10 * sigma_v)
        inner = np.quantile(moving, KNOTS) if moving.size > 20 else top * np.array(KNOTS)
        knots = np.concatenate([[0.0], inner, [top]])
        knots = np.maximum.accumulate(knots + 1e-9 * top * np.arange(knots.size))
        return cls(top, knots, sigma_v)

    def stribeck_speed(self, number: int) -> float:
        """Speed at which 1/e of the excess of a Stribeck term is left [rad/s]."""
        return STRIBECK_SPEEDS[number] * self.speed

    def saturation_speed(self, number: int) -> float:
        """Speed over which a saturating term grows [rad/s]."""
        return SATURATION_SPEEDS[number] * self.speed

    @staticmethod
    def motor_share(number: int) -> float:
        """Share of the motor's torque in the shape of a term "per motor torque"."""
        return MOTOR_SHARES[number]

    def columns(
        self, v: Array, a: Array, load: Array, slid: Mapping[float, Array] = MappingProxyType({})
    ) -> tuple[dict[str, Array], Array]:
        """Columns of every term, (N,) each, and the doubt about the sign, (N,).

        Args:
            v: (N,) [rad/s].
            a: (N,) [rad/s^2].
            load: Torque of the rigid bodies, (N,) [N*m].
            slid: Sense of dry friction where it rises over a travel, by travel, (N,) each; without
                it such friction jumps.
        """
        felt = sense(v, self.sigma_v, self.rise)
        s, speed, heavy = felt.sign, np.abs(v), np.abs(load)
        if self.travel:
            s = slid.get(self.travel, s)
        power = np.sign(load) * s
        out = {
            "offset": np.ones_like(v),
            "rotor": a,
            "coulomb": s,
            "viscous": v,
            "quadratic": v * speed,
            "even": speed,
            "load": heavy * s,
            "driving": heavy * s * (0.5 + 0.5 * power),
            "driven": heavy * s * (0.5 - 0.5 * power),
        }
        out[QUADRANT] = 0.5 * (out["driving"] - out["driven"])
        for k, share in enumerate(TRANSITIONS):
            rising = sense(v, self.sigma_v, share * self.speed).sign
            out[f"rising@{k}"] = rising
            out[f"rising_load@{k}"] = heavy * rising
        for k, way in enumerate(slid.values()):
            out[f"sliding@{k}"] = way
            out[f"sliding_load@{k}"] = heavy * way
        for k, share in enumerate(STRIBECK_SPEEDS):
            out[f"stribeck@{k}"] = s * np.exp(-((v / (share * self.speed)) ** 2))
        for k, share in enumerate(SATURATION_SPEEDS):
            out[f"saturating@{k}"] = np.tanh(v / (share * self.speed))
        for k, mu in enumerate(MOTOR_SHARES):
            out[f"motor@{k}"] = heavy * s / (1.0 - mu * power)
        basis = hats(speed, self.knots)
        for k in range(basis.shape[1]):
            out[f"odd@{k}"] = s * basis[:, k]
        for k in range(1, basis.shape[1], 2):
            out[f"evenly@{k}"] = basis[:, k]
        for k in range(0, basis.shape[1], 2):
            out[f"loaded@{k}"] = s * heavy * basis[:, k]
        return out, felt.doubt


def bends() -> tuple[str, ...]:
    """Terms by which the general member departs from Coulomb, viscous and load-dependent."""
    n = len(KNOTS) + 2
    return (
        tuple(f"odd@{k}" for k in range(n))
        + tuple(f"evenly@{k}" for k in range(1, n, 2))
        + tuple(f"loaded@{k}" for k in range(0, n, 2))
    )


def general_terms() -> tuple[str, ...]:
    """Terms of the general member: odd and even curves of the speed and an odd one per load."""
    return ("coulomb", "viscous", "load", *bends())


#: By which friction per load is larger while the motor drives than while it is driven, its half:
#: of the torque's own shape, as a wrong scale of the sensor is.
QUADRANT: Final = "quadrant"


def hats(x: Array, knots: Array) -> Array:
    """Linear B-splines on these knots, (N, knots); beyond the last the last segment goes on."""
    n = len(knots)
    i = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, n - 2)
    t = (x - knots[i]) / (knots[i + 1] - knots[i])
    out = np.zeros((x.size, n))
    out[np.arange(x.size), i] = 1.0 - t
    out[np.arange(x.size), i + 1] = t
    return out


#: What a term is called, its unit at a revolute joint, and the kind it counts as.
KINDS: Final = {
    "offset": ("offset", "N*m"),
    "rotor": ("rotor inertia", "kg*m^2"),
    "inertia": ("rotor inertia", "kg*m^2"),
    "coulomb": ("Coulomb", "N*m"),
    "viscous": ("viscous", "N*m*s/rad"),
    "quadratic": ("quadratic", "N*m*s^2/rad^2"),
    "even": ("by direction", "N*m*s/rad"),
    "load": ("load-dependent", "1"),
    "driving": ("load-dependent", "1"),
    "quadrant": ("load-dependent", "1"),
    "driven": ("load-dependent", "1"),
    "motor": ("load-dependent", "1"),
    "stribeck": ("Stribeck", "N*m"),
    "saturating": ("saturating", "N*m"),
    "odd": ("curve", "N*m"),
    "evenly": ("curve", "N*m"),
    "loaded": ("curve", "1"),
}


def kind(term: str) -> str:
    """Kind of a term: its name without shape and place."""
    return KINDS[term.split(":")[-1].split("@")[0]][0]


def unit(term: str) -> str:
    """Unit of a term's size."""
    return KINDS[term.split(":")[-1].split("@")[0]][1]


def name_of(terms: tuple[str, ...]) -> str:
    """Name of a set of terms: the catalogue's, or what it is made of."""
    for law in LAWS:
        if set(law.terms) == set(terms):
            return law.name
    return " and ".join(dict.fromkeys(kind(t) for t in terms))
