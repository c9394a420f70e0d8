"""Planned motions of fixed-base machines: sines, strokes, via points with rests, steps."""

from __future__ import annotations

from functools import partial
from typing import Final

import numpy as np

from tests.blind.machines.machine import Course


def sines(rng: np.random.Generator, joints: int, duration: float, dt: float) -> Course:
    """Five sines per joint from 0.1 to 2 Hz about a drawn middle, from rest."""
    t = np.arange(round(duration / dt)) * dt
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


def moves(
    rng: np.random.Generator,
    joints: int,
    duration: float,
    dt: float,
    *,
    speeds: tuple[float, float],
    rest: float,
    far: tuple[float, float],
) -> Course:
    """Polynomials of fifth order from place to place, each at a pace of its own.

    Args:
        rng: For places, paces and rests.
        joints: Number J.
        duration: [s].
        dt: Step [s].
        speeds: Bounds of a stroke's largest speed [rad/s].
        rest: Longest rest between two strokes [s].
        far: Bounds of a stroke's length [rad].
    """
    t = np.arange(round(duration / dt)) * dt
    q, v, a = (np.zeros((t.size, joints)) for _ in range(3))
    for j in range(joints):
        here, start = float(rng.uniform(-0.5, 0.5)), 0
        while start < t.size:
            there = float(np.clip(here + rng.choice([-1, 1]) * rng.uniform(*far), -1.2, 1.2))
            speed, way = float(np.exp(rng.uniform(*np.log(speeds)))), there - here
            # A whole number of steps, so that every stroke ends at rest where the next begins.
            steps = max(int(np.ceil(max(1.875 * abs(way) / speed, 0.25) / dt)), 2)
            stop, length = min(start + steps, t.size), steps * dt
            s = np.arange(stop - start) / steps
            q[start:stop, j] = here + way * s**3 * (10 - 15 * s + 6 * s**2)
            v[start:stop, j] = way / length * 30 * s**2 * (1 - s) ** 2
            a[start:stop, j] = way / length**2 * 60 * s * (1 - s) * (1 - 2 * s)
            here, start = there, stop
            stop = min(start + round(rng.uniform(0, rest) / dt), t.size) if rest else start
            q[start:stop, j] = here
            start = stop
    return Course(t, q, v, a)


#: Strokes at many speeds one after the other, random via points with rests, and short quick moves
#: as steps through a reference filter.
MOTIONS: Final = {
    "sines": sines,
    "strokes": partial(moves, speeds=(0.15, 1.8), rest=0.0, far=(0.3, 1.3)),
    "rests": partial(moves, speeds=(0.3, 2.5), rest=0.6, far=(0.2, 1.3)),
    "steps": partial(moves, speeds=(1.0, 3.0), rest=0.4, far=(0.1, 0.6)),
}
