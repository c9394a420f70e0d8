"""Elasticity and play read off two positions of a joint, where a log holds the motor's, too.

What the motor is ahead of the joint, x = q_motor / n - q_joint, follows the torque t between them:

    x = x_0 + t / k + (w / 2) sgn(t) + (h / 2) sgn(v)

a line for a spring of stiffness k, a step for play of width w, a loop for friction between motor
and spring. The side of the play is unknown while the torque is small against its own noise and the
loop: such rows are left out. The torque is the log's own, brought to the joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from actuators.arrays import Array, Mask
from pipeline.effects.model_file import Edit
from pipeline.identification.results import Found
from pipeline.identification.settings import (
    COVER,
    CROSSING,
    FRICTION_SHARE,
    LEAST_ROWS,
    ONE_SIDE,
    SEEN,
    SURE_SIGN,
)
from pipeline.logs.log import TEST, Log
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Simulator

#: Why the gap in torque has no say: the torque hardly shows it.
READ_OFF: Final = "read off two positions"
#: Stiffness of what does not bend [N*m/rad].
_RIGID: Final = 1e12
_BLOCKS: Final = 24


def read_off_two(model: MachineModel, measurements: Sequence[Log], first: int) -> tuple[Found, ...]:
    """Findings of the logs that may be learnt from; test rows are not looked at.

    Args:
        model: With all that was named: friction does not deflect what lies behind it.
        measurements: Logs.
        first: Number of the first finding.
    """
    out: dict[str, Found] = {}
    for one in measurements:
        known = (one.part >= 0) & (one.part != TEST)
        if one.channels[0] != "torque" or not known.any() or one.windup is None:
            continue
        learnt = replace(one, mask=one.mask & known[:, None])
        prediction, plain = Simulator(learnt).predict(model), two_sides(learnt)
        friction = learnt.smooth(prediction.effort[..., 0] - prediction.torque)[..., None]
        for joint, seen in two_sides(replace(learnt, effort=learnt.effort - friction)).items():
            largest = float(np.nanmax(np.abs(one.effort[known, one.joints.index(joint), 0])))
            found = _found(joint, _wider(seen, plain.get(joint, seen)), largest)
            if found is not None:
                out.setdefault(joint, found)
    return tuple(replace(f, order=first + k) for k, f in enumerate(out.values()))


def _wider(seen: TwoSides, plain: TwoSides) -> TwoSides:
    """With half of what friction changes as an error, too: its law is none that holds exactly."""

    def wider(own: tuple[float, float], other: float) -> tuple[float, float]:
        other = other if np.isfinite(other) else own[0]
        return own[0], float(np.hypot(own[1], 0.5 * (own[0] - other) / COVER))

    compliance = wider(seen.compliance, plain.compliance[0])
    return replace(seen, compliance=compliance, width=wider(seen.width, plain.width[0]))


def _found(joint: str, seen: TwoSides, largest: float) -> Found | None:
    if not (seen.plays or seen.elastic):
        return None
    rigid = (_RIGID,) * 3
    value, *ends = np.clip(seen.stiffness, 1.0, _RIGID).tolist() if seen.elastic else rigid
    parameters = {"stiffness": {"value": value, "unit": "N*m/rad", "interval": tuple(ends)}}
    if seen.plays:
        width, error = (float(x) for x in seen.width)
        ends = [max(width - COVER * error, 0.0), width + COVER * error]
        parameters["width"] = {"value": width, "unit": "rad", "interval": tuple(ends)}
        parameters["crossing"] = {"value": CROSSING * largest, "unit": "N*m"}
    name = "backlash" if seen.plays else "joint_elasticity"
    edit = Edit.model_validate({"effect": name, "place": (joint,), "parameters": parameters})
    return Found(order=0, edits=(edit,), law=READ_OFF)


@dataclass(frozen=True)
class TwoSides:
    """What two positions of a joint tell, each with its standard error."""

    compliance: tuple[float, float]  #: 1 / k [rad/(N*m)].
    width: tuple[float, float]  #: Of the play [rad]; NaN where the torque has one sign only.
    loop: tuple[float, float]  #: h [rad].

    @property
    def elastic(self) -> bool:
        """Whether a spring shows: a wind-up with the torque, and not against it."""
        return self.compliance[0] > SEEN * self.compliance[1]

    @property
    def plays(self) -> bool:
        """Whether play shows."""
        return self.width[0] > SEEN * self.width[1]

    @property
    def stiffness(self) -> tuple[float, float, float]:
        """K of a spring that shows, with the ends of its 95 % interval [N*m/rad]."""
        c, e = self.compliance
        return 1.0 / c, 1.0 / (c + COVER * e), 1.0 / max(c - COVER * e, 1e-300)


def two_sides(log: Log) -> dict[str, TwoSides]:
    """Joint to what its two positions tell, where it has two and a torque shows it."""
    out: dict[str, TwoSides] = {}
    if log.windup is None or log.rate_noise is None:
        return out
    for j, joint in enumerate(log.joints):
        effort, noise = log.effort[:, j, 0], float(log.noise[j, 0])
        # While the filter sees the torque change sides, a step is no step yet.
        side = log.smooth(np.sign(effort)[:, None])[:, 0]
        good = log.mask[:, j] & (np.abs(side) > ONE_SIDE)
        rest = 3.0 * float(log.rate_noise[0, j])
        seen = read_off(log.windup[:, j], effort, log.v[:, j], good, noise, rest)
        if seen is not None:
            out[joint] = seen
    return out


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
    friction = FRICTION_SHARE * float(np.sqrt(np.sum(torque[good] ** 2) / max(good.sum(), 1)))
    sure = max(SURE_SIGN * noise, friction)
    found = None
    for _ in range(3):
        rows = np.flatnonzero(good & (np.abs(torque) > sure))
        if rows.size < LEAST_ROWS or np.ptp(torque[rows]) < 10.0 * noise:
            break
        t, side = torque[rows], np.sign(torque[rows])
        both = 0.05 < float((side > 0).mean()) < 0.95
        columns = [np.ones_like(t), t, 0.5 * np.sign(velocity[rows]), 0.5 * side]
        told = _by_blocks(np.stack(columns[: 3 + both], axis=1), ahead[rows])
        found = TwoSides(told[1], told[3] if both else (np.nan, np.nan), told[2])
        # Friction between motor and spring: the spring's torque is that much off the motor's.
        loop = abs(found.loop[0]) / found.compliance[0] / 2.0 if found.elastic else 0.0
        wider = SURE_SIGN * noise + loop
        if wider <= sure * 1.01 or wider > 0.5 * float(np.abs(torque[good]).max()):
            break
        sure = wider
    return found


def _by_blocks(x: Array, y: Array) -> list[tuple[float, float]]:
    """Least squares; standard errors from the scatter between consecutive blocks of rows."""
    scale = np.abs(x).max(axis=0)
    design = x / scale
    inverse = np.linalg.pinv(design.T @ design)
    solution = np.linalg.lstsq(design, y, rcond=None)[0]
    scores = design * (y - design @ solution)[:, None]
    sums = np.stack([block.sum(axis=0) for block in np.array_split(scores, _BLOCKS)])
    errors = np.sqrt(np.diag(inverse @ (sums.T @ sums) @ inverse) * _BLOCKS / (_BLOCKS - 1.0))
    return [*zip((solution / scale).tolist(), (errors / scale).tolist(), strict=True)]
