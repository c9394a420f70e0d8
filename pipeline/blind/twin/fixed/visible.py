"""Whether a log could show what is hidden in it, by its own numbers and without the workflow.

What the hidden effect adds to the exact torques is what is left of it once everything a machine may
have anyway is taken out by least squares: all rigid-body parameters, an offset, dry and viscous
friction of every joint and friction over its load (but for the joint whose friction is hidden).
That, over the noise of the rows it has, is z; an effect shows from `THRESHOLD` on. With two
positions the difference between motor and joint is looked at in the same way.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.blind.twin.fixed.motions import Course

Array = NDArray[np.float64]
THRESHOLD: Final = 6.0
#: Rows looked at; more tell the same.
_ROWS: Final = 400


@dataclass(frozen=True)
class Own:
    """What a hidden effect is itself, so that it cannot be explained away by it.

    Attributes:
        friction: Joints whose friction is hidden.
        offset: Joints whose torque sensor's zero is.
        bodies: Whether a body is.
    """

    friction: frozenset[int] = frozenset()
    offset: frozenset[int] = frozenset()
    bodies: bool = False


def misfit(
    model: pin.Model,
    course: Course,
    rows: NDArray[np.intp],
    change: Array,
    noise: tuple[Array, Array, float, float],
    own: Own,
) -> float:
    """Standard deviations (z) of a change of the torques.

    Args:
        model: Bodies by the URDF.
        course: Of the links.
        rows: Of the log, shape (N,).
        change: Torques with the effect less those without, shape (N, J) [N*m].
        noise: White and coloured noise of a row, each (J,), memory of the latter and the rows'
            step [s].
        own: What is hidden and is no excuse for itself.
    """
    white, coloured, memory, step = noise
    every = max(1, rows.size // _ROWS)
    at, change = rows[::every], change[::every]
    data, joints = model.createData(), change.shape[1]
    q, v, a = course.q[at], course.v[at], course.a[at]
    bodies = np.stack(
        [
            pin.computeJointTorqueRegressor(model, data, *row).copy()
            for row in zip(q, v, a, strict=True)
        ]
    )
    bodies = bodies.reshape(at.size, joints, -1)
    torque = np.stack([pin.rnea(model, data, *row).copy() for row in zip(q, v, a, strict=True)])
    columns = [] if own.bodies else [bodies]
    for j in range(joints):
        laws = [] if j in own.offset else [np.ones(at.size)]
        if j not in own.friction:
            way = np.tanh(v[:, j] / 0.02)
            laws += [way, v[:, j], way * np.abs(torque[:, j])]
        if not laws:
            continue
        block = np.zeros((at.size, joints, len(laws)))
        block[:, j] = np.stack(laws, axis=1)
        columns.append(block)
    # Coloured noise repeats itself from row to row: so many rows stand for one.
    alike = max(1.0, 2.0 * memory / (step * every))
    sigma = np.sqrt(white**2 / every + coloured**2 * alike)
    design = np.concatenate(columns, axis=2) / sigma[None, :, None]
    x = design.reshape(-1, design.shape[2])
    y = (change / sigma).ravel()
    scale = np.linalg.norm(x, axis=0)
    x = x[:, scale > 0] / scale[scale > 0]
    solution, *_ = np.linalg.lstsq(x, y, rcond=1e-9)
    return float(np.linalg.norm(y - x @ solution))


def misfit_of_sides(ahead: Array, resolution: float) -> float:
    """Standard deviations (z) of motor less joint, (N,) [rad], over the encoders' resolution."""
    rest = ahead - ahead.mean()
    noise = max(resolution / np.sqrt(12.0), 1e-9)
    return float(np.linalg.norm(rest) / noise / np.sqrt(max(ahead.size / _ROWS, 1.0)))
