"""Friction that changes from beginning to end, or from run to run: a machine that warms.

What a simulation leaves of an effort is laid over the direction of motion and the direction times
time, with what else a model may have wrong (an offset, viscous friction, inertia, gravity's share
and direction). The coefficient of the product is the drift; its scatter is that between blocks of
the logs, since what is left is no white noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from actuators.arrays import Array

#: Blocks per log.
_BLOCKS: Final = 8
#: Standard deviations from which friction drifts, and the least change per level.
_SEEN: Final = 4.0
_LEAST: Final = 0.1
_LEAST_ROWS: Final = 400
#: A machine warms over minutes, or from one run to the next [s].
_WARMING: Final = 60.0


@dataclass(frozen=True)
class Course:
    """One joint along one log, rows that count only."""

    time: Array  #: Shape (N,) [s].
    rest: Array  #: Measured minus simulated effort, shape (N,).
    simulated: Array  #: Effort, shape (N,).
    q: Array  #: Position [rad].
    v: Array  #: Velocity [rad/s].
    a: Array  #: Acceleration [rad/s^2].


@dataclass(frozen=True)
class Drift:
    """How a joint's friction changes."""

    first: float  #: Level at the beginning of the first log, in the effort's unit.
    last: float  #: Level at the end of the last.
    error: float  #: Standard error of their difference.

    @property
    def seen(self) -> bool:
        """Whether the change stands out from the scatter and matters."""
        change = abs(self.last - self.first)
        return change > _SEEN * self.error and change > _LEAST * abs(self.first)


def friction_drift(courses: Sequence[Course]) -> Drift | None:
    """Friction of one joint over logs in the order they were recorded.

    Several logs count as runs one after the other, whatever their clocks say. None where a single
    log is too short for a machine to warm, or too little moves both ways.
    """
    length = sum(float(np.ptp(c.time)) for c in courses if c.time.size)
    if len(courses) < 2 and length < _WARMING:
        return None
    designs, rests, blocks = [], [], []
    begin = 0.0
    for k, c in enumerate(courses):
        if c.time.size == 0:
            continue
        span = float(np.ptp(c.time))
        when = (begin + c.time - c.time[0]) / length - 0.5
        begin += span
        way = np.sign(c.v)
        columns = [way, way * when, np.ones_like(way), c.v, c.a, c.simulated]
        designs.append(np.stack([*columns, np.sin(c.q), np.cos(c.q)], axis=1))
        rests.append(c.rest)
        blocks.append(k * _BLOCKS + np.arange(way.size) * _BLOCKS // way.size)
    x, y, block = np.concatenate(designs), np.concatenate(rests), np.concatenate(blocks)
    if y.size < _LEAST_ROWS or min((x[:, 0] > 0).mean(), (x[:, 0] < 0).mean()) < 0.1:
        return None
    x = x / np.maximum(np.abs(x).max(axis=0), 1e-300)  # both signs of motion reach one
    solution, *_ = np.linalg.lstsq(x, y, rcond=None)
    inverse, left = np.linalg.pinv(x.T @ x), y - x @ solution
    scores = np.stack([x[block == b].T @ left[block == b] for b in np.unique(block)])
    spread = inverse @ (scores.T @ scores) @ inverse
    grown = scores.shape[0] / max(scores.shape[0] - x.shape[1], 1)
    top = float(np.abs(np.concatenate([d[:, 1] for d in designs])).max())
    change = float(solution[1]) / top
    error = float(np.sqrt(spread[1, 1] * grown)) / top
    level = float(solution[0])
    return Drift(level - 0.5 * change, level + 0.5 * change, error)
