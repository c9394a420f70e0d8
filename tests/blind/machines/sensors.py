"""What a drive and its encoders log: late, rounded, with noise in colour."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from tests.blind.machines.machine import Course, Machine
from tests.blind.machines.plant import Array, Plant

MOTOR_COUNTS: Final = 4096  # of an encoder at the motor, per turn of the motor
_FORCE_NOISE: Final = 0.5  # of a foot sensor [N]


def with_sensors(rng: np.random.Generator, plant: Plant, torque: Array) -> Plant:
    """Noise of 0.4 to 2 % of a joint's torque, white and slow, and encoders of 12 to 19 bits."""
    # A wrist that carries next to nothing has the noise of its drive, not of its load.
    size = np.maximum(torque.std(axis=0), 0.02 * float(torque.std(axis=0).max()))
    white = size * np.exp(rng.uniform(np.log(0.004), np.log(0.02), size.size))
    return replace(
        plant,
        rate=float(rng.choice([500.0, 1000.0])),
        white=white,
        coloured=white * rng.uniform(0.2, 0.8, size.size),
        memory=float(rng.uniform(0.01, 0.05)),
        bits=int(rng.choice([12, 16, 16, 19])),
        velocity=float(rng.choice([0.0, 0.0, 0.01])),
    )


def sampled(course: Course, plant: Plant) -> NDArray[np.intp]:
    """Rows of what happened that are logged."""
    every = round(1.0 / (plant.rate * course.dt))
    return np.arange(every, course.time.size - every, every)


def exact_torque(course: Course, plant: Plant) -> Array:
    """Torque that a sensor without noise reads in every logged row, shape (N, J) [N*m].

    A row's torque is the mean over one period of the log, centred on the instant at which the
    encoders are read, as an anti-aliasing filter without phase makes it.
    """
    rows = sampled(course, plant)
    half = int(rows[0]) // 2
    weight = np.full(2 * half + 1, 1.0 / (2 * half + 1))
    out = []
    for x in course.torque.T:
        mean = np.convolve(np.pad(x, half, mode="edge"), weight, mode="valid")
        out.append(np.interp(course.time[rows] - plant.delay, course.time, mean))
    return np.stack(out, axis=1) * plant.gain + plant.offset


def measure(
    machine: Machine, plant: Plant, course: Course, rng: np.random.Generator
) -> dict[str, Array]:
    """The log's columns, each (N,)."""
    rows, torque = sampled(course, plant), exact_torque(course, plant)
    torque += plant.white * rng.standard_normal(torque.shape)
    keep = np.exp(-1.0 / (plant.rate * plant.memory))
    slow = lfilter([np.sqrt(1 - keep**2)], [1, -keep], rng.standard_normal(torque.shape), axis=0)
    torque += plant.coloured * slow
    out: dict[str, Array] = {"time_s": course.time[rows] - course.time[rows[0]]}
    for j, joint in enumerate(machine.joints):
        if plant.sides != "motor":
            seen = course.q[rows, j] + plant.zero[j]
            out[f"{joint}__position_rad"] = np.rint(seen / plant.resolution) * plant.resolution
        if plant.sides != "joint":
            turned = machine.ratio[j] * (course.motor[rows, j] + plant.zero[j])
            step = 2 * np.pi / MOTOR_COUNTS
            out[f"{joint}__motor_position_rad"] = np.rint(turned / step) * step
        if plant.velocity > 0:
            noise = plant.velocity * rng.standard_normal(rows.size)
            out[f"{joint}__velocity_rad_s"] = course.v[rows, j] + noise
        out[f"{joint}__torque_Nm"] = torque[:, j]
    if machine.robot is not None:
        for k, leg in enumerate(machine.robot.spec.legs):
            noise = _FORCE_NOISE * rng.standard_normal(rows.size)
            out[f"{leg.foot}__force_z_N"] = course.feet[rows, k] + noise
        out["base__roll_rad"], out["base__pitch_rad"] = np.zeros((2, rows.size))
    return out
