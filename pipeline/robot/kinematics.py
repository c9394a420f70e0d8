"""Feet of the legs, their Jacobians and rates in the base frame, over many samples, by Pinocchio.

A leg is a chain of joints of one coordinate [rad, m] from the base to a foot point. Legs may differ
in their number of joints: arrays have K columns, as many as the longest leg, and what stands beyond
a leg's own joints is zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError, known

_ON_EDGE = 1e-12  # [m]


@dataclass(frozen=True, eq=False)
class LegChains:
    """L legs of up to K joints of a Pinocchio model whose base stands at the origin.

    Among the J columns of a robot's joints those outside the legs belong to none.
    """

    model: pin.Model  #: The robot's joints; of its frames only the feet.
    names: tuple[str, ...]  #: Leg names.
    joints: tuple[tuple[int, ...], ...]  #: Indices in the model, from the base outward.
    frames: tuple[int, ...]  #: Of the feet.
    #: Of each leg's joints among the J, shape (L, K). Where a leg has fewer, its last joint's
    #: column stands once more: read with `by_leg`, write with `by_joint`.
    columns: NDArray[np.intp]
    size: int  #: J.

    @cached_property
    def counts(self) -> NDArray[np.intp]:
        """Joints of each leg, shape (L,)."""
        return np.array([len(path) for path in self.joints], dtype=np.intp)

    @cached_property
    def real(self) -> NDArray[np.bool_]:
        """Which joints exist, shape (L, K)."""
        real: NDArray[np.bool_] = np.arange(self.columns.shape[1]) < self.counts[:, None]
        return real

    @property
    def _each(self) -> list[pin.JointModel]:
        return [self.model.joints[k] for path in self.joints for k in path]

    @cached_property
    def hips(self) -> Array:
        """Origin of each leg's first joint in the base frame [m], shape (L, 3)."""
        return np.array([self.model.jointPlacements[path[0]].translation for path in self.joints])

    @cached_property
    def reach(self) -> Array:
        """Length of each leg stretched out, from its first joint [m], shape (L,)."""
        out = []
        for path, frame in zip(self.joints, self.frames, strict=True):
            ways = [self.model.jointPlacements[k] for k in path[1:]]
            ways.append(self.model.frames[frame].placement)
            out.append(float(sum(np.linalg.norm(way.translation) for way in ways)))
        return np.array(out)

    @cached_property
    def tangents(self) -> NDArray[np.intp]:
        """Columns of the joints in Pinocchio's velocities, shape (L, K); 0 where there is none."""
        out = np.zeros(self.real.shape, dtype=np.intp)
        out[self.real] = [joint.idx_v for joint in self._each]
        return out

    @cached_property
    def leg_of(self) -> NDArray[np.intp]:
        """Leg of every column, shape (J,); -1 outside the legs."""
        out = np.full(self.size, -1, dtype=np.intp)
        out[self.columns[self.real]] = np.nonzero(self.real)[0]
        return out

    def configurations(self, q: Array) -> Array:
        """Pinocchio's, all else neutral, at joint positions q [rad, m]: (N, L, K) to (N, nq)."""
        out = np.tile(pin.neutral(self.model), (len(q), 1))
        out[:, [joint.idx_q for joint in self._each]] = q[:, self.real]
        return out

    def of(self, leg: int) -> NDArray[np.intp]:
        """The columns of one leg, as many as it has joints."""
        return self.columns[leg, : self.counts[leg]]

    def by_leg(self, values: Array) -> Array:
        """Joints' values by leg, zero where a leg has no joint: (N, J) to (N, L, K)."""
        return np.where(self.real, values[:, self.columns], 0.0)

    def by_joint(self, values: Array, elsewhere: Array | float = 0.0) -> Array:
        """Legs' values by joint, `elsewhere` (J,) outside the legs: (N, L, K) to (N, J)."""
        out = np.empty((values.shape[0], self.size))
        out[:] = elsewhere
        out[:, self.columns[self.real]] = values[:, self.real]
        return out


