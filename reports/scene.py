"""What a URDF shows of its links, and a robot's surfaces and legs in any configuration.

No number of a result depends on a mesh: one that cannot be found or read is reported and left out.
"""

from __future__ import annotations

import io
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.motion.gait import gait_table
from pipeline.robot.robot import Robot
from reports.figures.robot import JointMark, Leg, Solid, outline

Color = tuple[float, float, float]
#: Of what has no colour of its own.
GREY: Color = (0.6, 0.6, 0.6)


@dataclass(frozen=True, eq=False)
class Shape:
    """A surface on a link."""

    link: str  #: Name.
    mesh: Any  #: A `trimesh.Trimesh`, or one of `trimesh.primitives`, about its own origin [m].
    placement: Array  #: Of the surface in the link's frame, homogeneous, shape (4, 4) [m].
    color: Color = GREY  #: Red, green, blue from 0 to 1.
    file: Path | None = None  #: Of a mesh.
    scale: tuple[float, ...] = (1.0, 1.0, 1.0)  #: By which the file's points are scaled.

    @property
    def points(self) -> Array:
        """Vertices in the link's frame, shape (P, 3) [m]."""
        own = np.asarray(self.mesh.vertices, float) * self.scale
        placed: Array = own @ self.placement[:3, :3].T + self.placement[:3, 3]
        return placed


def read_shapes(urdf: str, folder: Path | None = None) -> tuple[list[Shape], list[str]]:
    """Visuals, and of a link whose visual's mesh is missing the collision shapes, too.

    Args:
        urdf: The URDF's text.
        folder: Of the URDF, from which its meshes are looked for.

    Returns:
        Surfaces in the URDF's order; names of the meshes that were not found or not read.

    Raises:
        LegwattError: A shape's numbers are none.
    """
    import yourdfpy

    try:
        robot = yourdfpy.URDF.load(io.BytesIO(urdf.encode()), build_scene_graph=False).robot
    except ValueError as error:
        raise LegwattError(f"a shape in the URDF cannot be drawn: {error}") from None
    named = {material.name: material.color for material in robot.materials}
    shapes: list[Shape] = []
    missing: dict[str, None] = {}
    for link in robot.links:
        visuals = [_shape(link.name, visual, named, folder) for visual in link.visuals]
        lacking = [shape for shape in visuals if isinstance(shape, str)]
        others = [_shape(link.name, one, named, folder) for one in link.collisions if lacking]
        shapes += [shape for shape in (*visuals, *others) if isinstance(shape, Shape)]
        missing |= dict.fromkeys(lacking)
    return shapes, list(missing)


def _shape(link: str, element: Any, named: dict[str, Any], folder: Path | None) -> Shape | str:
    """A visual or collision shape; the name of a mesh that cannot be used."""
    from trimesh import primitives

    geometry = element.geometry
    color, file, scale = GREY, None, (1.0, 1.0, 1.0)
    if geometry.box is not None:
        mesh: Any = primitives.Box(extents=geometry.box.size)
    elif geometry.sphere is not None:
        mesh = primitives.Sphere(radius=geometry.sphere.radius, subdivisions=2)
    elif geometry.cylinder is not None:
        cylinder = geometry.cylinder
        mesh = primitives.Cylinder(radius=cylinder.radius, height=cylinder.length, sections=24)
    else:
        file = mesh_file(geometry.mesh.filename, folder)
        read = None if file is None else read_mesh(file)
        if read is None:
            return str(geometry.mesh.filename)
        mesh, color = read
        x, y, z = np.broadcast_to(1.0 if geometry.mesh.scale is None else geometry.mesh.scale, 3)
        scale = (float(x), float(y), float(z))
    material = getattr(element, "material", None)
    if material is not None:
        own = material.color or named.get(material.name)
        if own is not None:
            red, green, blue = own.rgba[:3]
            color = (float(red), float(green), float(blue))
    placement = np.eye(4) if element.origin is None else element.origin
    return Shape(link, mesh, placement, color, file, scale)


@lru_cache(maxsize=256)
def read_mesh(path: Path) -> tuple[Any, Color] | None:
    """A mesh file as one mesh with its colour; None where trimesh cannot read it."""
    import trimesh
    from collada.common import DaeError

    try:
        mesh: Any = trimesh.load_scene(path, process=False, skip_materials=True).to_mesh()
    except (ValueError, LookupError, OSError, DaeError):
        return None
    if not len(mesh.faces):
        return None
    visual = mesh.visual if mesh.visual.defined else None
    if not isinstance(visual, trimesh.visual.ColorVisuals):
        return mesh, GREY
    red, green, blue = np.asarray(visual.main_color[:3], float) / 255
    return mesh, (float(red), float(green), float(blue))


def mesh_file(name: str, folder: Path | None) -> Path | None:
    """The file that a URDF's ``<mesh filename>`` means; None where there is none.

    ``package://NAME/PATH`` is looked for as folder ``NAME`` in every folder above the URDF, in
    ``ROS_PACKAGE_PATH``, and among the robots of example-robot-data.
    """
    scheme, separator, rest = name.partition("://")
    if not separator:
        places: Sequence[Path] = [(folder or Path()) / name]
    elif scheme == "file":
        places = [Path(unquote(rest))]
    else:
        package, _, path = rest.partition("/")
        places = [place / path for place in _packages(package, folder)]
    return next((place for place in places if place.is_file()), None)


def _packages(package: str, folder: Path | None) -> Iterator[Path]:
    """Folders that may be the package."""
    above = [] if folder is None else [folder.absolute(), *folder.absolute().parents]
    found = [Path(p) for p in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if p]
    spec = find_spec("example_robot_data")
    roots = Path(spec.origin).parents if spec is not None and spec.origin else ()
    share = next((s for r in roots if (s := r / "share" / "example-robot-data").is_dir()), None)
    published = [] if share is None else [share, share / "robots"]
    for place in (*above, *found, *published):
        if place.name == package:
            yield place
        yield place / package


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
