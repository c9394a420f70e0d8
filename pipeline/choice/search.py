"""All designs of a group of joints against a day: limits, net energy and energy out of the supply.

A chain of ratio n with friction per load c, dry friction C, viscous friction b and inertia J needs

    T = tau / n + (c / n) |tau| s + C s + (b n) w + (J n) dw/dt,        s = sgn w,

which is theta . x: five coefficients of the design times five series of the joint. With the motor's
k and R its power is P = T n w + (R / k^2) T^2, so that over any weights of the samples

    net energy = n (sum W w x) . theta + (R / k^2) theta . G theta,      G = sum W x x^T,

exactly as the chain integrates it; the root mean square of T is the same with the weights of a
piecewise linear series. Peaks of |T| and of |R T / k + k n w| are maxima of linear functions of x:
they lie on the convex hull of its samples. A driver conducts as its resistance R_d added to R does,
and takes R_d |I| of the voltage: a sum of magnitudes is convex, too. At rest the chain gives the
holding torque of least magnitude, sgn(tau) max(0, (1 - c) |tau| / n - C - brake), which is no
product: those samples go one by one, and so do what flows back and is lost, P < 0, and switching,
which goes with |T|. The first only adds, and |T| >= sgn(tau) T: so the net energy with that is a
lower bound by which most designs need not be looked at sample by sample.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from actuators.arrays import Array
from actuators.energy.energy import BUS
from pipeline.choice.loads import Load
from pipeline.choice.parts.designs import Designs
from pipeline.choice.track import SPEED, Account, Track

#: Numbers of a block of designs times samples: 0.8 MB, which stay in the cache.
BLOCK = 100_000
_MANY = 50  # samples, or designs, from which on a hull is worth finding


@dataclass(frozen=True, eq=False)
class Demanded:
    """What a day asks of one group of joints."""

    name: str  #: Of the group.
    joints: tuple[str, ...]  #: Its joints.
    tracks: tuple[Track, ...]  #: The modes.

    @classmethod
    def of(cls, name: str, joints: Sequence[str], loads: Sequence[Load]) -> Demanded:
        """One group's part of every mode."""
        total = sum(load.mode.hours for load in loads)
        tracks = []
        for load in loads:
            tracks.append(Track(load, load.series.of(joints), load.mode.hours / total))
        return cls(name, tuple(joints), tuple(tracks))

    @cached_property
    def hull(self) -> Array:
        """Samples at which a linear function of the five series can be extreme, (H, 5)."""
        return extreme(self.samples)

    @property
    def samples(self) -> Array:
        """The five series of every mode where a joint moves, (N, 5)."""
        return np.concatenate([t.x[:, ~t.rest].T for t in self.tracks])

    def limits(self, designs: Designs) -> dict[str, Array]:
        """Share of each limit that is used, by its name, (D,)."""
        theta, k, n = designs.theta, designs.torque_constant, designs.ratio
        points = self.hull if len(designs) > _MANY else self.samples
        fastest = np.abs(points[:, SPEED]).max(initial=0.0)
        peak, volts = np.zeros(len(designs)), np.zeros(len(designs))
        for rows in _blocks(len(designs), max(len(points), 1)):
            current = theta[rows] @ points.T / k[rows, None]
            peak[rows] = np.abs(current).max(axis=1, initial=0.0)
            dropped = np.abs(current) * designs.driver_resistance[rows, None]
            current *= designs.resistance[rows, None]
            current += (k[rows] * n[rows])[:, None] * points[:, SPEED]
            volts[rows] = (np.abs(current) + dropped).max(axis=1, initial=0.0)
        rms, means = np.zeros(len(designs)), []
        for track in self.tracks:
            mean = torque_rms(track, designs)
            means.append(mean)
            rms = np.maximum(rms, mean)
            if track.rest.any():
                held = self._held(track, designs) / k
                peak = np.maximum(peak, held)
                volts = np.maximum(volts, (designs.resistance + designs.driver_resistance) * held)
        tau = [np.abs(track.series.torque).max() for track in self.tracks]
        lasting = [np.sqrt((track.weight @ track.series.torque**2).max()) for track in self.tracks]
        use = {
            "peak current": peak / designs.peak_current,
            "continuous current": rms / k / designs.continuous_current,
            "voltage": volts / designs.voltage,
            "driver's supply": designs.bus_use,
            "motor's speed": fastest * n / designs.max_speed,
            "gear's speed": fastest * n / designs.gear_speed,
            "gear's peak torque": max(tau) / designs.gear_peak,
            "gear's continuous torque": max(lasting) / designs.gear_continuous,
        }
        # Heat counts where nothing else is exceeded, at the joint of most current.
        left = np.flatnonzero(np.all([x <= 1.0 for x in use.values()], axis=0))
        copper = designs.resistance / k**2 * np.stack(means) ** 2  # (M, D) [W]
        use["winding temperature"] = np.zeros(len(designs))
        hours = [track.load.mode.hours for track in self.tracks]
        use["winding temperature"][left] = designs.taken(left).heat_use(hours, copper[:, left].T)
        return use

    @staticmethod
    def _held(track: Track, designs: Designs) -> Array:
        """Greatest torque of a motor at rest, (D,): that of the greatest load."""
        tau = np.abs(track.series.torque[track.rest]).max()
        free = designs.coulomb + designs.brake_torque * track.engaged
        return np.maximum(np.maximum(1.0 - designs.load, 0.0) * tau / designs.ratio - free, 0.0)

    def net(self, designs: Designs) -> Array:
        """A lower bound of `power`: what flows back is all used again, (D,) [W]."""
        theta = designs.theta
        out = np.zeros(len(designs))
        for track in self.tracks:
            if track.rest.any():
                one = Demanded(self.name, self.joints, (track,))
                out += one.power(designs, Account(policy=BUS))
                continue
            gram = track.grams
            each = designs.ratio * (theta @ gram[SPEED])
            each += designs.ohmic * np.einsum("di,di->d", theta @ gram, theta)
            each += designs.switched * np.maximum(theta @ track.signs, 0.0)
            each += len(self.joints) * (designs.brake_power + designs.idle)
            out += track.share * each
        return out

    def power(self, designs: Designs, account: Account) -> Array:
        """Mean over the mission out of the supply, sample by sample, (D,) [W]."""
        out = np.zeros(len(designs))
        for track in self.tracks:
            for rows in _blocks(len(designs), track.series.torque.size):
                own = designs.taken(np.arange(len(designs))[rows])
                out[rows] += track.share * track.supplied(own, account)
        return out


