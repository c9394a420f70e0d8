"""A motion as segments with closed ends; the course of body and feet over the ground, exact.

The unswayed body moves with constant velocity and yaw rate in its own axes: a straight line or an
arc. Feet on the ground run on the same line or arc backwards; a foot in the air goes straight from
one foothold to the next, over the ground by the named path's advance and above it by its lift.

Courses are in the axes of the ground. Vectors along it are complex numbers x + i y, so that a turn
to the left is a factor exp(i angle). A *course* holds the position of a point and its two
derivatives by time, shape (3, N, 3) [m, m/s, m/s^2].
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from actuators.arrays import Array
from pipeline.motion.footfall import TRANSFER_PATHS
from pipeline.motion.gait import Gait


def level_ground() -> Array:
    """The normal of level ground in the world frame, shape (3,)."""
    return np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Segment:
    """A stretch of motion during which the same feet stand on the ground.

    Both ends belong to the segment: the last sample of one and the first of the next share their
    time but hold the left and the right limit, because forces jump at contact events.
    """

    name: str  #: For people, e.g. ``"support of lf, lr, rm"``.
    time: Array  #: Increasing, shape (N,) [s].
    configuration: Array  #: Pinocchio configuration, shape (N, nq) [m, quaternion, rad].
    velocity: Array  #: Pinocchio tangent velocity, shape (N, nv) [m/s, rad/s].
    acceleration: Array  #: Its derivative, shape (N, nv) [m/s^2, rad/s^2].
    stance: tuple[str, ...]  #: Names of the legs whose feet carry load.
    #: Unit vector in the world frame (z opposes gravity) that points out of the ground, shape (3,);
    #: the standing feet rest on one plane with this normal.
    ground_normal: Array = field(default_factory=level_ground)
    #: Where the feet should be in the base frame, shape (N, L, 3) [m]; None where the motion was
    #: not made from feet.
    foot_target: Array | None = None
    #: Whether it stands on two feet, whose forces leave the moment about their line open.
    rocks: bool = False


@dataclass(frozen=True)
class Motion:
    """Segments in order of time."""

    segments: tuple[Segment, ...]  #: At least one; each starts where the one before ended.


Plane = NDArray[np.complex128]


def displaced(stride: Array, share: Array) -> tuple[Plane, Array]:
    """Displacement and turn of the unswayed body over shares of a period, shape (N,).

    `stride`: over one period [m, m, rad], shape (3,). Returns displacement in the axes of the start
    [m], complex, and turn [rad], each of shape (N,).
    """
    angle = stride[2] * share
    turn = np.ones(share.size, dtype=np.complex128)  # mean of exp(i angle) on the way
    np.divide(np.expm1(1j * angle), 1j * angle, out=turn, where=angle != 0)
    return complex(stride[0], stride[1]) * share * turn, angle


def foot_course(gait: Gait, leg: int, local: Array, *, stands: bool) -> Array:
    """Course of a foot relative to the unswayed body.

    `local`: share of the support, or of the transfer, that has passed, shape (N,).
    """
    duty = gait.footfall.duty
    share = duty if stands else 1 - duty
    neutral = complex(gait.neutral[leg, 0], gait.neutral[leg, 1])
    # Where a foothold lies, seen from the body that lands it and from the one that leaves it.
    gone, angle = displaced(gait.stride * duty, np.array([-0.5, 0.5]))
    land, leave = (neutral - gone) * np.exp(-1j * angle)
    gone, angle = displaced(gait.stride * share, local)
    back = np.exp(-1j * angle)
    if stands:
        position, over = (land - gone) * back, np.zeros((3, local.size))
        height = np.zeros((3, 1))
    else:
        advance, lift = TRANSFER_PATHS[gait.table.transfer_path]
        per = (share * gait.period) ** -np.arange(3.0)[:, None]  # [1, 1/s, 1/s^2]
        # The next foothold less this one, in the axes of the body at lift-off.
        ahead, turn = displaced(gait.stride * share, np.ones(1))
        way = ahead[0] + land * np.exp(1j * turn[0]) - leave
        over = way * advance(local) * per * back
        position = (leave - gone) * back + over[0]
        height = gait.lift * lift(local) * per
    # In the axes of a body with velocity v and yaw rate w a foot that moves over the ground with
    # velocity u and acceleration a has r' = u - v - i w r and r'' = a - i w u - i w r'.
    v, w = complex(gait.twist[0], gait.twist[1]), gait.twist[2]
    rate = over[1] - v - 1j * w * position
    plane = np.stack([position, rate, over[2] - 1j * w * (over[1] + rate)])
    level = np.array([gait.neutral[leg, 2], 0.0, 0.0])[:, None]
    return np.stack([plane.real, plane.imag, level + height + np.zeros(plane.shape)], axis=-1)


def surge(gait: Gait, share: Array) -> Array:
    """Course of the body ahead of its even way and back, twice a period.

    A foot that stands a way x ahead of its hip at height h under it, and presses with a force that
    points at the hip, slows the body by g x / h. Along a stroke S that falls from S/2 to -S/2: with
    feet that touch down in two sets half a period apart its first harmonic is (S / pi) sin(w t),
    w = 4 pi / T, and the body's way that times g / (h w^2). `share`: of the period, shape (N,).
    """
    duty = gait.footfall.duty
    rate = 4.0 * np.pi / gait.period  # [rad/s]
    phase = 4.0 * np.pi * (share - (duty / 2.0 - 0.25))
    ahead = gait.surge * np.array([*gait.twist[:2], 0.0]) / max(gait.speed, 1e-12)
    swing = np.stack([np.sin(phase), rate * np.cos(phase), -(rate**2) * np.sin(phase)])
    return swing[..., None] * ahead


def base_motion(gait: Gait, time: Array, shift: Array) -> tuple[Array, Array, Array]:
    """The base over a stretch of time (N,) [s], as Pinocchio's free flyer wants it.

    At t = 0 the unswayed base is at the origin and looks along x. `shift`: course of the base in
    the axes of the unswayed one. Returns place in the world and quaternion x y z w, (N, 7), linear
    and angular velocity in the base's axes [m/s, rad/s] and these components' derivative, (N, 6).
    """
    gone, angle = displaced(gait.twist, time)
    gone = gone + (shift[0, :, 0] + 1j * shift[0, :, 1]) * np.exp(1j * angle)
    spin = np.array([0.0, 0.0, gait.twist[2]])
    linear = np.array([*gait.twist[:2], 0.0]) + shift[1] + np.cross(spin, shift[0])
    # The components' own derivative: Pinocchio's acceleration, not the point's.
    rate = shift[2] + np.cross(spin, shift[1])
    velocity, acceleration = np.zeros((2, time.size, 6))
    body, ground = gait.table.body, gait.table.ground
    velocity[:, :3], velocity[:, 3:] = linear @ body, spin @ body
    acceleration[:, :3] = rate @ body
    place = np.stack([gone.real, gone.imag, np.zeros(time.size)], axis=-1)
    quaternion = base_quaternions(ground, body, angle)
    return np.hstack([place @ ground.T, quaternion]), velocity, acceleration


def base_quaternions(ground: Array, body: Array, heading: Array) -> Array:
    """Orientation of the base in the world, x y z w, shape (N, 4).

    `ground`: rotation from the ground's axes to the world's, shape (3, 3). `body`: from the base's
    to the ground's at zero heading. `heading`: turn to the left about the normal [rad], shape (N,).
    """
    yaw = Rotation.from_rotvec(heading[:, None] * [0.0, 0.0, 1.0])
    whole = Rotation.from_matrix(ground) * yaw * Rotation.from_matrix(body)
    return one_sign(whole.as_quat())


def one_sign(quaternion: Array) -> Array:
    """Quaternions (N, 4) without jumps of sign: one and its negative are the same orientation."""
    out = np.array(quaternion)
    flips = np.cumprod(np.where((out[1:] * out[:-1]).sum(axis=1) < 0, -1.0, 1.0))
    out[1:] *= flips[:, None]
    return out


def base_in_world(segment: Segment) -> dict[str, Array]:
    """What Pinocchio's components in the base's axes mean in the world, each (N, 3).

    Returns `position` of the base's origin [m]; `angles` roll, pitch, yaw [rad], of which the
    rotation is Rz(yaw) Ry(pitch) Rx(roll) and yaw runs on beyond a half turn; `velocity` [m/s] and
    `acceleration` [m/s^2] of the origin; `angular_velocity` [rad/s].
    """
    turn = Rotation.from_quat(segment.configuration[:, 3:7])
    v, w = segment.velocity[:, :3], segment.velocity[:, 3:6]
    # The origin's acceleration has what the axes' own turning adds to the components' derivative.
    a = segment.acceleration[:, :3] + np.cross(w, v)
    return {
        "position": segment.configuration[:, :3],
        "angles": np.unwrap(turn.as_euler("xyz"), axis=0),
        "velocity": turn.apply(v),
        "acceleration": turn.apply(a),
        "angular_velocity": turn.apply(w),
    }
