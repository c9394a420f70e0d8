"""Designs of a group of joints against the modes of a day: one plain pass over the samples.

A chain of ratio n with friction per load c, dry friction C, viscous friction b and inertia J (all
at the motor) needs, with s = sgn w of the joint,

    T = (tau + c |tau| s) / n + C s + b n w + J n dw/dt        while the joint moves,
    (1 - c) |tau| / n - C  <=  |T|  <=  (1 + c) |tau| / n + C    at rest, at a `place` between,

and a joint that locks, by its gear (c >= 1) or a closed brake, no current. The power is
P = T n w + R T^2 / k^2, and the driver's loss. Tests hold it against `actuators.chain`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from actuators.arrays import Array, Mask
from pipeline.choice.loads import Load
from pipeline.choice.mission import Mode
from pipeline.choice.shelf import Designs

#: Numbers of a block of designs times samples: 0.8 MB, which stay in the cache.
_BLOCK: Final = 100_000
#: Where in the band of friction the holding torque lies, by the word of the option.
PLACES: Final = {"least": 0.0, "middle": 0.5, "most": 1.0}
CAUSES: Final = ("mechanical", "winding", "friction", "driver", "brakes", "returned", "idle")


class Held(NamedTuple):
    """What is not known of a load."""

    place: float | Array = PLACES["middle"]  #: In the friction band, one or (D, J) [1].
    demand: float | Array = 1.0  #: Factor on the joint's torque, one or (D,) [1].


NOMINAL: Final = Held()


@dataclass(frozen=True, eq=False)
class ModeSeries:
    """One mode at the joints of a group."""

    mode: Mode
    share: float  #: Of the mission's time; 0 for what is beside it.
    torque: Array  #: With the masses of `Demand.mass`, (N, J) [N*m].
    slope: Array  #: Rise of it with the mass of one actuator of each group, (G, N, J) [N*m/kg].
    velocity: Array  #: (N, J) [rad/s].
    acceleration: Array  #: (N, J) [rad/s^2].
    direction: Array  #: Sign of the velocity as `ShaftSeries` decides it, (N, J).
    step: Array  #: Between samples, (N - 1,) [s].

    @property
    def weight(self) -> Array:
        """Of each sample in the mean over the mode, (N,)."""
        half = 0.5 * self.step
        return np.asarray((np.append(half, 0.0) + np.append(0.0, half)) / self.step.sum())

    @property
    def braked(self) -> bool:
        """Whether brakes are closed."""
        return self.mode.stands and self.mode.hold == "brake"


@dataclass(frozen=True, eq=False)
class Demand:
    """What a day asks of every group, and how it changes with the mass of the actuators."""

    mass: Array  #: Of one actuator of each group, with which it was computed, (G,) [kg].
    #: The modes; then the standing ones once more, locked; then the load cases.
    groups: Mapping[str, Sequence[ModeSeries]]

    @classmethod
    def of(
        cls, groups: Mapping[str, Sequence[str]], mass: Array, *every: Sequence[Load], nudge: float
    ) -> Demand:
        """From the modes' loads, and the same with `nudge` kg more at every joint of one group."""
        loads, *heavier = every
        total = sum(load.mode.hours for load in loads)
        out = {}
        for name, joints in groups.items():
            tracks = []
            for k, load in enumerate(loads):
                one = load.series.of(joints)
                more = [own[k].series.of(joints).torque - one.torque for own in heavier]
                slope = np.stack(more) / nudge if more else np.zeros((len(mass), 1, 1))
                series = (one.torque, slope, one.velocity, one.acceleration, one.direction)
                share = load.mode.hours / total
                tracks.append(ModeSeries(load.mode, share, *series, np.diff(one.time)))
            held = [t for t in tracks if t.mode.stands and t.share and t.mode.hold != "none"]
            # As a robot that locks stands: brakes closed, drivers of locked joints off.
            modes = [replace(t.mode, hold="brake", drivers=False) for t in held]
            locked = [replace(t, mode=m, share=0.0) for t, m in zip(held, modes, strict=True)]
            count = sum(track.share > 0.0 for track in tracks)
            out[name] = [*tracks[:count], *locked, *tracks[count:]]
        return cls(mass, out)


