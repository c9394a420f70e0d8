"""Torque by where a shaft stands: parallel spring and ripple by their laws, or a table without one.

A spring and a ripple give back on the other half of a closed path what they take on one. The table
is that of one joint over angle, direction, speed and the way it came:

    torque = level(q) + s friction(q) + s drag(|v|) + sum_k memory_k p_k

with s the sense of motion and lines between knots that stay level beyond them. p_k, -1 to 1, is how
far the joint pushes what follows it with a play of width 2 radius_k: hysteresis is a sum of such
plays (Prandtl and Ishlinskii; Visintin, "Differential Models of Hysteresis", Springer, 1994).
"""

from dataclasses import dataclass

import numpy as np

from actuators.arrays import Array, Scalars
from actuators.elements.element import GAP, NEEDS_POSITION, Element, Span
from actuators.parameters import number, require
from actuators.shaft import ShaftSeries


@dataclass(frozen=True, eq=False)
class PositionTorque(Element, law="parallel_spring"):
    """What the motor side has to supply in addition because of where the shaft stands.

        torque = stiffness (position - rest) + amplitude sin(order position + phase)

    A spring lies beside the drive, between the two links, and acts against the displacement.
    Harmonic Drives disturb twice per turn of the wave generator (Tuttle and Seering, IEEE T-RA
    12(3), 1996), motors with slots by their cogging order.
    """

    #: [N*m/rad].
    stiffness: Scalars = number("rotational stiffness", "signed", needed=True)
    rest: Scalars = number("angle", "signed", needed=True)  #: Position without torque [rad].
    amplitude: Scalars = number(rule="signed")  #: [N*m].
    order: Scalars = number("", "signed", 1.0)  #: Periods per turn of the shaft.
    phase: Scalars = number(rule="signed")  #: [rad].

    def torque(self, position: Array) -> Array:
        """Return the additional demand (...) [N*m] at positions (...) [rad]."""
        torque = self.stiffness * (position - self.rest)
        if np.any(self.amplitude):
            torque = torque + self.amplitude * np.sin(self.order * position + self.phase)
        return torque

    def added(self, side: ShaftSeries) -> Array:
        """Return the torque at the series' positions, (N, J) [N*m]."""
        return self.torque(side.position)

    def holding(self, low: Array, high: Array, position: Array | None = None) -> Span:
        """Shift the interval; the position has to be known."""
        require(position is not None, self.name, NEEDS_POSITION)
        torque = self.torque(np.asarray(position))
        return low + torque, high + torque

    def stored(self, joint_side: ShaftSeries) -> Array:
        """Return the rate of potential energy, (N, J) [W]."""
        return self.torque(joint_side.position) * joint_side.velocity


Knots = tuple[float, ...]


@dataclass(frozen=True, eq=False)
class TorqueTable(Element):
    """What the motor side of one joint supplies in addition, by no law."""

    angle: Knots = ()  #: Knots of the angle, ascending, (P,) [rad].
    level: Knots = ()  #: Torque at those, whatever the direction, (P,) [N*m].
    friction: Knots = ()  #: Friction at those, against motion, (P,) [N*m].
    speed: Knots = ()  #: Knots of the speed, ascending from 0, (K,) [rad/s].
    drag: Knots = ()  #: Friction at those, (K,) [N*m].
    radius: Knots = ()  #: Half widths of plays, positive, (R,) [rad].
    memory: Knots = ()  #: Torque of each play that is pushed as far as it goes, (R,) [N*m].

    def __post_init__(self) -> None:
        super().__post_init__()
        pairs = [("angle", "level"), ("angle", "friction"), ("speed", "drag"), ("radius", "memory")]
        for knots, values in pairs:
            x, y = getattr(self, knots), getattr(self, values)
            fits = not y or (len(x) == len(y) and (np.diff(x) > 0.0).all())
            require(fits, self.name, f"{knots} must ascend, with one {values} at each")
            require(np.isfinite(y), self.name, f"{values} must be finite")
        require(np.array(self.radius) > 0.0, self.name, "radius must be positive")

    def rubbing(self, side: ShaftSeries) -> Array:
        """Return what gives no energy back on the whole, (N, 1) [N*m]."""
        out = np.zeros_like(side.position)
        if self.friction:
            out = out + np.interp(side.position, self.angle, self.friction) * side.direction
        if self.drag:
            out = out + np.interp(np.abs(side.velocity), self.speed, self.drag) * side.direction
        for radius, torque in zip(self.radius, self.memory, strict=False):
            if torque:
                pushed = played(side.time, side.position[:, 0], radius)
                out = out + torque * pushed[:, None]
        return out

    def at(self, position: Array) -> Array:
        """Return what hangs on the angle alone (...) [N*m]."""
        if not self.level:
            return np.zeros_like(position)
        return np.asarray(np.interp(position, self.angle, self.level))

    def added(self, side: ShaftSeries) -> Array:
        """Return the torque along a series of one joint, (N, 1) [N*m]."""
        return self.at(side.position) + self.rubbing(side)

    def holding(self, low: Array, high: Array, position: Array | None = None) -> Span:
        """Shift the interval by what hangs on the angle, widen it by friction at rest."""
        require(position is not None, self.name, NEEDS_POSITION)
        at = np.asarray(position)
        dry: Scalars = self.drag[0] if self.drag else 0.0
        if self.friction:
            dry = dry + np.interp(at, self.angle, self.friction)
        level, dry = self.at(at), np.maximum(dry, 0.0)
        return low + level - dry, high + level + dry

    def loss(self, joint_side: ShaftSeries) -> Array:
        """Return what friction and memory take, (N, 1) [W]."""
        return self.rubbing(joint_side) * joint_side.velocity

    def stored(self, joint_side: ShaftSeries) -> Array:
        """Return the rate of potential energy, (N, 1) [W]."""
        return self.at(joint_side.position) * joint_side.velocity


def played(time: Array, position: Array, radius: float) -> Array:
    """Return how far a joint pushes what follows with a play, -1 to 1, (N,), from each gap on."""
    step = np.diff(time)
    usual = float(np.median(step[step > 0.0])) if (step > 0.0).any() else 0.0
    broken = np.concatenate([[True], step > GAP * max(usual, 1e-300)]).tolist()
    follower, out = 0.0, []
    for q, new in zip(position.tolist(), broken, strict=True):
        follower = q if new else min(max(follower, q - radius), q + radius)
        out.append((q - follower) / radius)
    return np.array(out)