def leg_chains(
    model: pin.Model,
    legs: Sequence[tuple[str, Sequence[str], str]],
    base_joint: int,
    joints: Sequence[str],
) -> LegChains:
    """Look the legs up in a model.

    `legs`: for each its name, its joints from the base outward and the foot frame. `base_joint`:
    index of the joint that carries the base (0 for a fixed one). `joints`: names of all columns.

    Raises:
        LegwattError: A joint or frame is missing, of several coordinates, or not the child of the
            one before.
    """
    paths, frames = [], []
    for leg, names, foot in legs:
        where, path = f"leg '{leg}'", [base_joint]
        for name in names:
            if model.existFrame(name, pin.FrameType.FIXED_JOINT):
                raise LegwattError(f"{where}: joint '{name}' is fixed; list those that move")
            known(f"{where}: the URDF has no joint", name, list(model.names)[1:])
            path.append(int(model.getJointId(name)))
            parent = model.parents[path[-1]]
            if parent != path[-2]:
                words = f"hangs on '{model.names[parent]}', not on '{model.names[path[-2]]}'"
                raise LegwattError(f"{where}: joint '{name}' {words}; list joints outward")
            if model.joints[path[-1]].nq != 1:
                raise LegwattError(f"{where}: joint '{name}' is of several coordinates")
        known(f"{where}: the URDF has no frame", foot, [f.name for f in model.frames])
        frames.append(model.frames[model.getFrameId(foot)])
        carrier = frames[-1].parentJoint
        if carrier != path[-1]:
            words = f"is not carried by '{names[-1]}', the last of its joints"
            raise LegwattError(f"{where}: foot '{foot}' {words}, but by '{model.names[carrier]}'")
        paths.append(tuple(path[1:]))
    lean = pin.Model()  # without the frames of sensors and shells, which would be placed each time
    for k in range(1, model.njoints):
        lean.addJoint(model.parents[k], model.joints[k], model.jointPlacements[k], model.names[k])
    feet = tuple(int(lean.addFrame(frame)) for frame in frames)
    at, depth = {name: k for k, name in enumerate(joints)}, max(map(len, paths), default=0)
    columns = [[at[n] for n in (*own, *[own[-1]] * (depth - len(own)))] for _, own, _ in legs]
    table = np.array(columns, dtype=np.intp).reshape(len(legs), depth)
    return LegChains(lean, tuple(leg for leg, *_ in legs), tuple(paths), feet, table, len(joints))


@dataclass(frozen=True)
class LegPosture:
    """Where the feet are and what the joints do to them, in the base frame."""

    feet: Array  #: Foot points [m], shape (N, L, 3).
    #: Velocity of the foot per unit of each joint's [m/rad, 1], shape (N, L, K, 3).
    columns: Array
    axes: Array  #: Unit axes of joints that turn, zero of those that slide, shape (N, L, K, 3).

    def force_torques(self, force: Array) -> Array:
        """Joint torques J^T f [N*m, N where a joint slides], shape (N, L, K).

        `force`: on the feet, in the base frame [N], shape (N, L, 3).
        """
        return np.asarray((self.columns @ force[..., None])[..., 0])


def leg_posture(chains: LegChains, q: Array) -> LegPosture:
    """Work out the legs at joint positions q [rad, m], shape (N, L, K)."""
    model, data = chains.model, chains.model.createData()
    rows = chains.configurations(q)
    spatial = np.empty((len(rows), model.nv, 6))
    feet = np.empty((len(rows), len(chains.names), 3))
    # Views of what Pinocchio writes: asking for each anew would take most of the time.
    moved, places = data.J.T, [data.oMf[frame].translation for frame in chains.frames]
    for n, row in enumerate(rows):
        pin.computeJointJacobians(model, data, row)
        pin.updateFramePlacements(model, data)
        spatial[n] = moved
        feet[n] = places
    # Per unit of each joint's velocity: that of the point at the base's origin, and turning.
    # In memory components stand first and samples last, so that operations run over samples.
    by_leg = np.ascontiguousarray(spatial.transpose(2, 1, 0))[:, chains.tangents]
    by_leg *= chains.real[..., None]
    linear, axes = by_leg[:3].transpose(3, 1, 2, 0), by_leg[3:].transpose(3, 1, 2, 0)
    arm = np.ascontiguousarray(feet.transpose(2, 1, 0)).transpose(2, 1, 0)[:, :, None]
    return LegPosture(feet, linear + cross(axes, arm), axes)


