"""Torque at the joints that bodies, gravity and ground ask for along a measured motion.

Inverse dynamics in one batch (`rneaInParallel`). Where a walking robot's foot forces are measured,
they are the ground's forces and give the acceleration of the base. Else the base moves as its
standing feet let it (they do not move, and the base does not rotate), and the ground's forces are
those with the least tangential parts (`pipeline.dynamics.contact_forces`).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
import scipy.linalg
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.dynamics.contact_forces import FeetOnGround, inverse_dynamics
from pipeline.logs.log import Log
from pipeline.machine.machine import Bodies, MachineModel
from pipeline.robot.kinematics import foot_jacobian_rates, foot_jacobians

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

_BLOCK = 2048
#: Least share of a direction in a body's scaled pseudo-inertia.
_LEAST = 1e-6


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
            change.scale * body.inertia,
        )
        if any(change.carried):
            ten = np.asarray(changed.toDynamicParameters()) + np.array(change.carried)
            changed = pin.Inertia.FromDynamicParameters(ten)
        if any(change.strain):
            changed = strained(changed, change.strain)
        model.inertias[index] = changed
    roll, pitch = bodies.tilt
    if roll or pitch:
        tilt = pin.rpy.rpyToMatrix(roll, pitch, 0.0)  # ground to level
        model.gravity.linear = tilt.T @ rigid.gravity.linear
    return model


def strained(body: pin.Inertia, strain: Sequence[float]) -> pin.Inertia:
    """A body that was stretched, moved and made heavier, so that it stays one that can be.

    With the second moments M = tr(I) / 2 - I about the centre of mass c and the longest radius of
    gyration k, k^2 m the largest eigenvalue of M, its mass, centre and second moments become

        m exp(a),    c + k d,    exp(a) exp(E) M exp(E).

    A rotation of the axes in which it is measured turns E and d and nothing else. The centre of a
    slender link may lie off its axis as far as along it: motors and wires sit beside it. `strain`:
    of the symmetric E the entries xx, yy, zz, then a, then of E xy, xz, yz, and d.
    """
    ten = tuple(np.asarray(body.toDynamicParameters()).tolist())
    return pin.Inertia.FromDynamicParameters(np.array(_strained(ten, tuple(strain))))


@lru_cache(maxsize=4096)
def _strained(ten: tuple[float, ...], strain: tuple[float, ...]) -> tuple[float, ...]:
    P = pseudo_inertia(np.array(ten))
    if P[3, 3] <= 0.0:
        return ten
    c = P[:3, 3] / P[3, 3]
    M = P[:3, :3] - P[3, 3] * np.outer(c, c)
    xx, yy, zz, a, xy, xz, yz, *d = strain
    stretch = scipy.linalg.expm(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    m = np.exp(a) * P[3, 3]
    radius = np.sqrt(max(float(np.linalg.eigvalsh(M)[-1]), 0.0) / P[3, 3])
    c = c + radius * np.array(d)
    P = np.empty((4, 4))
    P[:3, :3] = np.exp(a) * stretch @ M @ stretch + m * np.outer(c, c)
    P[:3, 3] = P[3, :3] = m * c
    P[3, 3] = m
    return tuple(_ten(P).tolist())


def possible(ten: Array) -> Array:
    """Ten inertial parameters of the nearest body: no direction with less than nothing in it."""
    P = pseudo_inertia(ten)
    scale = np.sqrt(np.maximum(np.diag(P), 1e-12 * np.trace(P)))
    size, axes = np.linalg.eigh(P / np.outer(scale, scale))
    if size[0] > _LEAST:
        return ten
    P = (axes * np.maximum(size, 2.0 * _LEAST)) @ axes.T * np.outer(scale, scale)
    return _ten(P)


def _ten(P: Array) -> Array:
    return np.asarray(pin.PseudoInertia.FromMatrix(P).toDynamicParameters())


def pseudo_inertia(ten: Array) -> Array:
    """Pseudo-inertia (4, 4) of ten inertial parameters in Pinocchio's order."""
    return np.asarray(pin.PseudoInertia.FromDynamicParameters(ten).toMatrix())


