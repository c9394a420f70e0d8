"""The machine as it is computed: bodies, a drivetrain per joint, sensors; never changed.

What an effect leaves alone keeps its identity: it need not be computed again.

Where joints meet, motors may turn with other joints, too: with motor angles theta = C q at the
joint side the power that motors give is the power that joints take, for any motion, so that
tau = C^T sigma: a motor that also turns with another joint carries a part of that joint's torque
(virtual work). Its friction is its own: it acts between motor and frame, and does work on theta.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, fields, replace
from functools import cached_property

import numpy as np
import pinocchio as pin

from actuators.arrays import Array, least_magnitude
from actuators.chain import Chain, ChainResult, HoldingResult, held
from actuators.errors import known
from actuators.shaft import BY_JOINT, ShaftSeries
from pipeline.robot.robot import Robot


@dataclass(frozen=True, eq=False)
class Drivetrains:
    """One drivetrain per joint; `inverse` and `holding` answer as a chain for all joints does."""

    name: str  #: Of the alternative.
    joints: tuple[Chain, ...]  #: In the order of the columns.

    @cached_property
    def coupling(self) -> Array:
        """C of theta = C q: turns of each motor at its joint's side per turn of each joint."""
        at = {joint.name: k for k, joint in enumerate(self.joints)}
        out = np.eye(len(self.joints))
        for k, joint in enumerate(self.joints):
            if joint.coupled_to:
                out[k, at[joint.coupled_to]] += joint.coupling
        return out

    @cached_property
    def _shares(self) -> Array:
        """C^-1: sigma = C^-T tau, in rows tau C^-1."""
        return np.asarray(np.linalg.inv(self.coupling), dtype=np.float64)

    @cached_property
    def coupled(self) -> bool:
        """Whether a motor turns with another joint, too."""
        return any(joint.coupled_to for joint in self.joints)

    def turned(self, joint: int, motion: Array) -> Array:
        """Motion of a joint's motor at the joint side, theta = C q, (...).

        `motion`: position, velocity or acceleration of all joints (..., J).
        """
        row = self.coupling[joint]
        return np.asarray(motion[..., row != 0.0] @ row[row != 0.0])

    def load(self, joint: int, demand: Callable[[int], Array]) -> Array:
        """What one drivetrain supplies at the joint side, sigma of tau = C^T sigma, (...) [N*m].

        `demand`: torque (...) [N*m] asked of a joint, by column.
        """
        column = self._shares[:, joint]
        return np.asarray(sum(column[k] * demand(k) for k in np.flatnonzero(column).tolist()))

    def carried(self, joint: int, motor: Array) -> Array:
        """What other joints' motors bring to a joint besides its own, (...) [N*m].

        `motor`: torque of all motors brought to their joint side (..., J) [N*m].
        """
        column = self.coupling[:, joint] - np.eye(len(self.joints))[joint]
        return np.asarray(motor[..., column != 0.0] @ column[column != 0.0])

    @cached_property
    def _groups(self) -> list[tuple[Chain, list[int]]]:
        """Chains with the joints that share them."""
        groups: dict[object, tuple[Chain, list[int]]] = {}
        for k, joint in enumerate(self.joints):
            key = (*map(id, joint.path), id(joint.motor))
            groups.setdefault(key, (joint, []))[1].append(k)
        return list(groups.values())

    def inverse(self, joint: ShaftSeries) -> ChainResult:
        """Return everything the drivetrains need; a loss that a joint does not have is zero there.

        `joint`: series at all joints, in their order; see `Chain.inverse`.
        """
        if len(self._groups) == 1 and not self.coupled:
            return self._groups[0][0].inverse(joint)
        motors, lost = joint, dict[str, Array]()
        if self.coupled:
            torque = np.array(joint.torque)
            for k, own in enumerate(self.joints):
                side = joint.of(joint.joints[k : k + 1])
                for element in own.apart:  # does not turn with the motor
                    loss = element.loss(side)
                    if loss is not None:
                        total = lost.setdefault(element.name, np.zeros_like(torque))
                        total[:, k] += loss[:, 0]
                    side = element.inverse(side)
                torque[:, k] = side.torque[:, 0]
            motion = (x @ self.coupling.T for x in (joint.position, joint.velocity))
            turned = (*motion, joint.acceleration @ self.coupling.T, torque @ self._shares)
            motors = ShaftSeries.at_joint(joint.joints, joint.time, *turned)
        parts = [
            (columns, chain.inverse(motors.of([joint.joints[k] for k in columns])))
            for chain, columns in self._groups
        ]
        merged = _merged(joint, parts)
        return replace(merged, losses={**lost, **merged.losses})

    def holding(self, torque: Array, position: Array | None = None) -> HoldingResult:
        """Return what holds joint torques at standstill; see `Chain.holding`.

        `torque`: (..., J) [N*m]. `position`: (..., J) [rad].
        """
        asked = np.array(torque, dtype=float)
        for k, own in enumerate(self.joints):
            if own.apart:  # its friction carries what it can
                at = None if position is None else position[..., k]
                asked[..., k] = least_magnitude(*held(own.apart, asked[..., k], asked[..., k], at))
        load = asked @ self._shares if self.coupled else asked
        at = position @ self.coupling.T if position is not None and self.coupled else position
        out = {one.name: np.empty_like(asked) for one in fields(HoldingResult)}
        for chain, columns in self._groups:
            result = chain.holding(load[..., columns], None if at is None else at[..., columns])
            for name, values in out.items():
                values[..., columns] = getattr(result, name)
        return HoldingResult(**out)


