"""Torque at the joints that bodies, gravity and ground ask for along a measured motion.

Inverse dynamics in one batch (`rneaInParallel`). Where a walking robot's foot forces are measured,
they are the ground's forces and tell how the base accelerates. Else the base moves as its standing
feet let it (they do not move, and the base does not rotate), and the ground's forces are those of
`pipeline.dynamics.contact_forces` with the least tangential parts.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.dynamics.contact_forces import least_tangential_forces
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import Bodies, MachineModel
from pipeline.robot.kinematics import (
    foot_force_torques,
    foot_jacobian_rates,
    foot_jacobians,
    foot_positions,
)

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
_BLOCK = 2048
_MANY = 8192  # rows from which a second thread pays


def changed_model(rigid: pin.Model, bodies: Bodies) -> pin.Model:
    """The Pinocchio model with payloads, shifts, scales and tilt in it.

    A payload is a point mass at the (unshifted) centre of mass, which it leaves where it is.
    """
    if not bodies.changes and bodies.tilt == (0.0, 0.0):
        return rigid
    model = rigid.copy()
    for joint, change in bodies.changes:
        index = model.getJointId(joint)
        body = model.inertias[index]
        changed = pin.Inertia(
            change.scale * body.mass + change.payload,
            body.lever + np.array(change.shift),
            change.scale * change.inertia_scale * body.inertia,
        )
        if any(change.carried):
            ten = np.asarray(changed.toDynamicParameters()) + point_mass(change.carried)
            changed = pin.Inertia.FromDynamicParameters(ten)
        model.inertias[index] = changed
    roll, pitch = bodies.tilt
    if roll or pitch:
        tilt = pin.rpy.rpyToMatrix(roll, pitch, 0.0)  # ground to level
        model.gravity.linear = tilt.T @ rigid.gravity.linear
    return model


def point_mass(carried: Sequence[float]) -> Array:
    """Inertial parameters (10,) of a point mass about the origin of its first moments.

    Args:
        carried: Mass [kg] and first moments [kg*m]; without a mass the moments alone.
    """
    mass, *moments = carried
    m = np.array(moments)
    turning = (m @ m * np.eye(3) - np.outer(m, m)) / mass if mass else np.zeros((3, 3))
    return np.array([mass, *m, *turning[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]])


class RigidBodies:
    """Inverse dynamics of many models along one measured motion.

    What depends on the motion and the measured forces alone is computed once.
    """

    def __init__(self, measurement: Measurement) -> None:
        self.measurement = measurement
        self._base: tuple[Array, Array] | None = None
        self._ground: tuple[Array, object, Array] | None = None

    def torque(self, machine: MachineModel, motion: tuple[Array, Array, Array]) -> Array:
        """Joint torques, shape (N, J) [N*m].

        Args:
            machine: Its bodies, ground and legs.
            motion: Position, velocity and acceleration of the joints, each (N, J).
        """
        m = self.measurement
        model = changed_model(machine.rigid, machine.bodies)
        n = motion[0].shape[0]
        index_q = np.array([model.joints[model.getJointId(j)].idx_q for j in machine.joints])
        index_v = np.array([model.joints[model.getJointId(j)].idx_v for j in machine.joints])
        q = np.tile(pin.neutral(model), (n, 1))
        v, a = np.zeros((n, model.nv)), np.zeros((n, model.nv))
        _place_joints(model, q, index_q, motion[0])
        v[:, index_v], a[:, index_v] = motion[1], motion[2]
        if machine.floating:
            q[:, 3:7] = _base_turn(m, n).as_quat()
            v[:, :3], a[:, :6] = self._base_motion(machine)
        threads = _threads(n)
        pool = pin.ModelPool(model, threads)
        result = pin.rneaInParallel(threads, pool, q.T, v.T, a.T)
        generalised = np.asarray(result).T.reshape(v.shape)
        torque: Array = generalised[:, index_v]
        if machine.floating and machine.legs is not None:
            torque = torque - self._ground_torque(machine, motion[0], generalised[:, :6])
        return torque

    def _base_motion(self, machine: MachineModel) -> tuple[Array, Array]:
        if self._base is None:
            # What the base did is told by the measured motion, whatever an effect makes of it.
            m = self.measurement
            velocity, acceleration = _base_motion(machine, m, (m.q, m.v, m.a))
            if legs_are_separate(machine, m):
                acceleration = _measured_acceleration(machine, m, velocity)
            else:
                acceleration = np.hstack([acceleration, np.zeros_like(acceleration)])
            self._base = (velocity, acceleration)
        return self._base

    def _ground_torque(self, machine: MachineModel, q: Array, wrench: Array) -> Array:
        m = self.measurement
        rotation = _base_rotation(m, q.shape[0])
        if legs_are_separate(machine, m) and q is m.q:
            # Measured forces ask for nothing of the bodies.
            if self._ground is None or self._ground[1] != machine.bodies.squeeze:
                torque = _ground_torque(machine, m, q, wrench, rotation)
                self._ground = (q, machine.bodies.squeeze, torque)
            return self._ground[2]
        return _ground_torque(machine, m, q, wrench, rotation)


def _threads(rows: int) -> int:
    """Threads worth their start; the result is the same with any number."""
    return min(2, os.cpu_count() or 1) if rows >= _MANY else 1


def legs_are_separate(machine: MachineModel, m: Measurement) -> bool:
    """Whether a body of one leg leaves the torques of all other legs as they are."""
    if not machine.floating:
        return machine.legs is not None
    return m.foot_force is not None and not bool(np.isnan(m.foot_force[0]).any())


def _place_joints(model: pin.Model, q: Array, index_q: NDArray[np.intp], position: Array) -> None:
    for k, start in enumerate(index_q):
        joint = next(j for j in model.joints if j.idx_q == start and j.nv == 1)
        if joint.nq == 2:  # a continuous joint is written as cosine and sine
            q[:, start], q[:, start + 1] = np.cos(position[:, k]), np.sin(position[:, k])
        else:
            q[:, start] = position[:, k]


def _base_turn(m: Measurement, n: int) -> Rotation:
    """Base to world, R_y(pitch) R_x(roll), at every sample."""
    from scipy.spatial.transform import Rotation

    zero = np.zeros(n)
    roll = zero if m.base_roll is None else m.base_roll
    pitch = zero if m.base_pitch is None else m.base_pitch
    return Rotation.from_euler("YX", np.stack([pitch, roll], axis=1))


def _base_rotation(m: Measurement, n: int) -> Array | None:
    """The same as matrices, shape (N, 3, 3); None where the base is level throughout."""
    if m.base_roll is None and m.base_pitch is None:
        return None
    return np.asarray(_base_turn(m, n).as_matrix())


def _base_motion(
    machine: MachineModel, m: Measurement, motion: tuple[Array, Array, Array]
) -> tuple[Array, Array]:
    """Linear velocity and acceleration of the base in its own frame, each (N, 3)."""
    n = motion[0].shape[0]
    velocity, acceleration = np.zeros((n, 3)), np.zeros((n, 3))
    legs, layout = machine.legs, machine.layout
    if legs is None or layout is None or m.standing is None:
        return velocity, acceleration
    q, v, a = (layout.by_leg(x) for x in motion)
    for start in range(0, n, _BLOCK):
        s = slice(start, start + _BLOCK)
        jacobian = foot_jacobians(legs, q[s])[1]
        rate = np.einsum("nlij,nlj->nli", jacobian, v[s])
        bend = np.einsum("nlij,nlj->nli", jacobian, a[s]) + foot_jacobian_rates(legs, q[s], v[s])
        weight = m.standing[s].astype(float)
        weight /= np.maximum(weight.sum(axis=1, keepdims=True), 1.0)
        velocity[s] = -np.einsum("nl,nli->ni", weight, rate)
        acceleration[s] = -np.einsum("nl,nli->ni", weight, bend)
    return velocity, acceleration


def _measured_acceleration(machine: MachineModel, m: Measurement, velocity: Array) -> Array:
    """Spatial acceleration of the base from the measured foot forces, own frame, (N, 6).

    The feet's wrench less what joints' motion and gravity ask is the composite inertia times the
    acceleration. Masses are known to a few per cent only, so that the mean, which for a robot that
    walks is none, is taken off.
    """
    assert machine.legs is not None
    assert machine.layout is not None
    assert m.foot_force is not None
    model = machine.rigid
    n = m.q.shape[0]
    index_q = np.array([model.joints[model.getJointId(j)].idx_q for j in machine.joints])
    index_v = np.array([model.joints[model.getJointId(j)].idx_v for j in machine.joints])
    q = np.tile(pin.neutral(model), (n, 1))
    v, a = np.zeros((n, model.nv)), np.zeros((n, model.nv))
    _place_joints(model, q, index_q, m.q)
    q[:, 3:7] = _base_turn(m, n).as_quat()
    v[:, index_v], a[:, index_v] = m.v, m.a
    v[:, :3] = velocity
    weightless = model.copy()
    weightless.gravity.linear = np.zeros(3)
    threads = _threads(n)
    pool, floating = pin.ModelPool(model, threads), pin.ModelPool(weightless, threads)

    def base_wrench(among: pin.ModelPool, acceleration: Array, speed: Array) -> Array:
        torque = pin.rneaInParallel(threads, among, q.T, speed.T, acceleration.T)
        return np.asarray(torque).T.reshape(v.shape)[:, :6]

    asked = base_wrench(pool, a, v)
    still = np.zeros_like(v)
    # A composite body's spatial inertia is [[m 1, -m [c]x], [m [c]x, J]]: what turning asks for
    # tells all of it but the mass.
    inertia = np.zeros((n, 6, 6))
    inertia[:, :3, :3] = pin.computeTotalMass(model) * np.eye(3)
    for k in range(3, 6):
        unit = still.copy()
        unit[:, k] = 1.0
        inertia[:, :, k] = base_wrench(floating, unit, still)
    inertia[:, 3:, :3] = inertia[:, :3, 3:].transpose(0, 2, 1)
    feet = foot_positions(machine.legs, machine.layout.by_leg(m.q))
    rotation = _base_rotation(m, n)
    force = m.foot_force if rotation is None else np.einsum("nji,nfj->nfi", rotation, m.foot_force)
    given = np.hstack([force.sum(axis=1), np.cross(feet, force).sum(axis=1)])
    acceleration = np.linalg.solve(inertia, (given - asked)[..., None])[..., 0]
    return np.asarray(acceleration - acceleration.mean(axis=0))


def _ground_torque(
    machine: MachineModel, m: Measurement, q: Array, wrench: Array, rotation: Array | None
) -> Array:
    """What the ground's forces put into the joints, shape (N, J) [N*m]."""
    assert machine.legs is not None
    assert machine.layout is not None
    n = q.shape[0]
    legs = machine.layout.by_leg(q)
    out = np.empty((n, len(machine.joints)))
    for start in range(0, n, _BLOCK):
        s = slice(start, min(start + _BLOCK, n))
        turn = None if rotation is None else rotation[s]
        force = _foot_forces(machine, m, s, foot_positions(machine.legs, legs[s]), wrench[s], turn)
        out[s] = machine.layout.by_joint(foot_force_torques(machine.legs, legs[s], force))
    return out


