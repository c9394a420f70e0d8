"""Kinematics of all legs at once, over many samples, in the base frame.

A leg is a serial chain of joints that turn or slide, from the base to a foot point. Coordinates of
joints are angles [rad] or, where the joint slides, lengths [m]. Work arrays keep the Cartesian
component first, legs second and samples last, so that every operation runs over contiguous samples;
that is what makes a batch an order of magnitude faster than a loop over samples with Pinocchio's
Jacobians. The public functions take and return samples first.

`LegColumns` says which columns of a robot's joints belong to which leg, and brings one layout to
the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.robot.leg_chains import LegChains


def _turn(chains: LegChains, j: int, v: Array, cos: Array, sin: Array) -> Array:
    """Rotate v (3, ..., L, N) about joint j's axis by the angle whose cos, sin (L, N) are given.

    The angle is zero where joint j slides or a leg has no such joint.
    """
    along = chains.along[j]
    out = np.empty((3, *np.broadcast_shapes(v.shape[1:], cos.shape)))
    if along is not None:
        c, sign = along
        a, b = (c + 1) % 3, (c + 2) % 3
        signed = sign * sin
        out[a] = cos * v[a] - signed * v[b]
        out[b] = signed * v[a] + cos * v[b]
        out[c] = v[c]
        return out
    kx, ky, kz = chains.axis[j].T[:, :, None]  # Rodrigues' rotation
    along_axis = (kx * v[0] + ky * v[1] + kz * v[2]) * (1 - cos)
    out[0] = v[0] * cos + (ky * v[2] - kz * v[1]) * sin + kx * along_axis
    out[1] = v[1] * cos + (kz * v[0] - kx * v[2]) * sin + ky * along_axis
    out[2] = v[2] * cos + (kx * v[1] - ky * v[0]) * sin + kz * along_axis
    return out


def _torque(chains: LegChains, j: int, arm: Array, f: Array) -> Array:
    """What f (3, L, N) at arm (3, L, N or 1) does at joint j, (L, N): moment, or force along it."""
    axis, along = chains.axis[j], chains.along[j]
    turning: Array
    if along is None:
        (kx, ky, kz), moment = axis.T[:, :, None], cross(arm, f)
        turning = kx * moment[0] + ky * moment[1] + kz * moment[2]
    else:
        c, sign = along
        a, b = (c + 1) % 3, (c + 2) % 3
        turning = sign * (arm[a] * f[b] - arm[b] * f[a])
    if not chains.slides[j].any():
        return turning
    return np.where(chains.slides[j][:, None], np.einsum("lc,cln->ln", axis, f), turning)


def _to_parent(chains: LegChains, j: int, v: Array) -> Array:
    """From joint j's frame before its own rotation to its parent's axes; often nothing to do."""
    if not chains.turned[j]:
        return v
    return np.einsum("lij,j...ln->i...ln", chains.rotation[j], v)


def cross(a: Array, b: Array) -> Array:
    """Of vectors whose components stand along the first axis."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    return out


def samples_last(q: Array) -> Array:
    """From (N, L, K) to (L, K, N), always a copy."""
    return np.array(np.moveaxis(q, 0, -1), order="C")


def _turned(chains: LegChains, coordinate: Array) -> tuple[Array, Array, Array | None]:
    """Cosines and sines of joints that turn, displacements of those that slide, each (L, K, N).

    Overwrites the coordinates; None where no joint slides.
    """
    shift = None
    if not chains.turning_only:
        slides = chains.slides.T[:, :, None]
        shift = np.where(slides, coordinate, 0.0) if slides.any() else None
        coordinate *= chains.real[:, :, None] & ~slides
    return np.cos(coordinate), np.sin(coordinate, out=coordinate), shift


