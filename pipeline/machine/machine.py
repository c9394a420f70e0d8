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
from pipeline.machine.bodies import Bodies, changed_model
from pipeline.machine.drivetrains import Drivetrains
from pipeline.robot.robot import Robot


@dataclass(frozen=True, eq=False)
class MachineModel:
    """Robot, actuators and sensors, and what differs from the robot's file."""

    robot: Robot  #: As its file states it.
    drivetrains: Drivetrains  #: Of all joints.
    bodies: Bodies = field(default_factory=Bodies)  #: Changes of bodies, ground and contact.
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
        """The same with other bodies, ground or contact."""
        return replace(self, bodies=bodies)

    def carrier(self, link: str) -> str:
        """Joint that carries a link."""
        links = self.robot.links
        return links[known("no moving link", link, links, self.name)]