def _foot_forces(
    machine: MachineModel, m: Measurement, s: slice, feet: Array, wrench: Array, turn: Array | None
) -> Array:
    """Forces of the ground on the feet in the base frame, shape (n, F, 3)."""
    measured = None if m.foot_force is None else m.foot_force[s]
    if measured is None or np.isnan(measured).any():
        world = _computed(m, s, feet, wrench, turn, feet.shape[1])
        if measured is not None:
            known = ~np.isnan(measured)
            world = np.where(known, np.nan_to_num(measured), world)
    else:
        world = np.array(measured)
    if machine.bodies.squeeze:
        standing = np.ones(feet.shape[:2]) if m.standing is None else m.standing[s]
        world[..., 1] += machine.bodies.squeeze * outward(machine.left, standing)
    if turn is None:
        return world
    return np.einsum("nji,nfj->nfi", turn, world)


def outward(left: Sequence[bool], standing: NDArray[np.generic]) -> Array:
    """Share of each standing foot in a lateral force of one newton per side, (n, F).

    Args:
        left: Which feet are on the left side, (F,).
        standing: Which feet stand, (n, F).
    """
    own = np.array(left)
    out = np.zeros(standing.shape)
    for side, sign in ((own, 1.0), (~own, -1.0)):
        part = (standing * side).astype(float)
        out += sign * part / np.maximum(part.sum(axis=1, keepdims=True), 1.0)
    return out


def _computed(
    m: Measurement, s: slice, feet: Array, wrench: Array, turn: Array | None, count: int
) -> Array:
    """Least tangential forces of the standing feet in the world's directions, (n, F, 3)."""
    n = feet.shape[0]
    standing = np.ones((n, count), dtype=bool) if m.standing is None else m.standing[s]
    world_feet, world_wrench = feet, wrench
    if turn is not None:
        world_feet = np.einsum("nij,nfj->nfi", turn, feet)
        world_wrench = np.concatenate(
            [np.einsum("nij,nj->ni", turn, wrench[:, k : k + 3]) for k in (0, 3)], axis=1
        )
    out = np.zeros((n, count, 3))
    codes = standing @ (1 << np.arange(count))
    for code in np.unique(codes):
        rows = np.flatnonzero(codes == code)
        members = np.flatnonzero(standing[rows[0]])
        if members.size >= 3:
            part = least_tangential_forces(world_wrench[rows], world_feet[np.ix_(rows, members)])
            out[np.ix_(rows, members)] = part
    return out
