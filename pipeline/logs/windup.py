"""Elasticity and play read off two positions of a joint.

What the motor is ahead of the joint, x = q_motor / n - q_joint, follows the torque t between them:

    x = x_0 + t / k + (w / 2) sgn(t) + (h / 2) sgn(v)

a line for a spring of stiffness k, a step for play of width w, a loop for friction between motor
and spring. The side of the play is unknown while the torque is small against its own noise and the
loop: such rows are left out. The torque is the log's own, brought to the joint.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from actuators.arrays import Array, Mask
from pipeline.logs.log import Log

#: Standard deviations from which a slope or a step counts as seen.
SEEN: Final = 4.0
#: Torques below this many standard deviations do not tell their sign.
_SURE: Final = 3.0
#: ... nor below this share of its root mean square, which friction may be.
_FRICTION: Final = 0.25
_BLOCKS: Final = 24
_LEAST_ROWS: Final = 60
#: Share of what a filter sees that must have the torque's sign.
_ONE_SIDE: Final = 0.98


def two_sides(log: Log) -> dict[str, TwoSides]:
    """Joint to what its two positions tell, where it has two and a torque shows it."""
    out: dict[str, TwoSides] = {}
    if log.windup is None or log.rate_noise is None:
        return out
    for j, joint in enumerate(log.joints):
        if not np.isfinite(log.windup[:, j]).any():
            continue
        effort = log.effort[:, j, 0]
        # While the filter sees the torque change sides, a step is no step yet.
        side = log.smooth(np.sign(effort)[:, None])[:, 0]
        good = log.mask[:, j] & (np.abs(side) > _ONE_SIDE)
        rest = 3.0 * float(log.rate_noise[0, j])
        noise = float(log.noise[j, 0])
        seen = read_off(log.windup[:, j], effort, log.v[:, j], good, noise, rest)
        if seen is not None:
            out[joint] = seen
    return out


@dataclass(frozen=True)
class TwoSides:
    """What two positions of a joint tell."""

    compliance: tuple[float, float]  #: 1 / k [rad/(N*m)], and its standard error.
    #: Of the play [rad], and its standard error; NaN where the torque has one sign only.
    width: tuple[float, float]
    loop: tuple[float, float]  #: h, and its standard error [rad].
    scatter: float  #: What is left, root mean square [rad].
    rows: int  #: That were used.

    @property
    def elastic(self) -> bool:
        """Whether a spring shows: a wind-up with the torque, and not against it."""
        return self.compliance[0] > SEEN * self.compliance[1]

    @property
    def plays(self) -> bool:
        """Whether play shows."""
        return bool(self.width[0] > SEEN * self.width[1])

    @property
    def stiffness(self) -> tuple[float, float, float]:
        """K with the ends of its 95 % interval [N*m/rad]; infinite where no spring shows."""
        c, e = self.compliance
        if not self.elastic:
            return np.inf, 1.0 / max(c + 1.96 * e, 1e-300), np.inf
        return 1.0 / c, 1.0 / (c + 1.96 * e), 1.0 / max(c - 1.96 * e, 1e-300)


def read_off(
    ahead: Array, torque: Array, velocity: Array, ok: Mask, noise: float, rest: float
) -> TwoSides | None:
    """Fit line, step and loop; None where the torque hardly changes or too few rows are left.

    Args:
        ahead: Motor over ratio less joint, shape (N,) [rad], at one bandwidth with the torque.
        torque: Between them, shape (N,) [N*m].
        velocity: Of the joint, shape (N,) [rad/s].
        ok: Rows that are good, shape (N,).
        noise: Standard deviation of the torque [N*m].
        rest: Speed below which the joint's direction is not known [rad/s].
    """
    good = ok & np.isfinite(ahead) & np.isfinite(torque) & (np.abs(velocity) > rest)
    # The torque that was logged has friction in it: the side is that of what passes the play.
    sure = max(
        _SURE * noise, _FRICTION * float(np.sqrt(np.mean(torque[good] ** 2))) if good.any() else 0.0
    )
    found = None
    for _ in range(3):
        rows = np.flatnonzero(good & (np.abs(torque) > sure))
        if rows.size < _LEAST_ROWS or np.ptp(torque[rows]) < 10.0 * noise:
            return found
        t, side = torque[rows], np.sign(torque[rows])
        signs = (side > 0).mean()
        both = 0.05 < signs < 0.95
        columns = [np.ones_like(t), t, 0.5 * np.sign(velocity[rows])]
        columns += [0.5 * side] if both else []
        x = np.stack(columns, axis=1)
        solution, errors, scatter = _by_blocks(x, ahead[rows])
        width = (solution[3], errors[3]) if both else (np.nan, np.nan)
        found = TwoSides(
            (float(solution[1]), float(errors[1])),
            (float(width[0]), float(width[1])),
            (float(solution[2]), float(errors[2])),
            scatter,
            rows.size,
        )
        # Friction between motor and spring: the spring's torque is that much off the motor's.
        loop = abs(found.loop[0]) / found.compliance[0] / 2.0 if found.elastic else 0.0
        wider = _SURE * noise + loop
        if wider <= sure * 1.01 or wider > 0.5 * float(np.abs(torque[good]).max()):
            break
        sure = wider
    return found


def _by_blocks(x: Array, y: Array) -> tuple[Array, Array, float]:
    """Least squares; standard errors from the scatter between consecutive blocks of rows."""
    scale = np.abs(x).max(axis=0)
    design = x / scale
    solution, *_ = np.linalg.lstsq(design, y, rcond=None)
    rest = y - design @ solution
    inverse = np.linalg.pinv(design.T @ design)
    edges = np.linspace(0, y.size, _BLOCKS + 1).astype(int)
    scores = np.stack([design[a:b].T @ rest[a:b] for a, b in pairwise(edges)])
    grown = _BLOCKS / (_BLOCKS - 1.0)
    errors = np.sqrt(np.diag(inverse @ (scores.T @ scores) @ inverse) * grown)
    return solution / scale, errors / scale, float(np.sqrt(np.mean(rest**2)))
