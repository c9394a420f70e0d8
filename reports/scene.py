"""What a robot looks like: the shapes of its URDF, read and placed by Pinocchio.

No number of a result depends on a mesh: where one cannot be read, collision shapes are shown in
place of all, else nothing but the lines between the joints.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull, QhullError

from actuators.arrays import Array
from pipeline.motion.gait import gait_table
from pipeline.robot.robot import Robot

_STEEL = 7850.0  # [kg/m^3]
_LOAD = (0.94, 0.89, 0.26, 1.0)  # yellow, as no link of ours
_ROUND = 24  # corners of a circle


@dataclass(frozen=True)
class Solid:
    """A shape of a link, or what the robot carries."""

    points: Array  #: Whose convex hull is drawn, in the world, shape (P, 3) [m].
    color: Array  #: Red, green, blue from 0 to 1, shape (3,).


@dataclass(frozen=True)
class Leg:
    """One leg of J joints in one posture, in the world."""

    name: str  #: Shown at the foot.
    position: Array  #: Origins of its joints from the base outward, shape (J, 3) [m].
    #: Unit vectors, shape (J, 3); positive rotation is right-handed about them, positive sliding
    #: along them.
    axis: Array
    slides: tuple[bool, ...]  #: Which of them are prismatic.
    foot: Array  #: Contact point, shape (3,) [m].


def geometry(robot: Robot) -> tuple[pin.GeometryModel, str]:
    """Shapes of a robot's links and its payload, and what is to be said of meshes; often nothing.

    ``package://`` is looked for in the folders above the URDF, in ``ROS_PACKAGE_PATH`` and among
    the robots of example-robot-data. A payload is a ball of steel of its mass.
    """
    folder, remark, out = robot.spec.urdf.parent.absolute(), "", pin.GeometryModel()
    places = [folder, *folder.parents, *_published()]
    places += [Path(p) for p in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if p]
    for kind in (pin.GeometryType.VISUAL, pin.GeometryType.COLLISION):
        try:
            out = pin.buildGeomFromUrdfString(
                robot.model, robot.urdf, kind, package_dirs=[*map(str, places)]
            )
            break
        except (ValueError, RuntimeError) as error:
            remark = remark or (
                f"{str(error).strip().splitlines()[0]}: pictures show other shapes or lines; "
                "numbers do not depend on meshes"
            )
    table = gait_table(robot.spec)
    if table.payload_mass:
        ball = coal.Sphere(float(np.cbrt(6 * table.payload_mass / (np.pi * _STEEL))) / 2)
        frame = robot.model.getFrameId(robot.spec.base_link, pin.FrameType.BODY)
        own = robot.model.frames[frame]
        at = pin.SE3(np.eye(3), np.array([getattr(table, f"payload_{x}") for x in "xyz"]))
        look: Any = ("", np.ones(3), True, np.array(_LOAD))
        out.addGeometryObject(
            pin.GeometryObject("payload", own.parentJoint, frame, own.placement * at, ball, *look)
        )
    return out, remark


def _published() -> list[Path]:
    """Folders of example-robot-data, where it is installed."""
    spec = find_spec("example_robot_data")
    roots = Path(spec.origin).parents if spec is not None and spec.origin else ()
    found = (root / "share" / "example-robot-data" for root in roots)
    return [p for share in found if share.is_dir() for p in (share.parent, share, share / "robots")]


def corners(shape: Any) -> Array:
    """Points whose convex hull is a shape about its own origin, (P, 3) [m]."""
    angle = np.linspace(0, 2 * np.pi, _ROUND, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    if isinstance(shape, coal.Box):
        signs = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), axis=-1).reshape(-1, 3)
        return np.asarray(signs * shape.halfSide)
    if isinstance(shape, coal.Sphere | coal.Capsule):
        rings = [s * circle + [0, 0, np.sqrt(1 - s * s)] for s in (0.0, 0.38, 0.71, 0.92, 1.0)]
        half = np.concatenate(rings) * shape.radius
        end = np.array([0, 0, getattr(shape, "halfLength", 0.0)])
        return np.concatenate([half + end, half * [1, 1, -1] - end])
    if isinstance(shape, coal.Cylinder):
        ends = [circle * shape.radius + [0, 0, s * shape.halfLength] for s in (-1, 1)]
        return np.concatenate(ends)
    points = np.asarray(shape.vertices() if hasattr(shape, "vertices") else shape.points())
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except (QhullError, ValueError):  # flat, or a few points
        return points


class Scene:
    """A robot to look at."""

    def __init__(self, robot: Robot) -> None:
        """Read its shapes."""
        self.robot = robot
        self.geometry, self.remark = geometry(robot)
        objects = self.geometry.geometryObjects
        self._points = [corners(one.geometry) * one.meshScale for one in objects]

    def at(self, configuration: Array) -> tuple[list[Solid], list[Leg]]:
        """Shapes and legs in one configuration of shape (nq,)."""
        robot, model = self.robot, self.robot.model
        data, placed = model.createData(), self.geometry.createData()
        pin.computeJointJacobians(model, data, configuration)
        pin.updateFramePlacements(model, data)
        pin.updateGeometryPlacements(model, data, self.geometry, placed)
        solids = [
            Solid(points @ at.rotation.T + at.translation, one.meshColor[:3])
            for points, at, one in zip(
                self._points, placed.oMg, self.geometry.geometryObjects, strict=True
            )
        ]
        slides = dict(zip(robot.joints, map(bool, robot.sliding), strict=True))
        legs = []
        chains = [(leg.name, leg.joints, leg.foot) for leg in robot.spec.legs]
        for name, joints, end in chains or _arms(model):
            ids = [model.getJointId(joint) for joint in joints]
            axes = [_axis(model, data, k, slides[j]) for k, j in zip(ids, joints, strict=True)]
            foot = data.oMf[model.getFrameId(end, pin.FrameType.BODY)].translation.copy()
            origins = np.array([data.oMi[k].translation for k in ids])
            own = tuple(slides[joint] for joint in joints)
            legs.append(Leg(name, origins, np.array(axes), own, foot))
        return solids, legs


def _arms(model: pin.Model) -> list[tuple[str, tuple[str, ...], str]]:
    """Joints and end of every chain of a robot without legs, which has no name of its own."""
    out = []
    for end in range(1, model.njoints):
        if not list(model.children[end]):
            links = [f for f in model.frames if f.type == pin.FrameType.BODY]
            own = [f for f in links if f.parentJoint == end]
            last = max(own, key=lambda f: float(np.linalg.norm(f.placement.translation))).name
            out.append(("", tuple(model.names[k] for k in model.supports[end] if k), last))
    return out


def _axis(model: pin.Model, data: pin.Data, joint: int, slides: bool) -> Array:
    """Unit vector of a joint in the world, shape (3,)."""
    jacobian = pin.getJointJacobian(model, data, joint, pin.LOCAL_WORLD_ALIGNED)
    column = jacobian[:, model.joints[joint].idx_v]
    return np.asarray(column[:3] if slides else column[3:])


def mass_centre(robot: Robot, configuration: Array) -> Array:
    """Centre of mass in the world, shape (nq,) to (3,) [m]."""
    return pin.centerOfMass(robot.model, robot.model.createData(), configuration).copy()
