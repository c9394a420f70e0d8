"""Motion of the base over the ground, in the terms of Pinocchio's free flyer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from actuators.arrays import Array
from pipeline.motion.feet import Course, along_ground, displaced
from pipeline.motion.gait import Gait
from pipeline.motion.motion import Ground, Segment


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