@dataclass(frozen=True, eq=False)
class Evaluated:
    """Designs of one group in every mode."""

    power: Array  #: Mean out of the supply, (D, M) [W]; 0 in load cases.
    use: Mapping[str, Array]  #: Share of each limit that is used, by its name, (D, M).
    #: Where the power goes, (D, M) [W], which sums to it; empty without detail, as what follows.
    causes: Mapping[str, Array]
    series: Sequence[Array]  #: Sum of the joints' power with idle, of each mode (D, N) [W].

    @cached_property
    def most(self) -> Array:
        """Greatest use of any limit in any mode, (D,)."""
        return np.asarray(np.max([*self.use.values()], axis=0).max(axis=1))


def evaluate(
    tracks: Sequence[ModeSeries],
    designs: Designs,
    recovered: float,
    more: Array,
    held: Held = NOMINAL,
    *,
    detail: bool = False,
) -> Evaluated:
    """Every design (D,) in every mode of a group.

    `recovered`: share of what a joint returns that is used again [1]. `more`: mass of one actuator
    of each group beyond the tracks' own, (G,), or (D, G) where each design is in a robot of its own
    [kg]. `held`: what is not known of the load. `detail`: whether causes and series are kept.
    """
    count, modes = len(designs), len(tracks)
    power = np.zeros((count, modes))
    causes = {name: np.zeros((count, modes)) for name in CAUSES if detail}
    use: dict[str, Array] = {}
    series: list[Array] = []
    for m, track in enumerate(tracks):
        size = count if detail else max(_BLOCK // max(track.torque.size, 1), 1)
        for first in range(0, count, size):
            rows = slice(first, min(first + size, count))
            own = designs.taken(np.arange(count)[rows])
            part = more[rows] if more.ndim == 2 else more[None]
            place, demand = (x[rows] if isinstance(x, np.ndarray) else x for x in held)
            factor = np.reshape(demand, (-1, 1, 1))
            tau = factor * track.torque + np.tensordot(factor[:, 0] * part, track.slope, axes=1)
            one = _Pass(track, own, tau, place)
            for name, share in one.limits().items():
                use.setdefault(name, np.zeros((count, modes)))[rows, m] = share
            if not track.mode.hours:  # a load case, which costs nothing
                continue
            flow = one.flow
            spent = one.mean_out(flow, recovered)
            off = 0.0 if track.mode.drivers else one.switched_off
            idle = own.idle * (track.torque.shape[1] - off)
            power[rows, m] = spent + idle
            if detail:
                for name, value in {**one.causes(flow, spent), "idle": idle}.items():
                    causes[name][rows, m] = value
                series.append(flow.sum(axis=2) + idle[:, None])
    return Evaluated(power, use, causes, series)


def _column(values: Array) -> Array:
    """Of designs, against samples and joints (D, 1, 1)."""
    return values[:, None, None]


class _Pass:
    """A block of designs in one mode; arrays (D, N, J)."""

    def __init__(
        self, track: ModeSeries, designs: Designs, tau: Array, place: float | Array
    ) -> None:
        self.track, self.designs, self.tau, self.size = track, designs, tau, np.abs(tau)
        rest: Mask = track.direction == 0.0
        self.holds = designs.locks(track.braked)
        self.speed = track.velocity * ~rest  # of the joints where they move, (N, J) [rad/s]
        ratio, load, s = designs.ratio, designs.load, track.direction
        fixed = np.stack([s, self.speed, track.acceleration * ~rest])
        own = np.stack([designs.coulomb, designs.viscous * ratio, designs.inertia * ratio], axis=1)
        torque = np.tensordot(own, fixed, axes=1)
        torque += _column(1.0 / ratio) * (tau * ~rest)
        torque += _column(load / ratio) * (self.size * s)
        self.most_held = np.zeros(len(designs))
        if rest.any():
            n, c, dry = map(_column, (ratio, load, designs.coulomb))
            least = np.maximum((1.0 - c) * self.size / n - dry, 0.0)
            most = ((1.0 + c) * self.size / n + dry) * (track.mode.hold != "none")
            at = np.reshape(place, (*np.shape(place)[:1], 1, -1)) if np.ndim(place) else place
            band = (least + at * (most - least)) * _column(np.where(self.holds, 0.0, 1.0))
            torque = np.where(rest, np.sign(tau) * band, torque)
            self.most_held = (most * rest).max(axis=(1, 2)) * ~self.holds
        self.torque, self.effort = torque, np.abs(torque)
        #: Voltage without the driver's over k, (D, N, J).
        self.volts = torque * _column(designs.resistance / designs.torque_constant**2)
        self.volts += np.tensordot(ratio[:, None], self.speed[None], axes=1)

    @property
    def flow(self) -> Array:
        """Power out of the supply before anything returns, idle apart (D, N, J) [W]."""
        d = self.designs
        out = self.torque * _column(d.driver_resistance / d.torque_constant**2)
        out += self.volts
        out *= self.torque
        out += _column(d.switched) * self.effort
        out += _column(d.brake_power * (not self.track.braked))
        return np.asarray(out)

    def mean_out(self, power: Array, recovered: float) -> Array:
        """Mean out of the supply, less the share of what flows back that is used again, (D,) [W].

        Between two samples of opposite sign the power passes through zero on a straight line.
        """
        weight, step = self.track.weight, self.track.step
        net = (weight @ power).sum(axis=1)
        sign = power < 0.0
        if recovered == 1.0 or not sign.any():
            return np.asarray(net)
        out = 0.5 * (net + (weight @ np.abs(power)).sum(axis=1))
        turns = sign[:, :-1] != sign[:, 1:]
        d, n, j = np.unravel_index(np.flatnonzero(turns), turns.shape)
        a, b = np.abs(power[d, n, j]), np.abs(power[d, n + 1, j])
        tip = 0.5 * step[n] * (a * (b / np.maximum(a + b, 1e-300))) / step.sum()
        out -= np.bincount(d, tip, minlength=len(power))
        return np.asarray(out - recovered * (out - net))

    @property
    def switched_off(self) -> Array:
        """Drivers without work: those of joints that lock, (D,)."""
        still = (self.torque == 0.0).all(axis=1)
        return np.asarray((still & self.holds[:, None]).sum(axis=1) * 1.0)

    def causes(self, flow: Array, spent: Array) -> dict[str, Array]:
        """Where the power goes, (D,) [W]; friction is what is left, rotors included."""
        d, weight = self.designs, self.track.weight
        square = np.einsum("dnj,n->d", self.torque**2, weight) / d.torque_constant**2
        size = np.einsum("dnj,n->d", self.effort, weight)
        out = {
            "mechanical": np.einsum("dnj,n->d", self.tau * self.speed, weight) * np.ones(len(d)),
            "winding": d.resistance * square,
            "driver": d.driver_resistance * square + d.switched * size,
            "brakes": d.brake_power * (0.0 if self.track.braked else self.torque.shape[2]),
            "returned": spent - np.einsum("dnj,n->d", flow, weight),
        }
        return out | {"friction": spent - sum(out.values())}

    def limits(self) -> dict[str, Array]:
        """Share of each limit that is used, (D,).

        A load case is momentary: torque against the gear's momentary peak without a margin, and
        the motor has to be able to lift from there.
        """
        d, track = self.designs, self.track
        case, k = track.mode.hours == 0.0, d.torque_constant
        peak = np.maximum(self.effort.max(axis=(1, 2)), self.most_held * case)
        volts = np.abs(self.volts)
        volts += self.effort * _column(d.driver_resistance / k**2)
        tau = self.size.max(axis=(1, 2))
        fastest = np.abs(self.speed).max(initial=0.0) * d.ratio
        brake = tau / d.ratio / np.maximum(d.brake_torque, 1e-300)
        use = {
            "motor's peak current": peak / k / d.peak_current,
            "voltage": k * volts.max(axis=(1, 2)) / d.voltage,
            "driver's supply": d.bus_use,
            "motor's speed": fastest / d.max_speed,
            "gear's speed": fastest / d.gear_speed,
            "gear's peak torque": tau / (d.gear_momentary if case else d.gear_peak),
            "brake's torque": np.where((d.brake_torque > 0.0) & track.braked, brake, 0.0),
        }
        if not case:
            lasting = (track.weight @ self.tau**2).max(axis=1)
            mean = (track.weight @ np.abs(self.speed)).max()
            use["gear's mean speed"] = mean * d.ratio / d.gear_mean_speed
            use["gear's continuous torque"] = np.sqrt(lasting) * np.ones(len(d)) / d.gear_continuous
            # Between two samples the torque is on a straight line.
            across = track.step @ (self.torque[:, :-1] * self.torque[:, 1:]) / track.step.sum()
            square = (2.0 * track.weight @ self.torque**2 + across).max(axis=1) / 3.0
            current = np.sqrt(square) / k
            still = d.standstill if track.mode.stands else 1.0
            use["motor's continuous current"] = current / d.continuous_current / still
        return use
