"""One mode at a group's joints: its series, their moments, and what designs take in it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from actuators.arrays import Array, Mask
from actuators.energy.energy import BUS
from actuators.shaft import ShaftSeries
from pipeline.choice.loads import Load
from pipeline.choice.parts.designs import Designs

SPEED = 3  # the series w among the five


@dataclass(frozen=True)
class Account:
    """What is counted besides motors and drivers."""

    hotel: float = 0.0  #: Of the robot's electronics [W].
    #: What becomes of returned power, see `actuators.energy.energy`; on a bus, all that a
    #: group returns counts as used, and `shared` tells what is not.
    policy: str = "none"
    fraction: float = 0.0  #: Share of it that is used again, with policy ``fraction`` [1].

    @property
    def recovered(self) -> float:
        """Share of what a joint returns that is used again [1]."""
        return 1.0 if self.policy == BUS else self.fraction


@dataclass(frozen=True, eq=False)
class Track:
    """One mode at the joints of a group."""

    load: Load  #: The mode, of all joints.
    series: ShaftSeries  #: Of the group's joints.
    share: float  #: Of the mission's time.

    @cached_property
    def x(self) -> Array:
        """The five series, (5, N, J)."""
        one = self.series
        s = one.direction
        each = (one.torque, np.abs(one.torque) * s, s, one.velocity, one.acceleration)
        return np.stack([part * (s != 0.0) for part in each])

    @cached_property
    def rest(self) -> Mask:
        """Samples at rest, (N, J)."""
        return self.series.direction == 0.0

    @cached_property
    def step(self) -> Array:
        """Between samples, (N - 1,) [s]."""
        return np.diff(self.series.time)

    @cached_property
    def weight(self) -> Array:
        """Of each sample in the mean over the mode, (N,)."""
        return (
            np.append(0.5 * self.step, 0.0) + np.append(0.0, 0.5 * self.step)
        ) / self.load.duration

    @cached_property
    def grams(self) -> Array:
        """Of the mean of a product, trapezoids, summed over the joints (5, 5)."""
        flat = self.x.reshape(5, -1)
        weights = np.repeat(self.weight, self.series.torque.shape[1])
        return np.asarray((flat * weights) @ flat.T)

    @cached_property
    def signs(self) -> Array:
        """Of the mean of a product times the sign of the joint's torque, (5,)."""
        sign = np.sign(self.series.torque)
        return np.asarray(np.einsum("inj,nj,n->i", self.x, sign, self.weight))

    @cached_property
    def squares(self) -> Array:
        """Of the mean square of a piecewise linear product, of every joint (J, 5, 5)."""
        a, b = self.x[:, :-1], self.x[:, 1:]
        h = self.step / (3.0 * self.load.duration)
        same = np.einsum("inj,n,knj->jik", a, h, a) + np.einsum("inj,n,knj->jik", b, h, b)
        cross = np.einsum("inj,n,knj->jik", a, h, b)
        return np.asarray(same + 0.5 * (cross + cross.transpose(0, 2, 1)))

    @property
    def engaged(self) -> bool:
        """Whether brakes hold at rest."""
        return self.load.mode.engaged

    def torque(self, designs: Designs) -> Array:
        """Of the motors, (D, N, J) [N*m]."""
        shape = (len(designs), *self.series.torque.shape)
        out = np.asarray((designs.theta @ self.x.reshape(5, -1)).reshape(shape))
        if self.rest.any():
            tau = self.series.torque[self.rest]
            free = designs.coulomb + designs.brake_torque * self.engaged
            passed = np.maximum(1.0 - designs.load, 0.0) / designs.ratio
            held = np.maximum(np.abs(tau) * passed[:, None] - free[:, None], 0.0)
            out[:, self.rest] = held * np.sign(tau)
        return out

    def power(self, designs: Designs, torque: Array) -> Array:
        """Electrical into drivers and the brakes' coils, without idle power, (D, N, J) [W]."""
        out = torque * designs.ohmic[:, None, None]
        out += designs.ratio[:, None, None] * self.x[SPEED]
        out *= torque
        if designs.switching.any():
            out += designs.switched[:, None, None] * np.abs(torque)
        if designs.brake_power.any():
            drawn = 1.0 * (~self.rest | (not self.engaged))
            out += designs.brake_power[:, None, None] * drawn
        return out

    def supplied(self, designs: Designs, account: Account) -> Array:
        """Mean power out of the supply in this mode, with drivers, (D,) [W]."""
        torque = self.torque(designs)
        power = self.power(designs, torque)
        out = self.forward(power, account.recovered)
        return out + designs.idle * self.drivers(designs, torque)

    def forward(self, power: Array, recovered: float = 0.0) -> Array:
        """Mean of power (D, N, K) that does not flow back, less a share of what does, (D,) [W]."""
        if recovered == 1.0:
            return np.asarray(np.einsum("dnj,n->d", power, self.weight))
        out = np.einsum("dnj,n->d", np.maximum(power, 0.0), self.weight)
        sign = power < 0.0
        changes = sign[:, :-1] != sign[:, 1:]
        d, n, j = np.unravel_index(np.flatnonzero(changes), changes.shape)
        a, b = np.abs(power[d, n, j]), np.abs(power[d, n + 1, j])
        both = np.maximum(a + b, 1e-300)
        tip = 0.5 * self.step[n] * (a * (b / both)) / self.load.duration
        out -= np.bincount(d, tip, minlength=len(power))
        if recovered:
            out -= recovered * (out - np.einsum("dnj,n->d", power, self.weight))
        return np.asarray(out)

    def drivers(self, designs: Designs, torque: Array) -> Array:
        """How many are on, (D,): where the mode lets them, those of joints that lock are not."""
        joints = torque.shape[2]
        if self.load.mode.drivers:
            return np.full(len(torque), float(joints))
        current = (torque != 0.0).any(axis=1)
        return np.asarray((current | ~designs.locks(self.engaged)[:, None]).sum(axis=1) * 1.0)
