"""Motions of the standard matrix: sums of sines, and strokes from rest to rest at many speeds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Course:
    """What the links do.

    Attributes:
        time: Uniform, shape (N,) [s].
        q: Shape (N, J) [rad].
        v: [rad/s].
        a: [rad/s^2].
    """

    time: Array
    q: Array
    v: Array
    a: Array

    @property
    def dt(self) -> float:
        """Step [s]."""
        return float(self.time[1] - self.time[0])


def sines(rng: np.random.Generator, joints: int, duration: float, dt: float) -> Course:
    """Five sines per joint from 0.1 to 2 Hz, about a drawn middle."""
    t = np.arange(round(duration / dt), dtype=np.float64) * dt
    q, v, a = (np.empty((t.size, joints)) for _ in range(3))
    for j in range(joints):
        w = 2 * np.pi * np.array([0.12, 0.3, 0.65, 1.1, 1.7]) * rng.uniform(0.85, 1.15, 5)
        size = np.array([1.0, 0.6, 0.3, 0.15, 0.07]) * rng.uniform(0.7, 1.3, 5)
        phase = rng.uniform(0, 2 * np.pi, 5)
        wave = np.sin(np.outer(t, w) + phase)
        scale = rng.uniform(0.5, 1.1) / np.abs(wave @ size).max()
        q[:, j] = rng.uniform(-0.5, 0.5) + scale * (wave @ size)
        v[:, j] = scale * (np.cos(np.outer(t, w) + phase) @ (size * w))
        a[:, j] = -scale * (wave @ (size * w**2))
    return Course(t, q, v, a)


def strokes(rng: np.random.Generator, joints: int, duration: float, dt: float) -> Course:
    """From place to place by polynomials of fifth order, each stroke at a pace of its own."""
    t = np.arange(round(duration / dt), dtype=np.float64) * dt
    q, v, a = (np.empty((t.size, joints)) for _ in range(3))
    for j in range(joints):
        here, start = float(rng.uniform(-0.5, 0.5)), 0
        while start < t.size:
            there = float(np.clip(here + rng.choice([-1, 1]) * rng.uniform(0.3, 1.3), -1.2, 1.2))
            speed = float(np.exp(rng.uniform(np.log(0.15), np.log(1.8))))
            # A whole number of steps, so that every stroke ends at rest where the next begins.
            steps = max(int(np.ceil(max(1.875 * abs(there - here) / speed, 0.3) / dt)), 2)
            stop = min(start + steps, t.size)
            s = np.arange(stop - start) / steps
            far, length = there - here, steps * dt
            q[start:stop, j] = here + far * s**3 * (10 - 15 * s + 6 * s**2)
            v[start:stop, j] = far / length * 30 * s**2 * (1 - s) ** 2
            a[start:stop, j] = far / length**2 * 60 * s * (1 - s) * (1 - 2 * s)
            here, start = there, stop
    return Course(t, q, v, a)
