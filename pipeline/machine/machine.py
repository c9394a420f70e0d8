"""The machine as it is computed: bodies, an actuator per joint, sensors; never changed.

What an effect leaves alone keeps its identity: it need not be computed again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np
import pinocchio as pin
import scipy.linalg

from actuators.chain import Chain
from actuators.errors import known
from pipeline.machine.drivetrains import Drivetrains
from pipeline.robot.robot import Robot

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


@dataclass(frozen=True, eq=False)
class MachineModel:
    """Robot, actuators and sensors, and what differs from the robot's file."""

    robot: Robot  #: As its file states it.
    drivetrains: Drivetrains  #: Of all joints.
    bodies: Bodies = field(default_factory=Bodies)  #: Changes of bodies and ground.
    #: Links and joints of which a log has shown bodies and friction, to how well they are known, a
    #: standard deviation [1].
    known: Mapping[str, float] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Of the robot."""
        return self.robot.spec.name

    @property
    def joints(self) -> tuple[str, ...]:
        """In the order of every column."""
        return self.robot.joints

    @cached_property
    def rigid(self) -> pin.Model:
        """Pinocchio's model with the changes of bodies and ground in it; armature zero."""
        return changed_model(self.robot.model, self.bodies)

    @property
    def actuators(self) -> tuple[Chain, ...]:
        """One per joint."""
        return self.drivetrains.joints

    def index(self, joint: str) -> int:
        """Column of a joint."""
        return self.joints.index(known("no joint", joint, self.joints, self.name))

    def actuator(self, joint: str) -> Chain:
        """The actuator of a joint."""
        return self.actuators[self.index(joint)]

    def with_actuator(self, actuator: Chain) -> MachineModel:
        """The same with another actuator at the joint it names."""
        joints = list(self.actuators)
        joints[self.index(actuator.name)] = actuator
        return replace(self, drivetrains=replace(self.drivetrains, joints=tuple(joints)))

    def with_bodies(self, bodies: Bodies) -> MachineModel:
        """The same with other bodies or ground."""
        return replace(self, bodies=bodies)

    def carrier(self, link: str) -> str:
        """Joint that carries a link."""
        links = self.robot.links
        return links[known("no moving link", link, links, self.name)]
