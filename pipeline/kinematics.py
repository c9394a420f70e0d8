"""Kinematics of all legs at once, over many samples, in the base frame.

A leg is a serial chain of three revolute joints from the base to a foot point. Work arrays keep the
Cartesian component first, legs second and samples last, so that every operation runs over
contiguous samples; that is what makes a batch an order of magnitude faster than a loop over
samples with Pinocchio's Jacobians. The public functions take and return samples first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.errors import closest
from pipeline.errors import UrdfError

Array = NDArray[np.float64]
JOINTS_PER_LEG = 3


@dataclass(frozen=True)
class LegChains:
    """Constant geometry of L legs with three joints each, read from a Pinocchio model.

    Attributes:
        names: Leg names.
        rotation: Placement of each joint in its parent, shape (3 joints, L, 3, 3).
        offset: Origin of each joint in its parent [m], shape (3 joints, L, 3).
        axis: Unit axis of each joint in its own frame, shape (3 joints, L, 3).
        foot: Foot point in the frame of the last joint [m], shape (L, 3).
    """

    names: tuple[str, ...]
    rotation: Array
    offset: Array
    axis: Array
    foot: Array


def leg_chains(
    model: pin.Model, legs: Sequence[tuple[str, Sequence[str], str]], base_joint: int
) -> LegChains:
    """Read the legs' geometry out of a model.

    Args:
        model: Pinocchio model.
        legs: For each leg its name, its three joint names from the base outward and the foot frame.
        base_joint: Index of the joint that carries the base (0 for a fixed base).

    Raises:
        UrdfError: A joint or frame is missing, not revolute, or not the child of the one before.
    """
    n_legs = len(legs)
    rotation = np.empty((JOINTS_PER_LEG, n_legs, 3, 3))
    offset = np.empty((JOINTS_PER_LEG, n_legs, 3))
    axis = np.empty((JOINTS_PER_LEG, n_legs, 3))
    foot = np.empty((n_legs, 3))
    for i, (leg, joints, frame_name) in enumerate(legs):
        if len(joints) != JOINTS_PER_LEG:
            raise UrdfError(f"leg '{leg}' names {len(joints)} joints; a leg has {JOINTS_PER_LEG}")
        parent = base_joint
        for j, joint in enumerate(joints):
            if not model.existJointName(joint):
                raise UrdfError(
                    f"leg '{leg}': joint '{joint}' is not in the URDF; "
                    f"{closest(joint, list(model.names)[1:])}"
                )
            index = model.getJointId(joint)
            if model.parents[index] != parent:
                raise UrdfError(
                    f"leg '{leg}': joint '{joint}' hangs on '{model.names[model.parents[index]]}', "
                    f"not on '{model.names[parent]}'; list the joints from the base outward"
                )
            if model.joints[index].nq != 1 or model.joints[index].nv != 1:
                raise UrdfError(f"leg '{leg}': joint '{joint}' is not a revolute joint")
            placement = model.jointPlacements[index]
            rotation[j, i] = placement.rotation
            offset[j, i] = placement.translation
            axis[j, i] = _axis(model, index, leg, joint)
            parent = index
        if not model.existFrame(frame_name):
            known = [frame.name for frame in model.frames]
            raise UrdfError(
                f"leg '{leg}': foot '{frame_name}' is not a frame of the URDF; "
                f"{closest(frame_name, known)}"
            )
        frame = model.frames[model.getFrameId(frame_name)]
        if frame.parentJoint != parent:
            raise UrdfError(f"leg '{leg}': foot '{frame_name}' is not carried by '{joints[-1]}'")
        foot[i] = frame.placement.translation
    return LegChains(tuple(leg for leg, _, _ in legs), rotation, offset, axis, foot)


def _axis(model: pin.Model, index: int, leg: str, joint: str) -> Array:
    # The motion subspace of a revolute joint is (0, axis): ask Pinocchio rather than parse names.
    data = model.joints[index].createData()
    q = pin.neutral(model)
    model.joints[index].calc(data, q[model.joints[index].idx_q :][:1])
    subspace = np.asarray(data.S).reshape(6)
    if np.any(np.abs(subspace[:3]) > 0) or abs(np.linalg.norm(subspace[3:]) - 1) > 1e-9:
        raise UrdfError(f"leg '{leg}': joint '{joint}' is not a revolute joint")
    return subspace[3:]


def _turn(v: Array, axis: Array, cos: Array, sin: Array) -> Array:
    """Rodrigues' rotation of v (3, L, N) about axis (L, 3) by the angle whose cos, sin (L, N)."""
    kx, ky, kz = axis[:, 0, None], axis[:, 1, None], axis[:, 2, None]
    along = (kx * v[0] + ky * v[1] + kz * v[2]) * (1 - cos)
    out = np.empty(np.broadcast_shapes(v.shape, (3, *cos.shape)))
    out[0] = v[0] * cos + (ky * v[2] - kz * v[1]) * sin + kx * along
    out[1] = v[1] * cos + (kz * v[0] - kx * v[2]) * sin + ky * along
    out[2] = v[2] * cos + (kx * v[1] - ky * v[0]) * sin + kz * along
    return out


