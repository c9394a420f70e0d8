"""Bodies with what effects change of them, and a motion as Pinocchio takes it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import pinocchio as pin
import scipy.linalg
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.logs.log import Log
from pipeline.machine.machine import Bodies, MachineModel

#: Least second moment of a body in any direction, of its largest.
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
    P = np.asarray(pin.PseudoInertia.FromDynamicParameters(np.array(ten)).toMatrix())
    if P[3, 3] <= 0.0:
        return ten
    c = P[:3, 3] / P[3, 3]
    size, axes = np.linalg.eigh(P[:3, :3] - P[3, 3] * np.outer(c, c))
    # A file may state a body that cannot be: the nearest that can.
    size = np.maximum(size, _LEAST * max(float(size[-1]), 0.0))
    xx, yy, zz, a, xy, xz, yz, *d = strain
    stretch = scipy.linalg.expm(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])) @ axes
    m = np.exp(a) * P[3, 3]
    c = c + np.sqrt(size[-1] / P[3, 3]) * np.array(d)
    P = np.empty((4, 4))
    P[:3, :3] = np.exp(a) * (stretch * size) @ stretch.T + m * np.outer(c, c)
    P[:3, 3] = P[3, :3] = m * c
    P[3, 3] = m
    return tuple(pin.PseudoInertia.FromMatrix(P).toDynamicParameters().tolist())


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
