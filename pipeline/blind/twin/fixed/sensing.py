"""What a drive and its encoders log: late by joint, rounded, with noise in colour."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.blind.twin.fixed.simulate import Happened

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FixedSensors:
    """How a machine is measured; arrays of shape (J,).

    Attributes:
        every: Simulated steps per row of the log.
        white: Of the torque, standard deviation of a row [N*m].
        coloured: Slow part of the torque's noise [N*m].
        memory: Time over which that part forgets [s].
        step: To which the torque is rounded [N*m].
        bits: Of the joints' encoders.
        counts: Of the motors' encoders per turn of the motor.
        delay: Of the torque behind the positions [s].
        sides: ``"joint"``, ``"motor"`` or ``"both"``.
        velocity: Noise of a velocity column [rad/s]; zero for none.
        gain: By which torques read too much [1].
        offset: Added to torques [N*m].
        zero: Added to the joints' positions [rad].
    """

    every: int
    white: Array
    coloured: Array
    memory: float
    step: Array
    bits: int
    counts: int
    delay: Array
    sides: str
    velocity: float
    gain: Array
    offset: Array
    zero: Array


@dataclass(frozen=True)
class Measured:
    """A log, with and without noise.

    Attributes:
        columns: Of the log, each (N,).
        exact: Torques without noise and rounding, shape (N, J) [N*m].
        ahead: Motor less joint without noise, shape (N, J) [rad].
        rows: Of the course, shape (N,).
    """

    columns: dict[str, Array]
    exact: Array
    ahead: Array
    rows: NDArray[np.intp]
    noise: dict[str, Any] = field(default_factory=dict)


def measure(
    happened: Happened,
    sensors: FixedSensors,
    joints: tuple[str, ...],
    ratio: Array,
    rng: np.random.Generator,
) -> Measured:
    """Sample, delay, round and spoil."""
    course = happened.course
    n, dt = course.time.size, course.dt
    rows = np.arange(0, n, sensors.every)
    time = course.time[rows]
    exact = np.stack(
        [
            np.interp(time - sensors.delay[j], course.time, _averaged(x, sensors.every))
            for j, x in enumerate(happened.torque.T)
        ],
        axis=1,
    )
    exact = exact * sensors.gain + sensors.offset
    keep = np.exp(-sensors.every * dt / sensors.memory)
    torque = exact + sensors.white * rng.standard_normal(exact.shape)
    torque += _slow(rng.standard_normal(exact.shape), keep) * sensors.coloured
    torque = np.rint(torque / sensors.step) * sensors.step
    seen = course.q[rows] + sensors.zero
    fine = 2 * np.pi / 2**sensors.bits
    columns: dict[str, Array] = {"time_s": time - time[0]}
    for j, joint in enumerate(joints):
        if sensors.sides != "motor":
            columns[f"{joint}__position_rad"] = np.rint(seen[:, j] / fine) * fine
        if sensors.sides != "joint":
            count = 2 * np.pi / sensors.counts
            turned = ratio[j] * happened.motor[rows, j]
            columns[f"{joint}__motor_position_rad"] = np.rint(turned / count) * count
        if sensors.velocity > 0:
            noise = sensors.velocity * rng.standard_normal(rows.size)
            columns[f"{joint}__velocity_rad_s"] = course.v[rows, j] + noise
        columns[f"{joint}__torque_Nm"] = torque[:, j]
    return Measured(columns, exact, (happened.motor - course.q)[rows], rows)


def _averaged(x: Array, every: int) -> Array:
    """Mean over the steps of one row, centred: what a drive's filter gives without delay."""
    width = 2 * (every // 2) + 1
    weight = np.ones(width) / width
    padded = np.pad(x, width // 2, mode="edge")
    return np.convolve(padded, weight, mode="valid")


def _slow(white: Array, keep: float) -> Array:
    """Noise of first order with unit variance from white noise, along the first axis."""
    from scipy.signal import lfilter

    return np.asarray(lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], white, axis=0))
