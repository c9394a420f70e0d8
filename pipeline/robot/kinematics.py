"""Kinematics of all legs at once, over many samples, in the base frame.

A leg is a serial chain of joints that turn or slide, from the base to a foot point. Coordinates of
joints are angles [rad] or, where the joint slides, lengths [m]. Work arrays keep the Cartesian
component first, legs second and samples last, so that every operation runs over contiguous samples;
that is what makes a batch an order of magnitude faster than a loop over samples with Pinocchio's
Jacobians. The public functions take and return samples first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.robot.leg_chains import LegChains

Array = NDArray[np.float64]


def _turn(chains: LegChains, j: int, v: Array, cos: Array, sin: Array) -> Array:
    """Rotate v (3, L, N) about the axis of joint j by the angle whose cos, sin (L, N) are given.

    The angle is zero where joint j slides or a leg has no such joint.
    """
    along = chains.along[j]
    if along is None:
        return _rodrigues(v, chains.axis[j], cos, sin)
    c, sign = along
    a, b = (c + 1) % 3, (c + 2) % 3
    signed = sign * sin
    out = np.empty(np.broadcast_shapes(v.shape, (3, *cos.shape)))
    out[a] = cos * v[a] - signed * v[b]
    out[b] = signed * v[a] + cos * v[b]
    out[c] = v[c]
    return out


def _rodrigues(v: Array, axis: Array, cos: Array, sin: Array) -> Array:
    """Rodrigues' rotation of v (3, L, N) about axis (L, 3) by the angle whose cos, sin (L, N)."""
    kx, ky, kz = axis[:, 0, None], axis[:, 1, None], axis[:, 2, None]
    along = (kx * v[0] + ky * v[1] + kz * v[2]) * (1 - cos)
    out = np.empty(np.broadcast_shapes(v.shape, (3, *cos.shape)))
    out[0] = v[0] * cos + (ky * v[2] - kz * v[1]) * sin + kx * along
    out[1] = v[1] * cos + (kz * v[0] - kx * v[2]) * sin + ky * along
    out[2] = v[2] * cos + (kx * v[1] - ky * v[0]) * sin + kz * along
    return out


def _torque(chains: LegChains, j: int, arm: Array, f: Array) -> Array:
    """What f (3, L, N) at arm (3, L, N or 1) does at joint j, (L, N): moment, or force along it."""
    turning = _moment(chains, j, arm, f)
    if not chains.slides[j].any():
        return turning
    sliding = np.einsum("lc,cln->ln", chains.axis[j], f)
    return np.where(chains.slides[j][:, None], sliding, turning)


def _moment(chains: LegChains, j: int, arm: Array, f: Array) -> Array:
    """Moment of f (3, L, N) at arm (3, L, N or 1) about the axis of joint j, (L, N)."""
    along = chains.along[j]
    if along is None:
        k, moment = chains.axis[j], _cross(arm, f)
        return k[:, 0, None] * moment[0] + k[:, 1, None] * moment[1] + k[:, 2, None] * moment[2]
    c, sign = along
    a, b = (c + 1) % 3, (c + 2) % 3
    own: Array = sign * (arm[a] * f[b] - arm[b] * f[a])
    return own


def _to_parent(chains: LegChains, j: int, v: Array) -> Array:
    """From joint j's frame before its own rotation to its parent's axes; often nothing to do."""
    if not chains.turned[j]:
        return v
    return np.einsum("lij,jln->iln", chains.rotation[j], v)


def _from_parent(chains: LegChains, j: int, v: Array) -> Array:
    """The inverse of `_to_parent`."""
    if not chains.turned[j]:
        return v
    return np.einsum("lji,jln->iln", chains.rotation[j], v)


def _cross(a: Array, b: Array) -> Array:
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    return out


def _samples_last(q: Array) -> Array:
    return np.array(np.moveaxis(q, 0, -1), order="C")  # (N, L, K) -> (L, K, N), always a copy


