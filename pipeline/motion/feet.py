"""Path of the body over the ground and of the feet relative to it, exact with both derivatives.

The unswayed body moves with constant velocity and yaw rate in its own axes: a straight line or an
arc. Feet on the ground are fixed in it, so that relative to the body they run on the same line or
arc backwards; a foot in the air goes straight from one foothold to the next, over the ground by the
named path's advance and above it by its lift. Sway moves the body over all this: what a foot does
relative to the body is then less by the sway.

Everything here is in the axes of the ground (`pipeline.motion.ground`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.motion.gait import Gait
from pipeline.motion.transfer_path import transfer_path

Array = NDArray[np.float64]
#: Below this angle (1 - cos a) / a is its series, which then is exact to rounding.
_SMALL = 1e-4


@dataclass(frozen=True)
class Course:
    """Points with velocity and acceleration.

    Attributes:
        position: Shape (N, ..., 3) [m].
        velocity: Likewise [m/s].
        acceleration: Likewise [m/s^2].
    """

    position: Array
    velocity: Array
    acceleration: Array


def turned(angle: Array, v: Array) -> Array:
    """Vectors (N, 2) or (2,) turned to the left by angles (N,)."""
    c, s = np.cos(angle), np.sin(angle)
    x, y = v[..., 0], v[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def displaced(stride: Array, share: Array) -> tuple[Array, Array]:
    """Displacement and turn of the unswayed body over shares of a period.

    Args:
        stride: Over one period [m, m, rad], shape (3,).
        share: Shape (N,), of any sign.

    Returns:
        Displacement in the axes of the start [m], shape (N, 2), and turn [rad], shape (N,).
    """
    angle = stride[2] * share
    half = np.where(np.abs(angle) < _SMALL, angle / 2 - angle**3 / 24, 0.0)
    safe = np.where(np.abs(angle) < _SMALL, 1.0, angle)
    small = np.abs(angle) < _SMALL
    sine = np.where(small, 1 - angle**2 / 6, np.sin(angle) / safe)
    cosine = np.where(small, half, (1 - np.cos(angle)) / safe)
    way = stride[:2] * share[:, None]
    x, y = way[:, 0], way[:, 1]
    return np.stack([sine * x - cosine * y, cosine * x + sine * y], axis=-1), angle


def support_course(gait: Gait, leg: int, local: Array) -> Course:
    """A standing foot relative to the unswayed body.

    Args:
        gait: The gait.
        leg: Index.
        local: Share of the support that has passed, shape (N,).
    """
    duty = gait.footfall.duty[gait.legs[leg]]
    neutral = gait.neutral[leg]
    offset = _offset(gait.stride * duty, neutral[:2], local - 0.5)
    position = np.repeat(neutral[None], local.size, axis=0)
    position[:, :2] += offset
    velocity, acceleration = np.zeros_like(position), np.zeros_like(position)
    velocity[:, :2], acceleration[:, :2] = _seen(gait, position, None, None)
    return Course(position, velocity, acceleration)


def transfer_course(gait: Gait, leg: int, local: Array) -> Course:
    """A foot in the air relative to the unswayed body.

    Args:
        gait: The gait.
        leg: Index.
        local: Share of the transfer that has passed, shape (N,).
    """
    duty = gait.footfall.duty[gait.legs[leg]]
    duration = (1 - duty) * gait.period
    neutral, lift = gait.neutral[leg], gait.lift[leg]
    ends = np.array([0.5, -0.5])
    leave, land = _offset(gait.stride * duty, neutral[:2], ends)
    # Foothold ahead, in the axes of the body at lift-off.
    way, turn = displaced(gait.stride * (1 - duty), np.ones(1))
    if turn[0] == 0:
        over_ground = gait.stride[:2]  # (N, 2) in one stride
    else:
        over_ground = way[0] + turned(turn, neutral[:2] + land)[0] - neutral[:2] - leave
    path = transfer_path(gait.path)
    advance, advance_1, advance_2 = (x[:, None] for x in path.advance(local))
    height, height_1, height_2 = path.lift(local)
    gone, angle = displaced(gait.stride * (1 - duty), local)
    back = turned(-angle, neutral[:2]) - neutral[:2] if gait.stride[2] else 0.0
    position = np.repeat(neutral[None], local.size, axis=0)
    position[:, :2] += back + turned(-angle, leave + over_ground * advance - gone)
    position[:, 2] += lift * height
    velocity, acceleration = np.zeros_like(position), np.zeros_like(position)
    velocity[:, :2], acceleration[:, :2] = _seen(
        gait,
        position,
        turned(-angle, over_ground * advance_1 / duration),
        turned(-angle, over_ground * advance_2 / duration**2),
    )
    velocity[:, 2] = lift * height_1 / duration
    acceleration[:, 2] = lift * height_2 / duration**2
    return Course(position, velocity, acceleration)


def _offset(stride: Array, neutral: Array, share: Array) -> Array:
    """How far from its neutral place a foothold lies, seen from a body `share` strides on."""
    gone, angle = displaced(stride, share)
    back = turned(-angle, neutral) - neutral if stride[2] else 0.0
    return np.asarray(back - turned(-angle, gone))


def _seen(
    gait: Gait, position: Array, velocity: Array | None, acceleration: Array | None
) -> tuple[Array, Array]:
    """Horizontal velocity and acceleration relative to the turning body.

    Args:
        gait: The gait; its body's velocity and yaw rate are constant in its own axes.
        position: Of the foot from the body, shape (N, 3).
        velocity: Of the foot over the ground in the body's axes, shape (N, 2); None at rest.
        acceleration: Likewise.

    Returns:
        Each of shape (N, 2): with W the turn by 90 degrees times the yaw rate, r' = u - v - W r and
        r'' = a - W u - W r', where u and a are over the ground and v is the body's velocity.
    """
    v, w = gait.twist[:2], gait.twist[2]

    def quarter(r: Array) -> Array:
        return np.stack([-r[:, 1], r[:, 0]], axis=-1) * w

    still = np.zeros((position.shape[0], 2))
    u = still if velocity is None else velocity
    a = still if acceleration is None else acceleration
    relative = u - v
    if w == 0:
        return relative, a
    relative = relative - quarter(position)
    return relative, a - quarter(u) - quarter(relative)