class RigidBodies:
    """Inverse dynamics of many models along one measured motion.

    What depends on the motion and the measured forces alone is computed once.
    """

    def __init__(self, measurement: Log) -> None:
        self.measurement = measurement
        self._base: tuple[Array, Array] | None = None
        self._turned: Rotation | None = None
        self._measured: tuple[float, Array] | None = None

    def torque(self, machine: MachineModel, motion: tuple[Array, Array, Array]) -> Array:
        """Joint torques, shape (N, J) [N*m].

        `motion`: position, velocity and acceleration of the joints, each (N, J).
        """
        model = changed_model(machine.rigid, machine.bodies)
        q, v, a, joints = configuration(machine, model, motion)
        turn = self._turn(motion[0].shape[0]) if machine.floating else None
        if machine.floating:
            q[:, 3:7] = turn.as_quat() if turn is not None else [0.0, 0.0, 0.0, 1.0]
            v[:, :3], a[:, :6] = self._base_motion(machine)
        generalised = inverse_dynamics(model, (q, v, a), pin.ModelPool(model, 1))
        torque: Array = generalised[:, joints]
        if machine.floating and machine.legs is not None:
            torque = torque - self._ground_torque(machine, motion[0], generalised[:, :6])
        return torque

    def _turn(self, n: int) -> Rotation | None:
        """Base to world, R_y(pitch) R_x(roll), at every sample; None where it is level."""
        from scipy.spatial.transform import Rotation

        m = self.measurement
        if self._turned is None and not m.base_roll is m.base_pitch is None:
            angles = [np.zeros(n) if x is None else x for x in (m.base_pitch, m.base_roll)]
            self._turned = Rotation.from_euler("YX", np.stack(angles, axis=1))
        return self._turned

    def _base_motion(self, machine: MachineModel) -> tuple[Array, Array]:
        """Velocity (N, 3) and acceleration (N, 6) of the base in its own frame.

        The measured motion determines what the base did, whatever an effect makes of it.
        """
        if self._base is None:
            m = self.measurement
            velocity, acceleration = _carried_by_feet(machine, m)
            if legs_are_separate(machine, m):
                turn = self._turn(len(m))
                spatial = _measured_acceleration(machine, m, velocity, turn)
            else:
                spatial = np.hstack([acceleration, np.zeros_like(acceleration)])
            self._base = (velocity, spatial)
        return self._base

    def _ground_torque(self, machine: MachineModel, q: Array, wrench: Array) -> Array:
        """What the ground's forces put into the joints, shape (N, J) [N*m]."""
        m, squeeze = self.measurement, machine.bodies.squeeze
        # Measured forces ask for nothing of the bodies.
        measured = legs_are_separate(machine, m) and q is m.q
        if measured and self._measured is not None and self._measured[0] == squeeze:
            return self._measured[1]
        assert machine.legs is not None
        legs, turn = machine.legs.by_leg(q), self._turn(len(q))
        out = np.empty(q.shape)
        for start in range(0, len(q), _BLOCK):
            s = slice(start, start + _BLOCK)
            own = None if turn is None else turn[s].as_matrix()
            feet = FeetOnGround(machine.legs, legs[s], own)
            standing = np.ones(legs[s].shape[:2], dtype=np.bool_)
            if m.standing is not None:
                standing = m.standing[s]
            force = np.full((*standing.shape, 3), np.nan)
            if m.foot_force is not None:
                force[:] = m.foot_force[s]
            if np.isnan(force).any():
                force = np.where(np.isnan(force), feet.least_tangential(wrench[s], standing), force)
            if squeeze:
                force[..., 1] += squeeze * outward(machine.left, standing)
            out[s] = machine.legs.by_joint(feet.torque(force))
        if measured:
            self._measured = (squeeze, out)
        return out


def legs_are_separate(machine: MachineModel, m: Log) -> bool:
    """Whether a body of one leg leaves the torques of all other legs as they are."""
    if not machine.floating:
        return machine.legs is not None
    return m.foot_force is not None and not bool(np.isnan(m.foot_force[0]).any())


