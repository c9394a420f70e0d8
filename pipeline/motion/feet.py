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
from scipy.spatial.transform import Rotation

from actuators.arrays import Array
from pipeline.motion.footfall import transfer_path
from pipeline.motion.gait import Gait
from pipeline.motion.motion import Ground, Segment

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


def surge(gait: Gait, share: Array) -> Course:
    """The body's way ahead of its even course and back, twice a period, shape (N, 3).

    A foot that stands a way x ahead of its hip at height h under it, and presses with a force that
    points at the hip, slows the body by g x / h. Along a stroke S that x falls from S/2 to -S/2:
    with feet that touch down together in two sets half a period apart its first harmonic is
    (S / pi) sin(w t), w = 4 pi / T, counted from the middle of a support less T/4, and the body's
    way the same times g / (h w^2).

    `share`: of the period, from the first touch-down, shape (N,).
    """
    duty = float(np.mean(list(gait.footfall.duty.values())))
    rate = 4.0 * np.pi / gait.period  # [rad/s]
    phase = rate * gait.period * (share - (duty / 2.0 - 0.25))
    ahead = gait.surge * np.array([*gait.twist[:2], 0.0]) / max(gait.speed, 1e-12)
    return Course(
        np.sin(phase)[:, None] * ahead,
        rate * np.cos(phase)[:, None] * ahead,
        -(rate**2) * np.sin(phase)[:, None] * ahead,
    )


def base_motion(gait: Gait, time: Array, shift: Course | None) -> tuple[Array, Array, Array]:
    """The base over a stretch of time (N,) [s], as Pinocchio's free flyer wants it.

    `gait`: at t = 0 the unswayed base is at the origin and looks along x. `shift`: sway in the axes
    of the unswayed body, shape (N, 3). Returns place in the world and quaternion x y z w, (N, 7),
    linear and angular velocity in the base's axes [m/s, rad/s] and these components' derivative,
    each (N, 6).
    """
    n = time.size
    gone, angle = displaced(gait.twist, time)
    linear, rate = np.tile([*gait.twist[:2], 0.0], (n, 1)), np.zeros((n, 3))
    spin = np.array([0.0, 0.0, gait.twist[2]])
    if shift is not None:
        gone = gone + along_ground(shift.position) * np.exp(1j * angle)
        linear = linear + shift.velocity + np.cross(spin, shift.position)
        # The components' own derivative: Pinocchio's acceleration, not the point's.
        rate = shift.acceleration + np.cross(spin, shift.velocity)
    place = np.stack([gone.real, gone.imag, np.zeros(n)], axis=-1)
    velocity, acceleration = np.zeros((n, 6)), np.zeros((n, 6))
    velocity[:, :3], velocity[:, 3:] = linear @ gait.body, spin @ gait.body
    acceleration[:, :3] = rate @ gait.body
    position = place if gait.ground.level else place @ gait.ground.rotation.T
    quaternion = base_quaternions(gait.ground, gait.body, angle)
    return np.hstack([position, quaternion]), velocity, acceleration


def base_quaternions(ground: Ground, body: Array, heading: Array) -> Array:
    """Orientation of the base in the world, x y z w, shape (N, 4).

    `body`: rotation from the base to the ground's axes at zero heading, shape (3, 3). `heading`:
    turn to the left about the ground's normal [rad], shape (N,).
    """
    if ground.level and np.array_equal(body, np.eye(3)) and not heading.any():
        return np.tile([0.0, 0.0, 0.0, 1.0], (heading.size, 1))  # upright to the last bit
    yaw = Rotation.from_rotvec(heading[:, None] * [0.0, 0.0, 1.0])
    whole = Rotation.from_matrix(ground.rotation) * yaw * Rotation.from_matrix(body)
    return one_sign(whole.as_quat())


def one_sign(quaternion: Array) -> Array:
    """Quaternions (N, 4) without jumps of sign: one and its negative are the same orientation."""
    out = np.array(quaternion)
    flips = np.cumprod(np.where((out[1:] * out[:-1]).sum(axis=1) < 0, -1.0, 1.0))
    out[1:] *= flips[:, None]
    return out


@dataclass(frozen=True)
class BaseSeries:
    """The base's origin and attitude in the world over a segment."""

    position: Array  #: Shape (N, 3) [m].
    #: Roll, pitch, yaw [rad], shape (N, 3): the rotation is Rz(yaw) Ry(pitch) Rx(roll); yaw runs on
    #: beyond a half turn.
    angles: Array
    velocity: Array  #: Of the origin, shape (N, 3) [m/s].
    acceleration: Array  #: Of the origin, shape (N, 3) [m/s^2].
    angular_velocity: Array  #: Shape (N, 3) [rad/s].


def base_in_world(segment: Segment) -> BaseSeries:
    """What Pinocchio's components in the base's axes mean in the world."""
    turn = Rotation.from_quat(segment.configuration[:, 3:7])
    v, w = segment.velocity[:, :3], segment.velocity[:, 3:6]
    # The origin's acceleration has what the axes' own turning adds to the components' derivative.
    a = segment.acceleration[:, :3] + np.cross(w, v)
    angles = turn.as_euler("xyz")
    angles[:, 2] = np.unwrap(angles[:, 2])
    return BaseSeries(
        segment.configuration[:, :3], angles, turn.apply(v), turn.apply(a), turn.apply(w)
    )