def drivetrains_of(chain: Chain, names: Sequence[str]) -> Drivetrains:
    """A drivetrain per joint, all alike."""
    joints = tuple(copy(chain) for _ in names)
    for joint, name in zip(joints, names, strict=True):
        vars(joint)["name"] = name  # the name alone: nothing to check again, thousands of times
    return Drivetrains(chain.name, joints)


def _merged(joint: ShaftSeries, parts: Sequence[tuple[list[int], ChainResult]]) -> ChainResult:
    """The results of some columns each as one result of all columns."""
    results = [result for _, result in parts]

    def whole(values: Iterable[Array | None]) -> Array:
        out = np.zeros(joint.torque.shape)
        for (columns, _), own in zip(parts, values, strict=True):
            if own is not None:
                out[:, columns] = own
        return out

    def shaft(sides: Sequence[ShaftSeries]) -> ShaftSeries:
        columns = {name: whole([getattr(side, name) for side in sides]) for name in BY_JOINT}
        return ShaftSeries(joints=joint.joints, time=joint.time, **columns)

    def by_element(rows: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
        names = dict.fromkeys(name for own in rows for name in own)
        return {name: whole([own.get(name) for own in rows]) for name in names}

    *inner, motor = results[0].shafts
    # Shafts that all of them have, and the motors' whatever they are called.
    shared = [stage for stage in inner if all(stage in r.shafts for r in results)]
    shafts = {stage: shaft([r.shafts[stage] for r in results]) for stage in shared}
    losses, copper = by_element([r.losses for r in results]), [*results[0].losses][-1]
    losses[copper] = losses.pop(copper)  # stays the last
    motors = {k: m for columns, r in parts for k, m in zip(columns, r.motors, strict=True)}
    return ChainResult(
        {**shafts, motor: shaft([r.motor for r in results])},
        losses,
        by_element([r.stored for r in results]),
        whole([r.current for r in results]),
        whole([r.voltage for r in results]),
        whole([r.electrical_power for r in results]),
        motors=tuple(motors[k] for k in range(len(motors))),
    )


Vector = tuple[float, float, float]
#: Least second moment of a body in any direction, of its largest.
_LEAST = 1e-6
#: Radius that a point has at least [m].
_POINT = 1e-2
#: Places of xx, xy, yy, xz, yz, zz in a symmetric matrix, those of a stretch among strains, and
#: moments of inertia by second moments.
_SIX = np.array([[0, 1, 3], [1, 2, 4], [3, 4, 5]])
_STRETCH = np.array([[0, 4, 5], [4, 1, 6], [5, 6, 2]])
_MOMENTS = np.outer([1, 0, 1, 0, 0, 1], [1, 0, 1, 0, 0, 1]) - np.eye(6)


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
    ten = np.asarray(body.toDynamicParameters())
    return pin.Inertia.FromDynamicParameters(strained_parameters(ten, np.array(strain)))


def strained_parameters(ten: Array, strain: Array) -> Array:
    """The ten inertial parameters of a body as `strained`, for strains (..., 10), (..., 10)."""
    m = ten[0]
    if m <= 0.0:
        return np.broadcast_to(ten, strain.shape)
    # A file may state a body that cannot be, or a point: the nearest that can.
    c = ten[1:4] / m
    size, axes = np.linalg.eigh(np.linalg.solve(_MOMENTS, ten[4:])[_SIX] - m * np.outer(c, c))
    size = np.maximum(size, _LEAST * max(float(size[-1]), _POINT**2 * m))
    grown = np.exp(strain[..., 3])
    log, turn = np.linalg.eigh(strain[..., _STRETCH])
    stretch = (turn * np.exp(log)[..., None, :]) @ turn.swapaxes(-1, -2) @ axes
    m, c = grown * m, c + np.sqrt(size[-1] / m) * strain[..., 7:]
    first = m[..., None] * c
    second = grown[..., None, None] * (stretch * size) @ stretch.swapaxes(-1, -2)
    second = second + first[..., None] * c[..., None, :]
    six = second[..., *np.tril_indices(3)] @ _MOMENTS
    return np.concatenate([m[..., None], first, six], axis=-1)


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