def configuration(
    machine: MachineModel, model: pin.Model, motion: tuple[Array, Array, Array]
) -> tuple[Array, Array, Array, NDArray[np.intp]]:
    """Pinocchio's q, v, a with the base at rest, and the joints' columns among v."""
    joints = [model.joints[model.getJointId(name)] for name in machine.joints]
    columns = np.array([joint.idx_v for joint in joints])
    n = motion[0].shape[0]
    q, v, a = np.tile(pin.neutral(model), (n, 1)), np.zeros((n, model.nv)), np.zeros((n, model.nv))
    for joint, position in zip(joints, motion[0].T, strict=True):
        if joint.nq == 2:  # a continuous joint is written as cosine and sine
            q[:, joint.idx_q], q[:, joint.idx_q + 1] = np.cos(position), np.sin(position)
        else:
            q[:, joint.idx_q] = position
    v[:, columns], a[:, columns] = motion[1], motion[2]
    return q, v, a, columns


def _carried_by_feet(machine: MachineModel, m: Log) -> tuple[Array, Array]:
    """Linear velocity and acceleration of a base that its standing feet carry, each (N, 3)."""
    velocity, acceleration = np.zeros((len(m), 3)), np.zeros((len(m), 3))
    legs = machine.legs
    if legs is None or m.standing is None:
        return velocity, acceleration
    q, v, a = (legs.by_leg(x) for x in (m.q, m.v, m.a))
    for start in range(0, len(m), _BLOCK):
        s = slice(start, start + _BLOCK)
        jacobian = foot_jacobians(legs, q[s])[1]
        rate = np.einsum("nlij,nlj->nli", jacobian, v[s])
        second = np.einsum("nlij,nlj->nli", jacobian, a[s]) + foot_jacobian_rates(legs, q[s], v[s])
        weight = m.standing[s].astype(float)
        weight /= np.maximum(weight.sum(axis=1, keepdims=True), 1.0)
        velocity[s] = -np.einsum("nl,nli->ni", weight, rate)
        acceleration[s] = -np.einsum("nl,nli->ni", weight, second)
    return velocity, acceleration


def _measured_acceleration(
    machine: MachineModel, m: Log, velocity: Array, turn: Rotation | None
) -> Array:
    """Spatial acceleration of the base from the measured foot forces, own frame, (N, 6).

    The feet's wrench less what joints' motion and gravity ask is the composite inertia times the
    acceleration. Masses are known to a few per cent only, so that the mean, which for a robot that
    walks is none, is taken off.
    """
    assert machine.legs is not None
    assert m.foot_force is not None
    model = machine.rigid
    q, v, a, _ = configuration(machine, model, (m.q, m.v, m.a))
    q[:, 3:7] = turn.as_quat() if turn is not None else [0.0, 0.0, 0.0, 1.0]
    v[:, :3] = velocity
    asked = inverse_dynamics(model, (q, v, a), pin.ModelPool(model, 1))[:, :6]
    data = model.createData()
    inertia = np.triu(np.array([pin.crba(model, data, row)[:6, :6] for row in q]))
    inertia += np.triu(inertia, 1).transpose(0, 2, 1)
    own = None if turn is None else turn.as_matrix()
    feet = FeetOnGround(machine.legs, machine.legs.by_leg(m.q), own)
    force = feet.to_base(m.foot_force)
    given = np.hstack([force.sum(axis=1), np.cross(feet.in_base, force).sum(axis=1)])
    acceleration = np.linalg.solve(inertia, (given - asked)[..., None])[..., 0]
    return np.asarray(acceleration - acceleration.mean(axis=0))


def outward(left: Sequence[bool], standing: NDArray[np.generic]) -> Array:
    """Share of each standing foot in a lateral force of one newton per side, (n, F).

    `left`: which feet are on the left side, (F,). `standing`: which feet stand, (n, F).
    """
    own = np.array(left)
    out = np.zeros(standing.shape)
    for side, sign in ((own, 1.0), (~own, -1.0)):
        part = (standing * side).astype(float)
        out += sign * part / np.maximum(part.sum(axis=1, keepdims=True), 1.0)
    return out