@dataclass(frozen=True)
class LegPosture:
    """Sines, lever arms and feet of the legs: what forces and positions share."""

    chains: LegChains  #: The legs.
    cos: Array  #: Of the joint angles, shape (L, K, N); 1 where a joint slides or is none.
    sin: Array  #: Likewise.
    #: By joint, from its origin to the foot in its own frame [m], shape (3, L, N), or (3, L, 1) for
    #: the last one; K of them.
    arm: tuple[Array, ...]
    foot: Array  #: Foot points in the base frame [m], shape (3, L, N).

    @property
    def feet(self) -> Array:
        """Foot points in the base frame [m], shape (N, L, 3)."""
        return self.foot.transpose(2, 1, 0)

    def force_torques(self, force: Array) -> Array:
        """Joint torques J^T f that forces on the first F of the feet put into their joints.

        `force`: in the base frame [N], shape (N, F, 3). Returns torques [N*m], forces [N] where a
        joint slides, shape (N, F, K), positive in the joints' positive directions; zero where a leg
        has no joint.
        """
        n, k, _ = force.shape
        chains = self.chains if k == len(self.chains.names) else self.chains.of(range(k))
        f = np.ascontiguousarray(force.transpose(2, 1, 0))
        torque = np.empty((n, k, chains.depth))
        for j in range(chains.depth):
            if chains.turned[j]:  # the inverse of `_to_parent`
                f = np.einsum("lji,jln->iln", chains.rotation[j], f)
            f = _turn(chains, j, f, self.cos[:k, j], -self.sin[:k, j])
            torque[:, :, j] = _torque(chains, j, self.arm[j][:, :k], f).T
        return torque


def leg_posture(chains: LegChains, q: Array) -> LegPosture:
    """Work out the legs at joint positions q [rad, m], shape (N, L, K)."""
    cos, sin, shift = _turned(chains, samples_last(q))
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
    """Foot points in the base frame [m], (N, L, 3), at joint positions q [rad, m], (N, L, K)."""
    return leg_posture(chains, q).feet


@dataclass(frozen=True)
class Swept:
    """What the joints do to the feet, in the base frame, component first."""

    tip: Array  #: Foot points [m], shape (3, L, N).
    #: Velocity of the foot per unit of each joint's [m/rad, 1], shape (3, K, L, N); zero where a
    #: leg has no joint.
    columns: Array
    axes: Array | None  #: Unit axes, shape (3, K, L, N); None where they were not asked for.


def swept(chains: LegChains, coordinate: Array, *, axes: bool = False) -> Swept:
    """Feet and the columns of their Jacobians, from the foot inward.

    `coordinate`: joint positions [rad, m], shape (L, K, N); overwritten.
    """
    cos, sin, shift = _turned(chains, coordinate)
    n_legs, depth, n = cos.shape
    # One array of vectors that every joint further in carries along: the foot, then from the
    # outermost joint inward each joint's column and, where asked for, its axis.
    step = 2 if axes else 1
    carried = np.empty((3, 1 + step * depth, n_legs, n))
    carried[:, 0] = chains.foot.T[:, :, None]
    for k, j in enumerate(reversed(range(depth))):
        own = chains.axis[j].T[:, :, None]
        if shift is not None:
            carried[:, 0] += own * shift[:, j]
        column = cross(own, carried[:, 0])
        if chains.slides[j].any():
            column = np.where(chains.slides[j][:, None], own, column)
        carried[:, 1 + step * k] = column
        if axes:
            carried[:, 2 + step * k] = own
        here = carried[:, : 1 + step * (k + 1)]
        here[:] = _to_parent(chains, j, _turn(chains, j, here, cos[:, j], sin[:, j]))
        carried[:, 0] += chains.offset[j].T[:, :, None]
    columns = carried[:, 1::step][:, ::-1]
    return Swept(carried[:, 0], columns, carried[:, 2::step][:, ::-1] if axes else None)


def foot_jacobians(chains: LegChains, q: Array) -> tuple[Array, Array]:
    """Foot points [m], (N, L, 3), and their Jacobians [m/rad, 1], (N, L, 3 xyz, K joints).

    In the base frame, at joint positions `q` [rad, m], shape (N, L, K); a column is zero where a
    leg has no joint.
    """
    legs = swept(chains, samples_last(q))
    return legs.tip.transpose(2, 1, 0), legs.columns.transpose(3, 2, 0, 1)


