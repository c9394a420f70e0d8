"""Path of the body over the ground and of the feet relative to it, exact with both derivatives.

The unswayed body moves with constant velocity and yaw rate in its own axes: a straight line or an
arc. Feet on the ground are fixed in it, so that relative to the body they run on the same line or
arc backwards; a foot in the air goes straight from one foothold to the next, over the ground by the
named path's advance and above it by its lift. Sway moves the body over all this: what a foot does
relative to the body is then less by the sway.

Everything here is in the axes of the ground (`pipeline.motion.motion`). Vectors along it are
complex numbers x + i y, so that a turn to the left is a factor exp(i angle).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.motion.gait import Gait
from pipeline.motion.transfer_path import transfer_path

Plane = NDArray[np.complex128]


@dataclass(frozen=True)
class Course:
    """Points with velocity and acceleration."""

    position: Array  #: Shape (N, ..., 3) [m].
    velocity: Array  #: Likewise [m/s].
    acceleration: Array  #: Likewise [m/s^2].

    def __add__(self, other: Course) -> Course:
        """Both courses together."""
        return Course(
            self.position + other.position,
            self.velocity + other.velocity,
            self.acceleration + other.acceleration,
        )


def along_ground(vector: Array) -> Plane:
    """The first two components of vectors (..., 2 or more) as complex numbers."""
    return np.asarray(vector[..., 0] + 1j * vector[..., 1])


def displaced(stride: Array, share: Array) -> tuple[Plane, Array]:
    """Displacement and turn of the unswayed body over shares of a period.

    `stride`: over one period [m, m, rad], shape (3,). `share`: shape (N,), of any sign. Returns
    displacement in the axes of the start [m], complex, and turn [rad], each of shape (N,).
    """
    angle = stride[2] * share
    turn = np.ones(share.size, dtype=np.complex128)  # mean of exp(i angle) on the way
    np.divide(np.expm1(1j * angle), 1j * angle, out=turn, where=angle != 0)
    return along_ground(stride) * share * turn, angle


def support_course(gait: Gait, leg: int, local: Array) -> Course:
    """A standing foot relative to the unswayed body.

    `local`: share of the support that has passed, shape (N,).
    """
    duty = gait.footfall.duty[gait.legs[leg]]
    foothold = _seen_from(gait.stride * duty, along_ground(gait.neutral[leg]), local - 0.5)
    at_rest = np.zeros(local.size)
    return _course(gait, leg, foothold, (at_rest, at_rest), (at_rest, at_rest, at_rest))


def transfer_course(gait: Gait, leg: int, local: Array) -> Course:
    """A foot in the air relative to the unswayed body.

    `local`: share of the transfer that has passed, shape (N,).
    """
    duty = gait.footfall.duty[gait.legs[leg]]
    duration = (1 - duty) * gait.period
    leave, land = _seen_from(
        gait.stride * duty, along_ground(gait.neutral[leg]), np.array([0.5, -0.5])
    )
    # The next foothold less this one, in the axes of the body at lift-off.
    ahead, turn = displaced(gait.stride * (1 - duty), np.ones(1))
    way = ahead[0] + land * np.exp(1j * turn[0]) - leave
    path = transfer_path(gait.path)
    advance, advance_1, advance_2 = path.advance(local)
    height, height_1, height_2 = path.lift(local)
    gone, angle = displaced(gait.stride * (1 - duty), local)
    back = np.exp(-1j * angle)
    return _course(
        gait,
        leg,
        (leave + way * advance - gone) * back,
        (way * advance_1 / duration * back, way * advance_2 / duration**2 * back),
        (height, height_1 / duration, height_2 / duration**2),
    )


def _seen_from(stride: Array, foothold: complex | Plane, share: Array) -> Plane:
    """Where a foothold lies, seen from a body that is `share` strides on."""
    gone, angle = displaced(stride, share)
    return np.asarray((foothold - gone) * np.exp(-1j * angle))


def _course(
    gait: Gait,
    leg: int,
    position: Plane,
    over_ground: tuple[Array | Plane, Array | Plane],
    lifted: tuple[Array, Array, Array],
) -> Course:
    """A foot relative to the turning body, from what it does over the ground in the body's axes.

    With the body's velocity v and yaw rate w: r' = u - v - i w r and r'' = a - i w u - i w r'.
    """
    v, w = along_ground(gait.twist), gait.twist[2]
    u, a = over_ground
    rate = u - v - 1j * w * position
    plane = (position, rate, a - 1j * w * u - 1j * w * rate)
    ground = np.array([gait.neutral[leg, 2], 0.0, 0.0])
    parts = [
        np.stack([x.real, x.imag, z + gait.lift[leg] * up], axis=-1)
        for x, z, up in zip(plane, ground, lifted, strict=True)
    ]
    return Course(*parts)
