"""Which feet stand: by forces, else by contact columns, the gait's schedule, or the lowest feet."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError
from pipeline.logs.recording import Recording
from pipeline.motion.gait import gait_of
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.robot import Robot

#: A foot stands above this share of the largest vertical force any foot carries ...
TOUCH: Final = 0.05
#: ... and lifts off below this one, so that noise does not make it chatter.
LIFT: Final = 0.02
#: A foot this near to the lowest foot stands [m].
LOWEST: Final = 0.005


class Contact(NamedTuple):
    """Which feet stand."""

    feet: tuple[str, ...]  #: Names of legs.
    standing: Mask  #: Shape (N, F).
    source: str  #: ``"forces"``, ``"columns"``, ``"schedule"`` or ``"lowest feet"``.


def find_contact(
    log: Recording, robot: Robot | None = None, *, start: float | None = None
) -> Contact | None:
    """Contact from forces, else contact columns, else the schedule, else the lowest feet.

    Args:
        log: As read.
        robot: With legs; None for one whose feet nothing but its log tells of.
        start: Time at which a gait period begins [s]; None where it is not known.

    Raises:
        LegwattError: A start is given for a robot without a gait.
    """
    force, touching = log.foot_force, log.contact
    if force is not None:
        return Contact(log.feet, _standing_by_force(force[..., 2]), "forces")
    if touching is not None:
        return Contact(log.feet, touching, "columns")
    if robot is None:
        return None
    if start is not None:
        return _scheduled(robot, log.time, start)
    return _lowest(robot, log.position, log.of("base_roll"), log.of("base_pitch"))


def _standing_by_force(normal: Array) -> Mask:
    """Schmitt trigger on the vertical force, shape (N, F)."""
    full = max(float(np.nanmax(normal, initial=0.0)), 1e-9)
    with np.errstate(invalid="ignore"):
        decided = np.where(normal > TOUCH * full, 1, np.where(normal < LIFT * full, 0, -1))
    decided[0] = np.where(decided[0] < 0, 0, decided[0])
    # Undecided samples keep the last decision.
    index = np.where(decided >= 0, np.arange(decided.shape[0])[:, None], 0)
    last = np.maximum.accumulate(index, axis=0)
    return np.asarray(np.take_along_axis(decided, last, axis=0) == 1)


def _scheduled(robot: Robot, time: Array, start: float) -> Contact:
    """By the robot file's gait, of which a period begins at `start` [s]."""
    try:
        gait = gait_of(robot.spec)
    except LegwattError as error:
        raise LegwattError(f"{error}; or log foot forces or contacts") from None
    share = ((time - start) / gait.period) % 1.0
    standing = np.zeros((time.size, len(robot.leg_names)), dtype=np.bool_)
    for begin, end, stance in gait.footfall.stances():
        rows = (share >= begin) & (share < end)
        standing[rows] = [leg in stance for leg in robot.leg_names]
    return Contact(robot.leg_names, standing, "schedule")


def _lowest(robot: Robot, position: Array, roll: Array | None, pitch: Array | None) -> Contact:
    """Feet within `LOWEST` of the lowest one along the vertical, by positions (N, J)."""
    n = position.shape[0]
    shaped = robot.chains.by_leg(position)
    feet = np.concatenate(
        [foot_positions(robot.chains, shaped[i : i + 4096]) for i in range(0, n, 4096)]
    )
    r = np.zeros(n) if roll is None else roll
    p = np.zeros(n) if pitch is None else pitch
    # Third row of R_y(pitch) R_x(roll): the vertical in the base frame.
    up = np.stack([-np.sin(p), np.sin(r) * np.cos(p), np.cos(r) * np.cos(p)], axis=-1)
    height = np.einsum("nfi,ni->nf", feet, up)
    standing = height <= height.min(axis=1, keepdims=True) + LOWEST
    return Contact(robot.leg_names, standing, "lowest feet")
