"""Which feet stand: from forces, contact columns, the gait's schedule or the lowest feet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Mask
from pipeline.errors import GaitError
from pipeline.logs.errors import PreparationError
from pipeline.logs.reading.log import Log
from pipeline.motion.gait import gait_of
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.robot import Robot

#: A foot stands above this share of the largest vertical force any foot carries ...
TOUCH: Final = 0.05
#: ... and lifts off below this one, so that noise does not make it chatter.
LIFT: Final = 0.02
#: A foot this near to the lowest foot stands [m].
LOWEST: Final = 0.005


@dataclass(frozen=True)
class Contact:
    """Which feet stand."""

    feet: tuple[str, ...]  #: Names of legs.
    standing: Mask  #: Shape (N, F).
    source: str  #: ``"forces"``, ``"columns"``, ``"schedule"`` or ``"lowest feet"``.

    def rows(self, index: NDArray[np.intp]) -> Contact:
        """At other rows."""
        return replace(self, standing=self.standing[index])


def log_contact(log: Log) -> Contact | None:
    """Contact as the log itself states it: from forces, else from contact columns, else None."""
    if log.foot_force is not None:
        return Contact(log.feet, _standing_by_force(log.foot_force[..., 2]), "forces")
    if log.contact is not None:
        return Contact(log.feet, log.contact, "columns")
    return None


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


def scheduled_contact(robot: Robot, time: Array, *, start: float) -> Contact:
    """Contact by the robot file's gait, of which a period begins at `start` [s].

    Raises:
        PreparationError: The robot file has no gait.
    """
    try:
        gait = gait_of(robot.spec)
    except GaitError as error:
        raise PreparationError(f"{error}; or log foot forces or contacts") from None
    share = ((time - start) / gait.period) % 1.0
    standing = np.zeros((time.size, len(robot.leg_names)), dtype=np.bool_)
    for begin, end, stance in gait.footfall.stances():
        rows = (share >= begin) & (share < end)
        standing[rows] = [leg in stance for leg in robot.leg_names]
    return Contact(robot.leg_names, standing, "schedule")


def lowest_feet(robot: Robot, position: Array, roll: Array | None, pitch: Array | None) -> Contact:
    """Contact by kinematics: feet within `LOWEST` of the lowest one, along the vertical.

    Args:
        robot: With legs.
        position: Joint positions, shape (N, J) [rad].
        roll: Of the base, shape (N,) [rad]; level where it is None.
        pitch: Likewise.
    """
    n = position.shape[0]
    shaped = robot.layout.by_leg(position)
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


def find_contact(log: Log, robot: Robot, *, start: float | None = None) -> Contact:
    """Contact from forces, else contact columns, else the schedule, else the lowest feet.

    `start` is the time at which a gait period begins [s]; None where it is not known.

    Raises:
        PreparationError: A start is given for a robot without a gait.
    """
    own = log_contact(log)
    if own is not None:
        return own
    if start is not None:
        return scheduled_contact(robot, log.time, start=start)
    return lowest_feet(robot, log.position, log.base_roll, log.base_pitch)


def changes_of_stance(contact: Contact | None, pieces: Sequence[slice]) -> NDArray[np.intp]:
    """Rows at which other feet stand than in the row before, not across gaps, shape (E,)."""
    if contact is None:
        return np.empty(0, dtype=np.intp)
    changed = (contact.standing[1:] != contact.standing[:-1]).any(axis=1)
    changed[[piece.start - 1 for piece in pieces if piece.start > 0]] = False
    return np.flatnonzero(changed) + 1
