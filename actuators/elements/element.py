"""The element, one law between two neighbouring shafts, and those that every drive is made of.

`Ratio` is Eq. 1 and 2 of the paper, `Inertia` the inertial terms of Eq. 3, 7, 8, 14 and 18.
`Friction` is one law, of whose terms the named laws of friction are choices.

With v the velocity, s = sgn(v) the sense of motion and T the torque on the joint side,

    friction = (coulomb + excess exp(-(v / stribeck_speed)^2)) s + skew |s|
             + viscous v + quadratic v |v| + (load + when_driving or when_driven) |T| s

is what the motor side supplies in addition: Coulomb, load-dependent and viscous (Eq. 4 to 6, 10,
15, 17, 19 of the paper, dissipating for every sign); Stribeck (Armstrong-Helouvry, Dupont, Canudas
de Wit, Automatica 30(7), 1994); by direction (`skew`, in motion a constant torque; Armstrong,
"Control of machines with friction", 1991); by quadrant of power, s T > 0 where the motor drives
(Hamon, Gautier, Garrec, IROS 2010); drag by Bona and Indri's review, CDC 2005. After a reversal s
may rise over a small displacement (`travel`, see `presliding`) or over a speed,
s = erf(v / (sqrt(2) rise)).
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from scipy.special import erf

from actuators.arrays import Array, Mask, Scalars
from actuators.parameters import Numbers, number, require
from actuators.shaft import ShaftSeries

#: A step in time this many times the usual one is a gap, after which nothing is remembered.
GAP: Final = 5.0


def presliding(time: Array, position: Array, direction: Array, travel: float) -> Array:
    """Return the sense of dry friction, -1 to 1, (N,).

    Args:
        time: (N,) [s], not decreasing; a gap is a break, and so is a repeated stamp at another
            angle: at the same one, as where a series is split at a reversal, motion goes on.
        position: (N,) [rad].
        direction: Where a block begins, -1 to 1, (N,).
        travel: Positive [rad].
    """
    if position.size < 2:
        return np.asarray(direction, dtype=float)
    step = np.diff(time)
    usual = float(np.median(step[step > 0.0])) if (step > 0.0).any() else 0.0
    moved = np.diff(position)
    way = np.sign(moved)
    broken = ((step <= 0.0) & (moved != 0.0)) | (step > GAP * max(usual, 1e-300))
    edges = np.concatenate([[True], (way[1:] != way[:-1]) | broken[1:] | broken[:-1]])
    starts = np.flatnonzero(edges)
    stops = np.append(starts[1:], way.size)
    out = np.empty(position.size)
    out[0] = now = float(direction[0])
    for a, b in zip(starts.tolist(), stops.tolist(), strict=True):
        if broken[a]:
            out[a + 1] = now = float(direction[a + 1])
            continue
        d = way[a]
        if d == 0.0:
            out[a + 1 : b + 1] = now
            continue
        slid = np.abs(position[a + 1 : b + 1] - position[a])
        out[a + 1 : b + 1] = d + (now - d) * np.exp(-slid / travel)
        now = float(out[b])
    return out


#: Lower and upper ends of intervals, of any shape.
Span: TypeAlias = tuple[Array, Array]
NEEDS_POSITION: Final = "what holds depends on the position: state it"
#: Laws by the name that catalogues give them, in the order in which they are declared.
LAWS: Final[dict[str, type["Element"]]] = {}


@dataclass(frozen=True, eq=False)
class Element(Numbers):
    """What every element of a chain answers, vectorised over samples and joints.

    Each has a joint side and a motor side; this one passes everything on, and a law overrides what
    it does otherwise: `added` where it takes or gives torque, `inverse` where it changes motion.
    Subclasses are frozen dataclasses; a parameter is one number for all joints or one per joint
    (J,). Every element is local: a sample of a joint depends on no other joint, and but for
    presliding friction on no other sample. What is not is kept by `pipeline.machine`.
    """

    name: str  #: Unique in its chain; names the row of its loss.

    def __init_subclass__(cls, law: str = "") -> None:
        """Enter the laws that catalogues may name, where it has a name there."""
        super().__init_subclass__()
        if law:
            LAWS[law] = cls

    def added(self, side: ShaftSeries) -> Array:
        """Return the torque that the motor side supplies on top of the joint side's, (N, J) [N*m].

        At rest dry friction is zero here; the chain replaces such samples by `holding`.
        """
        return np.zeros_like(side.torque)

    def inverse(self, joint_side: ShaftSeries) -> ShaftSeries:
        """Return what the motor side needs (inverse)."""
        return joint_side.with_torque(joint_side.torque + self.added(joint_side))

    def holding(self, low: Array, high: Array, position: Array | None = None) -> Span:
        """Return which torques hold an interval of joint-side torques at standstill, (...) [N*m].

        Position of the joint-side shaft (...) [rad]; only elements that depend on it need it.
        """
        return low, high

    def loss(self, joint_side: ShaftSeries) -> Array | None:
        """Return the dissipated power (N, J) [W] from the element's own law, or None."""
        return None

    def stored(self, joint_side: ShaftSeries) -> Array | None:
        """Return the rate of energy stored in the element (N, J) [W], or None."""
        return None

    @property
    def gearing(self) -> Scalars:
        """How many times faster the motor side turns."""
        return 1.0