def foot_positions(chains: LegChains, q: Array) -> Array:
    """Foot points in the base frame [m], (N, L, 3), at joint positions q [rad, m], (N, L, K)."""
    model, data = chains.model, chains.model.createData()
    feet = np.empty((len(q), len(chains.names), 3))
    places = [data.oMf[frame].translation for frame in chains.frames]
    for n, row in enumerate(chains.configurations(q)):
        pin.framesForwardKinematics(model, data, row)
        feet[n] = places
    return feet


def foot_jacobians(chains: LegChains, q: Array) -> tuple[Array, Array]:
    """Foot points [m], (N, L, 3), and Jacobians [m/rad, 1], (N, L, 3 xyz, K), in the base frame."""
    legs = leg_posture(chains, q)
    return legs.feet, legs.columns.swapaxes(-1, -2)


def foot_jacobian_rates(chains: LegChains, q: Array, q_dot: Array) -> Array:
    """Acceleration of the feet while all joints keep their velocity [m/s^2], shape (N, L, 3).

    `q`: joint positions [rad, m], `q_dot`: velocities [rad/s, m/s], shape (N, L, K).
    """
    legs = leg_posture(chains, q)
    return np.asarray((column_rates(legs, q_dot) * q_dot[..., None]).sum(axis=2))


def column_rates(legs: LegPosture, q_dot: Array) -> Array:
    """Time derivative of `LegPosture.columns`, shape (N, L, K, 3); `q_dot` has shape (N, L, K).

    What a joint carries turns with all joints up to it, and its own turning moves with the motion
    of the foot that joints further out add.
    """
    spin, moved = legs.axes * q_dot[..., None], legs.columns * q_dot[..., None]
    further = moved.sum(axis=2, keepdims=True) - np.cumsum(moved, axis=2)
    return cross(np.cumsum(spin, axis=2), legs.columns) + cross(legs.axes, further)


def cross(a: Array, b: Array) -> Array:
    """Of vectors whose components stand along the last axis; several times as fast as NumPy's."""
    out = np.empty_like(a + b)
    for x, y, z in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., x] = a[..., y] * b[..., z] - a[..., z] * b[..., y]
    return out


def edge_distances(feet: Array, point: Array) -> tuple[Array, Array]:
    """How far points lie inside every edge of the feet's convex hull, seen from above.

    An edge is a line from one foot to another with all feet on it or to its left. `feet`: in any
    order [m], shape (N, F, 2 or more). `point`: shape (N, 2). Returns distances to the E lines
    between two feet [m], shape (N, E), infinite for lines that are no edge, and unit vectors to
    their left, shape (N, E, 2).
    """
    xy, n_feet = feet[..., :2], feet.shape[1]
    first, second = np.nonzero(~np.eye(n_feet, dtype=np.bool_))
    along = xy[:, second] - xy[:, first]
    inward = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    with np.errstate(invalid="ignore"):  # of feet at one place no line is an edge
        inward /= np.linalg.norm(along, axis=-1, keepdims=True)
    others = np.concatenate([xy, point[:, None]], axis=1)
    left = np.einsum("nek,nepk->nep", inward, others[:, None] - xy[:, first, None])
    is_edge = (left[..., :-1] >= -_ON_EDGE).all(axis=-1)
    return np.where(is_edge, left[..., -1], np.inf), inward


def support_margin(feet: Array, point: Array) -> Array:
    """Distance of a point from the nearest edge of the feet's convex hull, seen from above.

    `feet`: [m], shape (N, F, 3). `point`: [m], shape (N, 2). Returns shape (N,); negative outside.
    """
    return np.asarray(edge_distances(feet, point)[0].min(axis=1))
