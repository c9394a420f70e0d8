"""A robot's surfaces and legs in any configuration, placed by Pinocchio."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from pipeline.api.pictures.shapes import Shape, read_shapes
from pipeline.motion.gait import gait_table
from pipeline.robot.robot import Robot
from reports.figures.robot import JointMark, Leg, Solid, outline

_STEEL = 7850.0  # [kg/m^3]
_LOAD = (0.94, 0.89, 0.26)  # yellow, as no link of ours


@dataclass(frozen=True, eq=False)
class Scene:
    """What there is to see of a robot."""

    robot: Robot  #: The robot.

    @cached_property
    def _read(self) -> tuple[list[Shape], list[str]]:
        return read_shapes(self.robot.urdf, self.robot.spec.urdf.parent)

    @property
    def missing(self) -> list[str]:
        """Meshes that were not found or not read, as the URDF names them."""
        return self._read[1]

    @cached_property
    def load(self) -> Shape | None:
        """The payload as a ball of steel of its mass; None without one."""
        from trimesh.primitives import Sphere

        table = gait_table(self.robot.spec)
        if not table.payload_mass:
            return None
        radius = float(np.cbrt(6 * table.payload_mass / (np.pi * _STEEL))) / 2
        placement = np.eye(4)
        placement[:3, 3] = table.payload_x, table.payload_y, table.payload_z
        return Shape(self.robot.spec.base_link, Sphere(radius=radius), placement, _LOAD)

    @cached_property
    def shapes(self) -> list[Shape]:
        """What the URDF shows, then the payload."""
        return [*self._read[0], *([self.load] if self.load else [])]

    @cached_property
    def zero(self) -> Array:
        """The configuration in which every joint is at zero, shape (nq,)."""
        joints = np.zeros((1, len(self.robot.joints)))
        return self.robot.configuration(joints, np.zeros((1, 3)))[0]

    @cached_property
    def bare(self) -> tuple[str, ...]:
        """Legs of which the URDF shows nothing but their feet; they are drawn as sticks."""
        model, feet = self.robot.model, [leg.foot for leg in self.robot.spec.legs]
        shown = {
            model.frames[model.getFrameId(shape.link, pin.FrameType.BODY)].parentJoint
            for shape in self.shapes
            if shape.link not in feet
        }
        return tuple(
            leg.name
            for leg in self.robot.spec.legs
            if not shown & {model.getJointId(joint) for joint in leg.joints}
        )

    @property
    def remark(self) -> str:
        """What is to be said of missing meshes; empty where none is missing."""
        if not self.missing:
            return ""
        more = f" and {len(self.missing) - 1} more" if len(self.missing) > 1 else ""
        return (
            f"mesh '{self.missing[0]}'{more} not found or not readable: pictures show the URDF's "
            "other shapes or sticks; numbers do not depend on meshes"
        )

    @property
    def words(self) -> list[str]:
        """The same in few words, and of legs drawn as sticks, for the picture itself."""
        out, count = [], len(self.missing)
        if count:
            out.append(f"{count} {'mesh is' if count == 1 else 'meshes are'} missing")
        if self.bare:
            every = len(self.bare) == len(self.robot.spec.legs)
            which = "legs" if every else f"legs {', '.join(self.bare)}"
            out.append(f"{which} without shapes in the URDF: sticks between their joints")
        return out

    def at(self, configuration: Array) -> tuple[list[Solid], list[Leg]]:
        """Links and legs in the world in one configuration of shape (nq,)."""
        robot, model = self.robot, self.robot.model
        data = model.createData()
        pin.computeJointJacobians(model, data, configuration)
        pin.updateFramePlacements(model, data)
        links: dict[tuple[str, bool], list[Shape]] = {}
        for shape in self.shapes:
            links.setdefault((shape.link, shape is self.load), []).append(shape)
        solids = []
        for (link, _), shapes in links.items():
            placed = data.oMf[model.getFrameId(link, pin.FrameType.BODY)]
            points = np.concatenate([shape.points for shape in shapes])
            solids.append(Solid(points @ placed.rotation.T + placed.translation, shapes[0].color))
        slides = dict(zip(robot.joints, robot.sliding, strict=True))

        def mark(joint: str) -> JointMark:
            k = model.getJointId(joint)
            column = pin.getJointJacobian(model, data, k, pin.LOCAL_WORLD_ALIGNED)[
                :, model.joints[k].idx_v
            ]
            axis = column[:3] if slides[joint] else column[3:]
            return JointMark(joint, data.oMi[k].translation.copy(), axis, bool(slides[joint]))

        legs = [
            Leg(
                leg.name,
                tuple(mark(joint) for joint in leg.joints),
                data.oMf[model.getFrameId(leg.foot, pin.FrameType.BODY)].translation.copy(),
                bare=leg.name in self.bare,
            )
            for leg in robot.spec.legs
        ]
        return solids, legs

    def trunk_outline(self) -> Array:
        """The trunk from above in its own frame, counter-clockwise, shape (P, 2) [m].

        Where the URDF shows nothing of it, the outline of the legs' first joints.
        """
        model, data = self.robot.model, self.robot.model.createData()
        pin.framesForwardKinematics(model, data, self.zero)
        points = []
        for shape in self._read[0]:
            frame = model.getFrameId(shape.link, pin.FrameType.BODY)
            if model.frames[frame].parentJoint <= int(self.robot.floating):
                placed = data.oMf[frame]
                points.append((shape.points @ placed.rotation.T + placed.translation)[:, :2])
        if not points:
            joints = [leg.joints[0].position[:2] for leg in self.at(self.zero)[1]]
            points = [np.array(joints)]
        return outline(np.concatenate(points))


def mass_centre(robot: Robot, configurations: Array) -> Array:
    """Centre of mass in the world, shape (N, nq) to (N, 3) [m]."""
    data = robot.model.createData()
    return np.array([pin.centerOfMass(robot.model, data, q).copy() for q in configurations])