def _parted(chains: LegChains, coordinate: Array) -> tuple[Array, Array | None]:
    """Angles of the joints that turn, displacements of those that slide, each (L, K, N).

    Overwrites the coordinates; None where no joint slides.
    """
    if chains.turning_only:
        return coordinate, None
    slides = chains.slides.T[:, :, None]
    shift = np.where(slides, coordinate, 0.0) if slides.any() else None
    coordinate *= chains.real[:, :, None] & ~slides
    return coordinate, shift


@dataclass(frozen=True)
class LegPosture:
    """Sines, lever arms and feet of the legs: what forces and positions share.

    Attributes:
        chains: The legs.
        cos: Of the joint angles, shape (L, K, N); 1 where a joint slides or is none.
        sin: Likewise.
        arm: By joint, from its origin to the foot in its own frame [m], shape (3, L, N), or
            (3, L, 1) for the last one; K of them.
        foot: Foot points in the base frame [m], shape (3, L, N).
    """

    chains: LegChains
    cos: Array
    sin: Array
    arm: tuple[Array, ...]
    foot: Array

    @property
    def feet(self) -> Array:
        """Foot points in the base frame [m], shape (N, L, 3)."""
        return self.foot.transpose(2, 1, 0)

    def force_torques(self, force: Array) -> Array:
        """Joint torques J^T f that forces on the first F of the feet put into their joints.

        Args:
            force: In the base frame [N], shape (N, F, 3).

        Returns:
            Torques [N*m], forces [N] where a joint slides, shape (N, F, K), positive in the joints'
            positive directions; zero where a leg has no joint.
        """
        n, k, _ = force.shape
        chains = self.chains if k == len(self.chains.names) else self.chains.of(range(k))
        f = np.ascontiguousarray(force.transpose(2, 1, 0))
        torque = np.empty((n, k, chains.depth))
        for j in range(chains.depth):
            f = _from_parent(chains, j, f)
            f = _turn(chains, j, f, self.cos[:k, j], -self.sin[:k, j])
            torque[:, :, j] = _torque(chains, j, self.arm[j][:, :k], f).T
        return torque


def leg_posture(chains: LegChains, q: Array) -> LegPosture:
    """Work out the legs at joint positions q [rad, m], shape (N, L, K)."""
    return posture_at(chains, _samples_last(q))


def posture_at(chains: LegChains, angle: Array) -> LegPosture:
    """Work out the legs at joint positions that are the caller's to give away.

    Args:
        chains: The legs.
        angle: Joint positions [rad, m], shape (L, K, N); overwritten.
    """
    angle, shift = _parted(chains, angle)
    cos, sin = np.cos(angle), np.sin(angle, out=angle)
    arm: list[Array] = []
    r = chains.foot.T[:, :, None]
    for j in reversed(range(chains.depth)):
        arm.insert(0, r)
        if shift is not None:
            r = r + chains.axis[j].T[:, :, None] * shift[:, j]
        r = _to_parent(chains, j, _turn(chains, j, r, cos[:, j], sin[:, j]))
        r += chains.offset[j].T[:, :, None]
    return LegPosture(chains, cos, sin, tuple(arm), r)


def foot_positions(chains: LegChains, q: Array) -> Array:
    """Foot points in the base frame.

    Args:
        chains: The legs.
        q: Joint positions [rad, m], shape (N, L, K).

    Returns:
        Positions [m], shape (N, L, 3).
    """
    return leg_posture(chains, q).feet


def foot_force_torques(chains: LegChains, q: Array, force: Array) -> Array:
    """Joint torques J^T f that forces on the feet put into the joints.

    Args:
        chains: The legs.
        q: Joint positions [rad, m], shape (N, L, K).
        force: Force on each foot [N] in the base frame, shape (N, L, 3).

    Returns:
        Torques [N*m], forces [N] where a joint slides, shape (N, L, K), positive in the joints'
        positive directions.
    """
    return leg_posture(chains, q).force_torques(force)