def _apply(rotation: Array, v: Array) -> Array:
    """Rotate v (3, L, N) by a constant matrix per leg (L, 3, 3); identity costs nothing."""
    if np.array_equal(rotation, np.broadcast_to(np.eye(3), rotation.shape)):
        return v
    return np.einsum("lij,jln->iln", rotation, v)


def _cross(a: Array, b: Array) -> Array:
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    return out


def _samples_last(q: Array) -> Array:
    return np.ascontiguousarray(np.moveaxis(q, 0, -1))  # (N, L, 3) -> (L, 3, N)


def foot_positions(chains: LegChains, q: Array) -> Array:
    """Foot points in the base frame.

    Args:
        chains: The legs.
        q: Joint positions [rad], shape (N, L, 3).

    Returns:
        Positions [m], shape (N, L, 3).
    """
    angle = _samples_last(q)
    cos, sin = np.cos(angle), np.sin(angle)
    r = np.broadcast_to(chains.foot.T[:, :, None], (3, angle.shape[0], angle.shape[2]))
    for j in reversed(range(JOINTS_PER_LEG)):
        r = _apply(chains.rotation[j], _turn(r, chains.axis[j], cos[:, j], sin[:, j]))
        r = r + chains.offset[j].T[:, :, None]
    return np.moveaxis(r, -1, 0).swapaxes(1, 2)


def foot_force_torques(chains: LegChains, q: Array, force: Array) -> Array:
    """Joint torques J^T f that forces on the feet put into the joints.

    Args:
        chains: The legs.
        q: Joint positions [rad], shape (N, L, 3).
        force: Force on each foot [N] in the base frame, shape (N, L, 3).

    Returns:
        Torques [N*m], shape (N, L, 3), positive in the joints' positive directions.
    """
    angle = _samples_last(q)
    cos, sin = np.cos(angle), np.sin(angle)
    arm: list[Array] = [np.empty(0)] * JOINTS_PER_LEG  # joint j to foot, in frame j
    r = np.broadcast_to(chains.foot.T[:, :, None], (3, angle.shape[0], angle.shape[2]))
    for j in reversed(range(JOINTS_PER_LEG)):
        arm[j] = r
        if j:
            r = _apply(chains.rotation[j], _turn(r, chains.axis[j], cos[:, j], sin[:, j]))
            r = r + chains.offset[j].T[:, :, None]
    f = np.ascontiguousarray(np.moveaxis(force, 0, -1).swapaxes(0, 1))  # (3, L, N)
    torque = np.empty((q.shape[0], q.shape[1], JOINTS_PER_LEG))
    for j in range(JOINTS_PER_LEG):
        f = _apply(chains.rotation[j].swapaxes(1, 2), f)
        f = _turn(f, chains.axis[j], cos[:, j], -sin[:, j])
        moment = _cross(arm[j], f)
        k = chains.axis[j]
        torque[:, :, j] = (
            k[:, 0, None] * moment[0] + k[:, 1, None] * moment[1] + k[:, 2, None] * moment[2]
        ).T
    return torque


def _frames(chains: LegChains, q: Array) -> tuple[Array, Array, Array]:
    """Joint axes and origins (3 joints, 3, L, N) and foot (3, L, N) in the base frame."""
    angle = _samples_last(q)
    n_legs, _, n = angle.shape
    cos, sin = np.cos(angle), np.sin(angle)

    def to_base(v: Array, joint: int, *, point: bool) -> Array:
        # v is given in the frame of `joint`, after that joint's own rotation.
        for j in reversed(range(joint + 1)):
            v = _apply(chains.rotation[j], _turn(v, chains.axis[j], cos[:, j], sin[:, j]))
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
