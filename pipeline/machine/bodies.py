"""Bodies, and how they differ from the robot file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import pinocchio as pin
import scipy.linalg

Vector = tuple[float, float, float]
#: Least second moment of a body in any direction, of its largest.
_LEAST = 1e-6


@dataclass(frozen=True)
class BodyChange:
    """How one body differs from the robot file."""

    payload: float = 0.0  #: Point mass added at the centre of mass [kg].
    #: Displacement of the centre of mass in the frame of the body's joint [m].
    shift: Vector = (0.0, 0.0, 0.0)
    scale: float = 1.0  #: Factor on mass and rotational inertia [1].
    #: Ten inertial parameters of what is carried besides, in Pinocchio's order, about the frame of
    #: the body's joint.
    carried: tuple[float, ...] = ()
    #: By how much it was stretched, moved and made heavier, ten entries in the order of `STRAINS`:
    #: whatever they are, some body has them (`strained`).
    strain: tuple[float, ...] = ()


@dataclass(frozen=True)
class Bodies:
    """What the rigid-body torque depends on in addition to the motion."""

    changes: tuple[tuple[str, BodyChange], ...] = ()  #: Joint that carries the body to its change.
    tilt: tuple[float, float] = (0.0, 0.0)  #: Roll and pitch of the ground or stand [rad].
    #: Lateral force with which the ground pushes the standing feet outward, of all feet on one side
    #: together [N].
    squeeze: float = 0.0

    def body(self, joint: str) -> BodyChange:
        """The change of one body."""
        return dict(self.changes).get(joint, BodyChange())

    def with_body(self, joint: str, change: BodyChange) -> Bodies:
        """The same with another change of one body."""
        table = dict(self.changes) | {joint: change}
        return replace(self, changes=tuple(table.items()))


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
