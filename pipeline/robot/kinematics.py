"""Kinematics of all legs at once, over many samples, in the base frame.

A leg is a serial chain of three revolute joints from the base to a foot point. Work arrays keep the
Cartesian component first, legs second and samples last, so that every operation runs over
contiguous samples; that is what makes a batch an order of magnitude faster than a loop over
samples with Pinocchio's Jacobians. The public functions take and return samples first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.robot.leg_chains import JOINTS_PER_LEG, LegChains

Array = NDArray[np.float64]


def _turn(chains: LegChains, j: int, v: Array, cos: Array, sin: Array) -> Array:
    """Rotate v (3, L, N) about the axis of joint j by the angle whose cos, sin (L, N) are given."""
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
    return np.array(np.moveaxis(q, 0, -1), order="C")  # (N, L, 3) -> (L, 3, N), always a copy


@dataclass(frozen=True)
class LegPosture:
    """Sines, lever arms and feet of the legs: what forces and positions share.

    Attributes:
        chains: The legs.
        cos: Of the joint positions, shape (L, 3, N).
        sin: Likewise.
        arm: By joint, from its origin to the foot in its own frame [m], shape (3, L, N), or
            (3, L, 1) for the last one.
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
        """Joint torques J^T f that forces on the first K of the feet put into their joints.

        Args:
            force: In the base frame [N], shape (N, K, 3).

        Returns:
            Torques [N*m], shape (N, K, 3), positive in the joints' positive directions.
        """
        n, k, _ = force.shape
        chains = self.chains if k == len(self.chains.names) else self.chains.of(range(k))
        f = np.ascontiguousarray(force.transpose(2, 1, 0))
        torque = np.empty((n, k, JOINTS_PER_LEG))
        for j in range(JOINTS_PER_LEG):
            f = _from_parent(chains, j, f)
            f = _turn(chains, j, f, self.cos[:k, j], -self.sin[:k, j])
            torque[:, :, j] = _moment(chains, j, self.arm[j][:, :k], f).T
        return torque


def leg_posture(chains: LegChains, q: Array) -> LegPosture:
    """Work out the legs at joint positions q [rad], shape (N, L, 3)."""
    return posture_at(chains, _samples_last(q))


def posture_at(chains: LegChains, angle: Array) -> LegPosture:
    """Work out the legs at joint positions that are the caller's to give away.

    Args:
        chains: The legs.
        angle: Joint positions [rad], shape (L, 3, N); overwritten.
    """
    cos, sin = np.cos(angle), np.sin(angle, out=angle)
    arm: list[Array] = []
    r = chains.foot.T[:, :, None]
    for j in reversed(range(JOINTS_PER_LEG)):
        arm.insert(0, r)
        r = _to_parent(chains, j, _turn(chains, j, r, cos[:, j], sin[:, j]))
        r += chains.offset[j].T[:, :, None]
    return LegPosture(chains, cos, sin, tuple(arm), r)


def foot_positions(chains: LegChains, q: Array) -> Array:
    """Foot points in the base frame.

    Args:
        chains: The legs.
        q: Joint positions [rad], shape (N, L, 3).

    Returns:
        Positions [m], shape (N, L, 3).
    """
    return leg_posture(chains, q).feet


def foot_force_torques(chains: LegChains, q: Array, force: Array) -> Array:
    """Joint torques J^T f that forces on the feet put into the joints.

    Args:
        chains: The legs.
        q: Joint positions [rad], shape (N, L, 3).
        force: Force on each foot [N] in the base frame, shape (N, L, 3).

    Returns:
        Torques [N*m], shape (N, L, 3), positive in the joints' positive directions.
    """
    return leg_posture(chains, q).force_torques(force)


def _frames(chains: LegChains, q: Array) -> tuple[Array, Array, Array]:
    """Joint axes and origins (3 joints, 3, L, N) and foot (3, L, N) in the base frame."""
    angle = _samples_last(q)
    n_legs, _, n = angle.shape
    cos, sin = np.cos(angle), np.sin(angle)

    def to_base(v: Array, joint: int, *, point: bool) -> Array:
        # v is given in the frame of `joint`, after that joint's own rotation.
        for j in reversed(range(joint + 1)):
            v = _to_parent(chains, j, _turn(chains, j, v, cos[:, j], sin[:, j]))
            if point:
                v = v + chains.offset[j].T[:, :, None]
        return v

    axes = np.empty((JOINTS_PER_LEG, 3, n_legs, n))
    origins = np.empty_like(axes)
    zero = np.zeros((3, n_legs, n))
    for j in range(JOINTS_PER_LEG):
        own = np.broadcast_to(chains.axis[j].T[:, :, None], zero.shape)
        axes[j] = to_base(own, j, point=False)
        origins[j] = to_base(zero, j, point=True)
    tip = np.broadcast_to(chains.foot.T[:, :, None], zero.shape)
    return axes, origins, to_base(tip, JOINTS_PER_LEG - 1, point=True)


def foot_jacobians(chains: LegChains, q: Array) -> tuple[Array, Array]:
    """Foot points and their Jacobians in the base frame.

    Args:
        chains: The legs.
        q: Joint positions [rad], shape (N, L, 3).

    Returns:
        Positions [m], shape (N, L, 3), and Jacobians [m/rad], shape (N, L, 3 xyz, 3 joints).
    """
    axes, origins, tip = _frames(chains, q)
    columns = [_cross(axes[j], tip - origins[j]) for j in range(JOINTS_PER_LEG)]
    jacobian = np.stack(columns)  # joint, xyz, leg, sample
    return tip.transpose(2, 1, 0), jacobian.transpose(3, 2, 1, 0)


def foot_jacobian_rates(chains: LegChains, q: Array, q_dot: Array) -> Array:
    """Time derivative of the foot Jacobians times the joint velocity.

    Args:
        chains: The legs.
        q: Joint positions [rad], shape (N, L, 3).
        q_dot: Joint velocities [rad/s], shape (N, L, 3).

    Returns:
        The bias acceleration of the feet [m/s^2], shape (N, L, 3).
    """
    axes, origins, tip = _frames(chains, q)
    rate = _samples_last(q_dot)  # (L, 3, N)
    spin = np.zeros((JOINTS_PER_LEG + 1, *tip.shape))  # angular velocity of what joint j hangs on
    for j in range(JOINTS_PER_LEG):
        spin[j + 1] = spin[j] + axes[j] * rate[:, j]
    velocity = np.zeros((JOINTS_PER_LEG + 1, *tip.shape))  # of the joint origins, then of the foot
    points = [*origins, tip]
    for j in range(JOINTS_PER_LEG):
        velocity[j + 1] = velocity[j] + _cross(spin[j + 1], points[j + 1] - points[j])
    bias = np.zeros(tip.shape)
    for j in range(JOINTS_PER_LEG):
        axis_rate = _cross(spin[j], axes[j])
        column_rate = _cross(axis_rate, tip - origins[j])
        column_rate += _cross(axes[j], velocity[-1] - velocity[j])
        bias += column_rate * rate[:, j]
    return bias.transpose(2, 1, 0)