def foot_jacobian_rates(chains: LegChains, q: Array, q_dot: Array) -> Array:
    """Time derivative of the foot Jacobians times the joint velocity.

    `q`: joint positions [rad, m], `q_dot`: velocities [rad/s, m/s], shape (N, L, K). Returns the
    feet's acceleration while all joints keep their velocity [m/s^2], shape (N, L, 3).
    """
    rate = samples_last(q_dot)
    cos, sin, shift = _turned(chains, samples_last(q))
    n_legs, depth, n = cos.shape
    # Place, velocity and acceleration of the foot as seen from what the joint carries.
    seen = np.zeros((3, 3, n_legs, n))
    seen[:, 0] = chains.foot.T[:, :, None]
    for j in reversed(range(depth)):
        own, speed = chains.axis[j].T[:, :, None], rate[:, j]
        if shift is not None:
            seen[:, 0] += own * shift[:, j]
        slides = chains.slides[j][:, None]
        spin = own * np.where(slides, 0.0, speed)
        turning = cross(spin, seen[:, 0])  # relative velocity that the joint's turning adds
        seen[:, 2] += cross(spin, 2 * seen[:, 1] + turning)
        seen[:, 1] += turning
        if chains.slides[j].any():
            seen[:, 1] += own * np.where(slides, speed, 0.0)
        seen = _to_parent(chains, j, _turn(chains, j, seen, cos[:, j], sin[:, j]))
        seen[:, 0] += chains.offset[j].T[:, :, None]
    return seen[:, 2].transpose(2, 1, 0)


@dataclass(frozen=True, eq=False)
class LegColumns:
    """Legs of up to K joints among J columns; joints outside the legs belong to none."""

    #: Of each leg's joints, shape (L, K). Where a leg has fewer, its last joint's column stands
    #: once more: reading there is harmless, for the kinematics pays no heed to it; writing goes
    #: through `by_joint` or `of`.
    columns: NDArray[np.intp]
    counts: NDArray[np.intp]  #: Joints of each leg, shape (L,).
    size: int  #: J, joints outside the legs included.

    @cached_property
    def real(self) -> NDArray[np.bool_]:
        """Which of `columns` are a leg's own, shape (L, K)."""
        real: NDArray[np.bool_] = np.arange(self.columns.shape[1]) < self.counts[:, None]
        return real

    @cached_property
    def _in_a_row(self) -> bool:
        every = np.arange(self.size, dtype=np.intp)
        return bool(self.real.all() and np.array_equal(self.columns.ravel(), every))

    @cached_property
    def places(self) -> NDArray[np.intp]:
        """Leg of every column and the joint's number in it, shape (J, 2); -1 outside the legs."""
        out = np.full((self.size, 2), -1, dtype=np.intp)
        out[self.columns[self.real]] = np.argwhere(self.real)
        return out

    def of(self, leg: int) -> NDArray[np.intp]:
        """The columns of one leg, as many as it has joints."""
        return self.columns[leg, : self.counts[leg]]

    def by_leg(self, values: Array) -> Array:
        """Joints' values by leg, zero where a leg has no joint: (N, J) to (N, L, K)."""
        if self._in_a_row:
            return values.reshape(values.shape[0], *self.columns.shape)
        return np.where(self.real, values[:, self.columns], 0.0)

    def by_joint(self, values: Array, elsewhere: Array | float = 0.0) -> Array:
        """Legs' values by joint: (N, L, K) to (N, J).

        `values`: by leg; what stands where a leg has no joint is dropped. `elsewhere`: for joints
        outside the legs, shape (J,) or one number.
        """
        if self._in_a_row:
            return values.reshape(values.shape[0], self.size)
        out = np.empty((values.shape[0], self.size))
        out[:] = elsewhere
        out[:, self.columns[self.real]] = values[:, self.real]
        return out


def leg_columns(joints: Sequence[str], legs: Sequence[Sequence[str]]) -> LegColumns:
    """Where the legs' joints stand among all."""
    at = {name: k for k, name in enumerate(joints)}
    depth = max((len(leg) for leg in legs), default=0)
    columns = np.array(
        [[at[name] for name in (*leg, *[leg[-1]] * (depth - len(leg)))] for leg in legs],
        dtype=np.intp,
    ).reshape(len(legs), depth)
    counts = np.array([len(leg) for leg in legs], dtype=np.intp)
    return LegColumns(columns, counts, len(joints))
