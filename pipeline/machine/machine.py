"""The machine as it is computed: bodies, an actuator per joint, sensors; never changed.

What an effect leaves alone keeps its identity: it need not be computed again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import pinocchio as pin

from actuators.chain import Chain
from actuators.errors import known
from pipeline.machine.drivetrains import Actuators, Drivetrains, drivetrains_of
from pipeline.robot.kinematics import LegChains
from pipeline.robot.robot import Robot

Vector = tuple[float, float, float]


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
    #: whatever they are, some body has them (`rigid_bodies.strained`).
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


@dataclass(frozen=True, eq=False)
class MachineModel:
    """Robot, actuators and sensors."""

    name: str  #: Of the robot.
    rigid: pin.Model  #: Pinocchio model as the robot file states it; armature zero.
    joints: tuple[str, ...]  #: In the order of every column.
    legs: LegChains | None  #: Geometry of the legs; None for a robot without.
    left: tuple[bool, ...]  #: Which legs are on the left side.
    floating: bool  #: Whether the base floats.
    bodies: Bodies = field(default_factory=Bodies)  #: Changes of bodies, ground and contact.
    actuators: tuple[Chain, ...] = ()  #: One per joint.
    #: Moving link's name to the joint that carries it.
    links: Mapping[str, str] = field(default_factory=dict)
    #: Links and joints of which a log has shown bodies and friction, to how well they are known, a
    #: standard deviation [1].
    known: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def drivetrains(self) -> Drivetrains:
        """All actuators, to be asked together."""
        return Drivetrains(self.name, self.actuators)

    def index(self, joint: str) -> int:
        """Column of a joint."""
        return self.joints.index(known("no joint", joint, self.joints, self.name))

    def actuator(self, joint: str) -> Chain:
        """The actuator of a joint."""
        return self.actuators[self.index(joint)]

    def with_actuator(self, actuator: Chain) -> MachineModel:
        """The same with another actuator at the joint it names."""
        at = self.index(actuator.name)
        return replace(self, actuators=(*self.actuators[:at], actuator, *self.actuators[at + 1 :]))

    def with_bodies(self, bodies: Bodies) -> MachineModel:
        """The same with other bodies, ground or contact."""
        return replace(self, bodies=bodies)

    def __post_init__(self) -> None:
        if not self.links:
            names, inertias = list(self.rigid.names), self.rigid.inertias
            carried = [k for k in range(1, len(names)) if inertias[k].mass > 0]
            links = {link_name(self.rigid, k): str(names[k]) for k in carried}
            object.__setattr__(self, "links", links)

    def carrier(self, link: str) -> str:
        """Joint that carries a link."""
        return self.links[known("no moving link", link, self.links, self.name)]


def link_name(model: pin.Model, joint: int) -> str:
    """Name of the link that a joint carries (of the first, where fixed joints merged several)."""
    for frame in model.frames:
        if frame.type == pin.FrameType.BODY and frame.parentJoint == joint:
            return str(frame.name)
    return str(model.names[joint])


def machine_of_robot(robot: Robot, actuators: Actuators | None) -> MachineModel:
    """A machine of a robot file.

    `actuators`: of all joints; None where the log's torque is the actuator's at the joint side.
    """
    legs = robot.chains if robot.spec.legs else None
    return MachineModel(
        name=robot.spec.name,
        rigid=robot.model,
        joints=robot.joints,
        legs=legs,
        left=tuple(leg.side == "left" for leg in robot.spec.legs),
        floating=robot.floating,
        actuators=drivetrains_of(actuators, robot.joints).joints,
    )
