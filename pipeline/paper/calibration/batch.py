"""Many sets of numbers at once: each set is one column, so that a law is evaluated for all of them.

The middle legs' joints stand one after the other along the samples; where one ends and the next
begins a repeated time stamp keeps integrals apart. Robots come from a bank that is drawn once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuators.chain import Chain
from actuators.energy.energy import split_integral
from actuators.energy.limits import rms_over_time
from actuators.shaft import ShaftSeries
from pipeline.paper.calibration.machine import MIDDLE_LEGS, PUBLISHED_LEG, RobotPart

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Bank:
    """What robots ask of their middle legs; a robot is a column.

    Attributes:
        time: (S, R) [s], all joints one after the other.
        velocity: (S, R) [rad/s].
        acceleration: (S, R) [rad/s^2].
        torque: (S, R) [N*m].
        direction: (S, R).
        standing: Torque of the printed leg's joints, standing, (3, R) [N*m].
    """

    time: Array
    velocity: Array
    acceleration: Array
    torque: Array
    direction: Array
    standing: Array

    @property
    def count(self) -> int:
        """How many columns."""
        return self.time.shape[1]

    @property
    def legs(self) -> dict[str, slice]:
        """The samples of each middle leg."""
        half = len(self.time) // len(MIDDLE_LEGS)
        return {leg: slice(k * half, (k + 1) * half) for k, leg in enumerate(MIDDLE_LEGS)}

    def taken(self, robots: NDArray[np.intp]) -> Bank:
        """One column per set.

        Args:
            robots: Number of the robot of each set, (W,).
        """
        return Bank(
            self.time[:, robots],
            self.velocity[:, robots],
            self.acceleration[:, robots],
            self.torque[:, robots],
            self.direction[:, robots],
            self.standing[:, robots],
        )

    def series(self, rows: slice) -> ShaftSeries:
        """Some samples as one series; the time of each column is its own, `time`."""
        torque = self.torque[rows]
        return ShaftSeries(
            joints=tuple(f"set {k}" for k in range(torque.shape[1])),
            time=np.arange(len(torque), dtype=float),
            position=np.zeros(torque.shape),
            velocity=self.velocity[rows],
            acceleration=self.acceleration[rows],
            torque=torque,
            direction=self.direction[rows],
        )


def bank(parts: list[RobotPart]) -> Bank:
    """A bank of robots; shorter series are filled up with their last sample, without width."""
    length = max(part.series.time.size for part in parts)

    def column(part: RobotPart, name: str) -> Array:
        rows = np.minimum(np.arange(length), part.series.time.size - 1)
        values: Array = getattr(part.series, name)
        if name == "time":
            span = values[-1] - values[0]
            count = part.series.velocity.shape[1]
            return np.concatenate([values[rows] + k * span for k in range(count)])
        return values[rows].T.ravel()

    names = ("time", "velocity", "acceleration", "torque", "direction")
    columns = {name: np.stack([column(part, name) for part in parts], axis=1) for name in names}
    return Bank(**columns, standing=np.stack([part.standing_torque for part in parts], axis=1))


@dataclass(frozen=True)
class BatchOutcome:
    """What an alternative makes of every set.

    Attributes:
        energy: E_el(+) per cycle by leg, (W,) [J].
        excess: Largest motor quantity over its limit, less one, (W,).
        held: Motor torque that holds the printed leg's joints, (3, W) [N*m].
    """

    energy: Mapping[str, Array]
    excess: Array
    held: Array


def drawn(demand: Bank, chain: Chain) -> Array:
    """E_el(+) per cycle of the printed leg, (W,) [J].

    Args:
        demand: One column per set.
        chain: With one number per set.
    """
    rows = demand.legs[PUBLISHED_LEG]
    power = chain.moving(demand.series(rows)).electrical_power
    return split_integral(demand.time[rows], power)[0]


def outcome(demand: Bank, chain: Chain) -> BatchOutcome:
    """Take the demand of every set through an alternative.

    Args:
        demand: One column per set.
        chain: With one number per set.
    """
    walking = chain.moving(demand.series(slice(None)))
    joints = len(MIDDLE_LEGS) * len(demand.standing)
    pairs = zip(np.split(demand.time, joints), np.split(walking.current, joints), strict=True)
    motor = chain.motor
    peaks = (
        np.abs(walking.motor.velocity).max(axis=0) / motor.max_speed,
        np.abs(walking.voltage).max(axis=0) / motor.supply_voltage,
        np.abs(walking.current).max(axis=0) / motor.peak_current,
        np.max([rms_over_time(t, i) for t, i in pairs], axis=0) / motor.continuous_current,
    )
    power = walking.electrical_power
    return BatchOutcome(
        {
            leg: split_integral(demand.time[rows], power[rows])[0]
            for leg, rows in demand.legs.items()
        },
        np.max(peaks, axis=0) - 1.0,
        chain.holding(demand.standing).motor_torque,
    )