@dataclass(frozen=True)
class _Frames:
    """Joints and feet in the base frame, component first.

    Attributes:
        axes: Unit axes, shape (K, 3, L, N).
        origins: Of the joints, those that slide at where they have slid to [m], (K, 3, L, N).
        tip: Foot points [m], shape (3, L, N).
        turns: 1 where a joint turns, else 0, shape (K, L, 1).
    """

    axes: Array
    origins: Array
    tip: Array
    turns: Array

    def column(self, j: int) -> Array:
        """Velocity of the foot per unit of joint j's, shape (3, L, N)."""
        turning = _cross(self.axes[j], self.tip - self.origins[j])
        if self.turns[j].all():
            return turning
        return np.where(self.turns[j] > 0, turning, self.axes[j])


def _frames(chains: LegChains, q: Array) -> _Frames:
    angle, shift = _parted(chains, _samples_last(q))
    n_legs, depth, n = angle.shape
    cos, sin = np.cos(angle), np.sin(angle)

    def to_base(v: Array, joint: int, *, point: bool) -> Array:
        # v is given in the frame of `joint`, after that joint's own motion.
        for j in reversed(range(joint + 1)):
            if point and shift is not None:
                v = v + chains.axis[j].T[:, :, None] * shift[:, j]
            v = _to_parent(chains, j, _turn(chains, j, v, cos[:, j], sin[:, j]))
            if point:
                v = v + chains.offset[j].T[:, :, None]
        return v

    axes = np.empty((depth, 3, n_legs, n))
    origins = np.empty_like(axes)
    zero = np.zeros((3, n_legs, n))
    for j in range(depth):
        own = np.broadcast_to(chains.axis[j].T[:, :, None], zero.shape)
        axes[j] = to_base(own, j, point=False)
        origins[j] = to_base(zero, j, point=True)
    tip = to_base(np.broadcast_to(chains.foot.T[:, :, None], zero.shape), depth - 1, point=True)
    turns = np.asarray(~chains.slides[:, :, None], dtype=np.float64)
    return _Frames(axes, origins, tip, turns)


def foot_jacobians(chains: LegChains, q: Array) -> tuple[Array, Array]:
    """Foot points and their Jacobians in the base frame.

    Args:
        chains: The legs.
        q: Joint positions [rad, m], shape (N, L, K).

    Returns:
        Positions [m], shape (N, L, 3), and Jacobians [m/rad, 1],
        shape (N, L, 3 xyz, K joints); a column is zero where a leg has no joint.
    """
    frames = _frames(chains, q)
    jacobian = np.stack([frames.column(j) for j in range(chains.depth)])  # joint, xyz, leg, sample
    return frames.tip.transpose(2, 1, 0), jacobian.transpose(3, 2, 1, 0)


def foot_jacobian_rates(chains: LegChains, q: Array, q_dot: Array) -> Array:
    """Time derivative of the foot Jacobians times the joint velocity.

    Args:
        chains: The legs.
        q: Joint positions [rad, m], shape (N, L, K).
        q_dot: Joint velocities [rad/s, m/s], shape (N, L, K).

    Returns:
        The bias acceleration of the feet [m/s^2], shape (N, L, 3).
    """
    frames = _frames(chains, q)
    axes, origins, tip, turns = frames.axes, frames.origins, frames.tip, frames.turns
    depth = chains.depth
    rate = _samples_last(q_dot)  # (L, K, N)
    spin = np.zeros((depth + 1, *tip.shape))  # angular velocity of what joint j hangs on
    for j in range(depth):
        spin[j + 1] = spin[j] + axes[j] * (turns[j] * rate[:, j])
    velocity = np.zeros((depth + 1, *tip.shape))  # of the joint origins, then of the foot
    points = [*origins, tip]
    for j in range(depth + 1):
        if j > 0:
            velocity[j] = velocity[j - 1] + _cross(spin[j], points[j] - points[j - 1])
        if j < depth and not turns[j].all():
            velocity[j] += axes[j] * ((1.0 - turns[j]) * rate[:, j])
    bias = np.zeros(tip.shape)
    for j in range(depth):
        axis_rate = _cross(spin[j], axes[j])
        column_rate = _cross(axis_rate, tip - origins[j])
        column_rate += _cross(axes[j], velocity[-1] - velocity[j])
        if not turns[j].all():
            column_rate = np.where(turns[j] > 0, column_rate, axis_rate)
        bias += column_rate * rate[:, j]
    return bias.transpose(2, 1, 0)
