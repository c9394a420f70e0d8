"""Which feet stand: by forces, else by contact columns, else the lowest feet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import pandas as pd

from actuators.arrays import Array, Mask
from pipeline.logs.filters import LowPass, smoother_noise
from pipeline.logs.log import Recording
from pipeline.logs.sampling import Grid, Rows
from pipeline.logs.speeds import within
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.robot import Robot

#: A foot stands above this share of the largest vertical force any foot carries ...
TOUCH: Final = 0.05
#: ... and lifts off below this one, so that noise does not make it chatter.
LIFT: Final = 0.02
#: A foot this near to the lowest foot stands [m].
LOWEST: Final = 0.005
#: Share of a log's rows by which its noise can be told.
_CALM: Final = 0.1


class Contact(NamedTuple):
    """Which feet stand."""

    feet: tuple[str, ...]  #: Names of legs.
    standing: Mask  #: Shape (N, F).
    source: str  #: ``"forces"``, ``"columns"`` or ``"lowest feet"``.


def find_contact(log: Recording, robot: Robot | None = None) -> Contact | None:
    """Contact from forces, else contact columns, else the lowest feet.

    Args:
        log: As read.
        robot: With legs; None for one whose feet nothing but its log tells of.
    """
    force, touching = log.foot_force, log.contact
    if force is not None:
        return Contact(log.feet, _standing_by_force(force[..., 2]), "forces")
    if touching is not None:
        return Contact(log.feet, touching, "columns")
    return None if robot is None else _lowest(robot, log)


def changes(standing: Mask, pieces: Sequence[slice]) -> Mask:
    """Rows to either side of a change of each foot's stance, (N, F), none across gaps."""
    out = np.zeros_like(standing)
    for piece in pieces:
        own, changed = standing[piece], out[piece]
        changed[1:] = own[1:] != own[:-1]
        changed[:-1] |= changed[1:]
    return out


def _standing_by_force(normal: Array) -> Mask:
    """Schmitt trigger on the vertical force, shape (N, F)."""
    full = max(float(np.nanmax(normal, initial=0.0)), 1e-9)
    decided = np.where(normal > TOUCH * full, 1.0, np.where(normal < LIFT * full, 0.0, np.nan))
    # Undecided samples keep the last decision.
    return np.asarray(pd.DataFrame(decided).ffill().to_numpy() > 0.5)


def _lowest(robot: Robot, log: Recording) -> Contact:
    """Feet within `LOWEST` of the lowest one along the vertical."""
    n, shaped = len(log), robot.chains.by_leg(log.position)
    feet = np.concatenate(
        [foot_positions(robot.chains, shaped[i : i + 4096]) for i in range(0, n, 4096)]
    )
    r, p = (
        np.zeros(n) if angle is None else angle
        for angle in (log.of("base_roll"), log.of("base_pitch"))
    )
    # Third row of R_y(pitch) R_x(roll): the vertical in the base frame.
    up = np.stack([-np.sin(p), np.sin(r) * np.cos(p), np.cos(r) * np.cos(p)], axis=-1)
    height = np.einsum("nfi,ni->nf", feet, up)
    standing = height <= height.min(axis=1, keepdims=True) + LOWEST
    return Contact(robot.leg_names, standing, "lowest feet")


def calm_rows(contact: Contact | None, grid: Grid, lowpass: LowPass) -> Mask:
    """Rows (N,) of a grid by which noise is told: no filter there sees a change of stance.

    The ground's forces jump at one, and legs change stance so often that such rows may be half of
    all: a median takes their jumps for noise. All rows where hardly any other is left.
    """
    if contact is None:
        return np.ones(grid.time.size, dtype=np.bool_)
    change = changes(contact.standing[grid.nearest], grid.pieces)
    calm = np.asarray(~within(change, grid.pieces, 2 * lowpass.half).any(axis=1))
    return calm if calm.mean() > _CALM else np.ones_like(calm)


def feet_on_rows(
    log: Recording,
    contact: Contact,
    legs: Sequence[str],
    grid: Grid,
    rows: Rows,
    force: Array | None,
    quiet: tuple[Mask, LowPass],
) -> dict[str, Any]:
    """Which feet stand, their forces [N] as filtered, and the noise of a sample of one's component.

    Sensors of feet in the air show noise alone, or nothing at all.
    """
    stands = contact.standing[grid.nearest]
    standing = stands[rows][:, [contact.feet.index(leg) for leg in legs]]
    measured = log.foot_force
    if force is None or measured is None:
        return {"standing": standing}
    feet = [log.feet.index(leg) for leg in legs]
    # A component that no column gives is NaN from end to end.
    absent = np.asarray(np.isnan(measured).all(axis=0))[feet]
    force = np.where(standing[..., None], np.where(absent, np.nan, force[:, feet]), 0.0)
    flat = grid.resample(np.nan_to_num(measured.reshape(len(log), -1)))
    good = np.repeat(stands & quiet[0][:, None], 3, axis=1)
    shaking = smoother_noise(flat, good, grid.pieces, quiet[1])
    shaking = shaking[np.isfinite(shaking) & (shaking > 0.0)]
    floor = float(np.median(shaking)) if shaking.size else None
    return {"standing": standing, "foot_force": force, "foot_noise": floor}
