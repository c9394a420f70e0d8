"""A robot's surfaces and legs in any configuration, placed by Pinocchio."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.motion.gait import gait_table
from pipeline.robot.robot import Robot
from reports.figures.robot.outline import outline
from reports.figures.robot.solids import Leg, Solid, legs_of
from reports.figures.robot.sticks import leg_sticks, trunk_centre
from reports.figures.robot.visuals import Shape, Shapes, joint_marks, read_shapes

Array = NDArray[np.float64]
_STEEL = 7850.0  # [kg/m^3]
_LOAD = (0.94, 0.89, 0.26)  # yellow, as no link of ours


@dataclass(frozen=True, eq=False)
class Scenery:
    """What there is to see of a robot.

    Attributes:
        robot: The robot.
    """

    robot: Robot

    @cached_property
    def shapes(self) -> Shapes:
        """Surfaces of its links, read once."""
        return read_shapes(self.robot.urdf, self.robot.spec.urdf.parent)

    @cached_property
    def load(self) -> Shape | None:
        """The payload as a ball of steel of its mass about its place; None without one."""
        table = gait_table(self.robot.spec)
        if not table.payload_mass:
            return None
        origin = np.eye(4)
        origin[:3, 3] = table.payload_x, table.payload_y, table.payload_z
        size = np.full(3, np.cbrt(6 * table.payload_mass / (np.pi * _STEEL)))
        return Shape(self.robot.spec.base_link, origin, _LOAD, size, sphere=True)

    @cached_property
    def carrier(self) -> dict[str, int]:
        """Link to the moving body (Pinocchio's joint) that carries it."""
        frames = self.robot.model.frames
        return {f.name: f.parentJoint for f in frames if f.type == pin.FrameType.BODY}

    @cached_property
    def leg_of_body(self) -> dict[int, str]:
        """Moving body to the leg that it is part of; the trunk and what it carries are in none."""
        model = self.robot.model
        return {
            int(model.getJointId(joint)): leg.name
            for leg in self.robot.spec.legs
            for joint in leg.joints
        }

    @cached_property
    def zero(self) -> Array:
        """The configuration in which every joint is at zero, shape (nq,)."""
        joints = np.zeros((1, len(self.robot.joints)))
        return self.robot.configuration(joints, np.zeros((1, 3)))[0]

    def placements(self, configuration: Array) -> dict[str, Array]:
        """Every frame in the world, links before others of the same name, (4, 4) each [m]."""
        model, data = self.robot.model, self.robot.model.createData()
        pin.framesForwardKinematics(model, data, configuration)
        bodies: dict[str, Array] = {}
        others: dict[str, Array] = {}
        for i, frame in enumerate(model.frames):
            kind = bodies if frame.type == pin.FrameType.BODY else others
            kind[frame.name] = data.oMf[i].homogeneous.copy()
        return others | bodies

    def legs_at(self, placed: Mapping[str, Array]) -> list[Leg]:
        """Legs for the placements of one configuration."""
        marks = joint_marks(self.robot.urdf, placed)
        legs = {leg.name: (leg.joints, leg.foot) for leg in self.robot.spec.legs}
        return legs_of(legs, marks, placed)

    def at(self, configuration: Array) -> tuple[list[Solid], list[Leg]]:
        """Surfaces and legs in one configuration, shape (nq,)."""
        placed = self.placements(configuration)
        solids = self.shapes.at(placed)
        if self.load is not None:
            solids.append(self.load.at(placed[self.load.link]))
        return solids, self.legs_at(placed)

    def sticks(self, leg: Leg, legs: Sequence[Leg]) -> list[tuple[int, Solid]]:
        """Sticks of a leg of which the URDF shows nothing, each with the body that carries it."""
        carriers = [1, *(int(self.robot.model.getJointId(joint.name)) for joint in leg.joints)]
        return [(carriers[k], stick) for k, stick in leg_sticks(leg, trunk_centre(legs))]

    def trunk_outline(self) -> Array:
        """The trunk from above in its own frame, counter-clockwise, shape (P, 2) [m].

        Where the URDF shows nothing of it, the outline of the legs' first joints.
        """
        placed = self.placements(self.zero)
        solids, legs = self.shapes.at(placed), self.legs_at(placed)
        points = [s.points[:, :2] for s in solids if self.carrier[s.link] <= 1]
        points = points or [np.array([leg.joints[0].position[:2] for leg in legs])]
        return outline(np.concatenate(points))


def mass_centre(robot: Robot, configurations: Array) -> Array:
    """Centre of mass in the world, shape (N, nq) to (N, 3) [m]."""
    data = robot.model.createData()
    return np.array([pin.centerOfMass(robot.model, data, q).copy() for q in configurations])