def gearing(elements: Iterable[Element]) -> Scalars:
    """Return how many times faster the motor's shaft turns than the joint, elements in a row."""
    return math.prod((element.gearing for element in elements), start=1.0)


@dataclass(frozen=True, eq=False)
class Ratio(Element, law="ratio"):
    """Speed divided from motor side to joint side, torque multiplied, power kept."""

    #: Motor-side over joint-side speed [1].
    ratio: Scalars = number("ratio", "positive", 1.0, needed=True)

    def inverse(self, joint_side: ShaftSeries) -> ShaftSeries:
        """Return the faster shaft with the smaller torque."""
        return joint_side.geared(self.ratio, joint_side.torque / self.ratio)

    def holding(self, low: Array, high: Array, position: Array | None = None) -> Span:
        """Scale the interval."""
        return low / self.ratio, high / self.ratio

    @property
    def gearing(self) -> Scalars:
        """The ratio."""
        return self.ratio


@dataclass(frozen=True, eq=False)
class Friction(Element, law="friction"):
    """Friction as a sum of terms; those that a shaft does not have are zero, none gives energy.

    Note:
        At standstill dry friction holds with its whole level, whatever `rise` and `travel`.
    """

    coulomb: Scalars = number("torque")  #: Dry friction at every speed and load [N*m].
    #: Per transmitted torque, dimensionless; below 1, or no load could drive the shaft.
    load: Scalars = number("ratio", "share")
    viscous: Scalars = number("viscous friction")  #: Per speed [N*m*s/rad].
    #: By which dry friction is larger forward and smaller backward [N*m].
    skew: Scalars = number("torque", "signed")
    excess: Scalars = number("torque")  #: Break-away less Coulomb friction [N*m].
    #: At which 1/e of the excess is left [rad/s].
    stribeck_speed: Scalars = number("angular velocity", "positive", 1.0)
    quadratic: Scalars = 0.0  #: Per squared speed [N*m*s^2/rad^2].
    when_driving: Scalars = number("ratio")  #: Besides `load` while the motor drives the load.
    #: Besides `load` while the load drives the motor; together below 1.
    when_driven: Scalars = number("ratio")
    #: Transition velocity of dry friction after a reversal; 0 for a jump [rad/s].
    rise: Scalars = 0.0
    #: Presliding displacement, in place of a velocity; 0 for none [rad].
    travel: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        together = np.less(np.add(self.load, self.when_driven), 1.0)
        require(together, self.name, "when_driven and load together must be below 1")
        within = np.less_equal(np.abs(self.skew), self.coulomb)
        require(within, self.name, "skew must not exceed coulomb: it would give energy")

    @property
    def of_load(self) -> bool:
        """Whether it depends on the transmitted torque."""
        return any(np.any(x) for x in (self.load, self.when_driving, self.when_driven))

    def share(self, drives: Mask) -> Scalars:
        """Return friction per transmitted torque, by whether the motor drives, (N, J)."""
        return self.load + np.where(drives, self.when_driving, self.when_driven)

    def sense(self, side: ShaftSeries) -> Array:
        """Return the sense of motion, -1 to 1, (N, J)."""
        if self.travel > 0.0:
            columns = zip(side.position.T, side.direction.T, strict=True)
            return np.stack([presliding(side.time, q, d, self.travel) for q, d in columns], axis=1)
        if not np.any(self.rise):
            return side.direction
        width = np.maximum(np.sqrt(2.0) * np.asarray(self.rise), 1e-300)
        return np.where(np.asarray(self.rise) > 0.0, erf(side.velocity / width), side.direction)

    def added(self, side: ShaftSeries) -> Array:
        """Return the friction torque, (N, J) [N*m]."""
        sense, v = self.sense(side), side.velocity
        torque = self.coulomb * sense + self.viscous * v
        if np.any(self.skew):
            torque = torque + self.skew * np.abs(sense)
        if np.any(self.excess):
            torque = torque + self.excess * np.exp(-((v / self.stribeck_speed) ** 2)) * sense
        if np.any(self.quadratic):
            torque = torque + self.quadratic * v * np.abs(v)
        return torque + self.share(side.torque * sense > 0.0) * np.abs(side.torque) * sense

    def holding(self, low: Array, high: Array, position: Array | None = None) -> Span:
        """Widen the interval by the whole dry friction at each end; monotone as shares are < 1."""
        dry = self.coulomb + self.excess
        return (
            low - (dry - self.skew) - self.share(low < 0.0) * np.abs(low),
            high + (dry + self.skew) + self.share(high > 0.0) * np.abs(high),
        )

    def loss(self, joint_side: ShaftSeries) -> Array:
        """Return friction torque times speed, (N, J) [W]."""
        return self.added(joint_side) * joint_side.velocity


@dataclass(frozen=True, eq=False)
class Inertia(Element, law="inertia"):
    """Torque for the acceleration of a shaft; stores kinetic energy and dissipates nothing.

    Note:
        Counted here, reflected rotor inertia must not stand in the rigid-body model as well.
    """

    inertia: Scalars = number("inertia", needed=True)  #: About the shaft [kg*m^2].

    def added(self, side: ShaftSeries) -> Array:
        """Return inertia times acceleration; nothing at standstill."""
        return self.inertia * side.acceleration

    def stored(self, joint_side: ShaftSeries) -> Array:
        """Return the rate of kinetic energy, (N, J) [W]."""
        return self.added(joint_side) * joint_side.velocity