@dataclass(frozen=True, eq=False)
class Feedback:
    """What the mass of a group's actuators costs the robot, about the mass it was computed with."""

    mass: float = 0.0  #: Of one actuator, in the demand that is searched [kg].
    others: float = 0.0  #: What other groups take for a kilogram at every joint of this one [W/kg].
    #: The group's demand with `step` more at every joint of it; None for no feedback.
    heavier: Demanded | None = None
    step: float = 0.1  #: [kg].

    def cost(self, demanded: Demanded, designs: Designs) -> Array:
        """Of the mass of designs beside `mass`, linear in it, (D,) [W]."""
        if self.heavier is None:
            return np.zeros(len(designs))
        own = (self.heavier.net(designs) - demanded.net(designs)) / self.step
        return np.asarray((designs.mass - self.mass) * (own + self.others))


def shared(groups: Sequence[tuple[Demanded, Designs]], account: Account) -> Array:
    """Mean over the mission of what a bus of all joints and the hotel load dumps, (D,) [W].

    Each group has its D designs: the first of all are one robot, and so on.
    """
    out = np.zeros(len(groups[0][1]))
    for k, track in enumerate(groups[0][0].tracks):
        total = np.full((len(out), len(track.weight), 1), account.hotel)
        for demanded, designs in groups:
            own = demanded.tracks[k]
            torque = own.torque(designs)
            total[:, :, 0] += own.power(designs, torque).sum(axis=2)
            total[:, :, 0] += (designs.idle * own.drivers(designs, torque))[:, None]
        out += track.share * (track.forward(total) - track.forward(total, 1.0))
    return out


def extreme(points: Array) -> Array:
    """Points (H, K) among (N, K) on whose convex hull all others lie; all where they are few.

    Directions in which the points do not differ, or only with others, are left out for the hull.
    """
    if len(points) < _MANY:
        return points
    centred = points - points.mean(axis=0)
    scale = np.maximum(np.abs(centred).max(axis=0), 1e-300)
    _, size, axes = np.linalg.svd(centred / scale, full_matrices=False)
    flat = (centred / scale) @ axes[size > 1e-9 * size[0]].T
    if flat.shape[1] < 2:
        return points
    try:
        return np.asarray(points[ConvexHull(flat).vertices])
    except QhullError:
        return points


def torque_rms(track: Track, designs: Designs) -> Array:
    """Of the motor's torque at the joint where it is greatest, (D,) [N*m]."""
    theta, out = designs.theta, np.zeros(len(designs))
    if not track.rest.any():
        i, k = np.triu_indices(5)
        squares = track.squares[:, i, k].T * np.where(i == k, 1.0, 2.0)[:, None]
        for rows in _blocks(len(designs), len(i)):
            out[rows] = (theta[rows][:, i] * theta[rows][:, k] @ squares).max(axis=1)
        return np.asarray(np.sqrt(np.maximum(out, 0.0)))
    for rows in _blocks(len(designs), track.series.torque.size):
        torque = track.torque(designs.taken(np.arange(len(designs))[rows]))
        a, b = torque[:, :-1], torque[:, 1:]
        square = np.einsum("dnj,n->dj", a * a + a * b + b * b, track.step) / 3.0
        out[rows] = np.sqrt(square.max(axis=1) / track.load.duration)
    return out


def _blocks(count: int, size: int) -> Iterator[slice]:
    """Of rows, so that rows times size is bounded."""
    rows = max(BLOCK // max(size, 1), 1)
    return (slice(first, first + rows) for first in range(0, count, rows))
