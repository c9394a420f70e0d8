"""Planned motions of fixed-base machines: sines, strokes, via points with rests, steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from actuators.arrays import Array


@dataclass(frozen=True)
class Course:
    """What the links do, at uniform times."""

    time: Array  #: Shape (N,) [s].
    q: Array  #: Shape (N, J) [rad].
    v: Array  #: [rad/s].
    a: Array  #: [rad/s^2].
    #: Configuration, velocity and acceleration of the base, (N, 7), (N, 6), (N, 6); None for a
    #: fixed base.
    body: tuple[Array, Array, Array] | None = None
    #: Legs that stand, for every row; empty for a fixed base.
    stances: tuple[tuple[str, ...], ...] = ()

    @property
    def dt(self) -> float:
        """Step [s]."""
        return float(self.time[1] - self.time[0])


def _times(duration: float, dt: float) -> Array:
    return np.arange(round(duration / dt), dtype=np.float64) * dt


def sines(rng: np.random.Generator, joints: int, duration: float, dt: float) -> Course:
    """Five sines per joint from 0.1 to 2 Hz about a drawn middle, from rest."""
    t = _times(duration, dt)
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


def _stroke(s: Array, far: float, length: float) -> tuple[Array, Array, Array]:
    """Polynomial of fifth order from rest to rest: way, speed, acceleration."""
    return (
        far * s**3 * (10 - 15 * s + 6 * s**2),
        far / length * 30 * s**2 * (1 - s) ** 2,
        far / length**2 * 60 * s * (1 - s) * (1 - 2 * s),
    )


def _moves(
    rng: np.random.Generator,
    joints: int,
    duration: float,
    dt: float,
    speeds: tuple[float, float],
    rest: float,
    far: tuple[float, float],
) -> Course:
    """Place to place, each stroke at a pace of its own, with rests up to `rest` [s] between."""
    t = _times(duration, dt)
    q, v, a = (np.zeros((t.size, joints)) for _ in range(3))
    for j in range(joints):
        here, start = float(rng.uniform(-0.5, 0.5)), 0
        while start < t.size:
            there = float(np.clip(here + rng.choice([-1, 1]) * rng.uniform(*far), -1.2, 1.2))
            speed = float(np.exp(rng.uniform(*np.log(speeds))))
            # A whole number of steps, so that every stroke ends at rest where the next begins.
            steps = max(int(np.ceil(max(1.875 * abs(there - here) / speed, 0.25) / dt)), 2)
            stop = min(start + steps, t.size)
            way, rate, gain = _stroke(np.arange(stop - start) / steps, there - here, steps * dt)
            q[start:stop, j], v[start:stop, j], a[start:stop, j] = here + way, rate, gain
            here, start = there, stop
            stop = min(start + round(rng.uniform(0, rest) / dt), t.size) if rest else start
            q[start:stop, j] = here
            start = stop
    return Course(t, q, v, a)


def strokes(rng: np.random.Generator, joints: int, duration: float, dt: float) -> Course:
    """Strokes at many speeds, one after the other."""
    return _moves(rng, joints, duration, dt, (0.15, 1.8), 0.0, (0.3, 1.3))


def rests(rng: np.random.Generator, joints: int, duration: float, dt: float) -> Course:
    """Random via points with rests of up to 0.6 s."""
    return _moves(rng, joints, duration, dt, (0.3, 2.5), 0.6, (0.2, 1.3))


def steps(rng: np.random.Generator, joints: int, duration: float, dt: float) -> Course:
    """Short quick moves with rests of up to 0.4 s, as steps through a reference filter."""
    return _moves(rng, joints, duration, dt, (1.0, 3.0), 0.4, (0.1, 0.6))


MOTIONS: Final = {"sines": sines, "strokes": strokes, "rests": rests, "steps": steps}
