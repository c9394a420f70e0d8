"""Surfaces, joints and placements of a robot, as read from its URDF text.

Placements come from the caller (from Pinocchio); this module computes no kinematics.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reports.errors import FigureError
from reports.figures.robot.meshes import Surface, cylinder, mesh_file, read_surface
from reports.figures.robot.solids import JointMark, Mesh, Primitive, Solid

Array = NDArray[np.float64]
Color = tuple[float, float, float]
#: Of what has no colour of its own.
GREY: Color = (0.6, 0.6, 0.6)


@dataclass(frozen=True)
class Shape:
    """A surface that a link carries.

    Attributes:
        link: The link.
        origin: In the link's frame, homogeneous, shape (4, 4) [m].
        color: The URDF's; None for the mesh's own, or grey.
        size: See `Primitive`; of a mesh its scale along each axis.
        sphere: Whether it is a sphere.
        surface: Of a mesh or cylinder; None for a box or sphere.
    """

    link: str
    origin: Array
    color: Color | None
    size: Array
    sphere: bool = False
    surface: Surface | None = None

    def at(self, placement: Array) -> Solid:
        """The surface in the world, for the link's placement of shape (4, 4) [m]."""
        world = placement @ self.origin
        if self.surface is None:
            return Primitive(self.link, self.color or GREY, world, self.size, self.sphere)
        points = (self.surface.vertices * self.size) @ world[:3, :3].T + world[:3, 3]
        colors = self.surface.colors
        if self.color is not None or colors is None:
            colors = np.tile(self.color or GREY, (len(self.surface.faces), 1))
        return Mesh(self.link, points, self.surface.faces, colors)


@dataclass(frozen=True)
class Shapes:
    """What a URDF shows of its robot.

    Attributes:
        shapes: In the URDF's order.
        missing: Meshes that were not found or not read, as the URDF names them.
    """

    shapes: tuple[Shape, ...]
    missing: tuple[str, ...] = ()

    @property
    def remark(self) -> str:
        """What is to be said of the picture; empty where nothing is missing."""
        if not self.missing:
            return ""
        more = f" and {len(self.missing) - 1} more" if len(self.missing) > 1 else ""
        return (
            f"mesh '{self.missing[0]}'{more} not found or not readable: pictures show the URDF's "
            "other shapes or sticks; numbers do not depend on meshes"
        )

    def at(self, links: Mapping[str, Array]) -> list[Solid]:
        """Everything placed in the world.

        Args:
            links: Link name to its placement in the world, shape (4, 4) [m].

        Raises:
            FigureError: A link with a visual has no placement.
        """
        for shape in self.shapes:
            if shape.link not in links:
                raise FigureError(
                    f"link '{shape.link}' has a visual but no placement; give its 4x4"
                )
        return [shape.at(links[shape.link]) for shape in self.shapes]


def read_shapes(urdf: str, beside: Path | None = None) -> Shapes:
    """The surfaces of a URDF: visuals, and where a visual's mesh is missing the collision shapes.

    Args:
        urdf: Text of the URDF.
        beside: Folder of the URDF, from which its meshes are looked for.

    Raises:
        FigureError: The text is not XML, or a shape's numbers are none.
    """
    root = _root(urdf)
    named = {
        material.get("name", ""): _color(material)
        for material in root.iter("material")
        if material.find("color") is not None
    }
    shapes: list[Shape] = []
    missing: dict[str, None] = {}
    for link in root.iter("link"):
        lacking: list[str] = []
        seen = _carried(link, "visual", named, beside, lacking)
        if lacking:
            seen += _carried(link, "collision", named, beside, [])
        shapes += seen
        missing |= dict.fromkeys(lacking)
    return Shapes(tuple(shapes), tuple(missing))


def _carried(
    link: ET.Element, kind: str, named: Mapping[str, Color], beside: Path | None, lacking: list[str]
) -> list[Shape]:
    """A link's visuals or collision shapes; names of unusable meshes are added to `lacking`."""
    found = []
    for element in link.findall(kind):
        geometry = element.find("geometry")
        solid = None if geometry is None else next(iter(geometry), None)
        if solid is None:
            continue
        shape = _shape(solid, beside)
        if shape is None:
            lacking.append(solid.get("filename", solid.tag))
            continue
        size, sphere, surface = shape
        color = _material_color(element.find("material"), named)
        name = link.get("name", "")
        found.append(Shape(name, _origin(element), color, size, sphere, surface))
    return found


def _shape(solid: ET.Element, beside: Path | None) -> tuple[Array, bool, Surface | None] | None:
    """Size, whether a sphere, and triangles of a geometry; None for what cannot be drawn."""
    if solid.tag == "box":
        return _vector(solid.get("size", "0 0 0")), False, None
    if solid.tag == "sphere":
        return np.full(3, 2 * _vector(solid.get("radius", "0"), 1)), True, None
    if solid.tag in ("cylinder", "capsule"):
        radius, length = (float(_vector(solid.get(k, "0"), 1)[0]) for k in ("radius", "length"))
        return np.ones(3), False, cylinder(radius, length)
    file = mesh_file(solid.get("filename", ""), beside) if solid.tag == "mesh" else None
    surface = None if file is None else read_surface(file)
    return None if surface is None else (_vector(solid.get("scale", "1 1 1")), False, surface)


def _material_color(material: ET.Element | None, named: Mapping[str, Color]) -> Color | None:
    if material is None:
        return None
    if material.find("color") is not None:
        return _color(material)
    return named.get(material.get("name", ""))


def joint_marks(urdf: str, links: Mapping[str, Array]) -> list[JointMark]:
    """Origin and axis of every moving joint, in the URDF's order.

    A URDF's joint frame is that of its child link, so the child's placement gives both.

    Raises:
        FigureError: The text is not XML, or a child link has no placement.
    """
    marks = []
    root = _root(urdf)
    fixed = _fixed_children(root)
    for joint in _moving(root):
        child = joint.find("child")
        link = "" if child is None else child.get("link", "")
        if link not in links:
            raise FigureError(f"joint '{joint.get('name')}': link '{link}' has no placement")
        axis = joint.find("axis")
        direction = _vector("1 0 0" if axis is None else axis.get("xyz", "1 0 0"))
        placement = links[link]
        world = placement[:3, :3] @ (direction / np.linalg.norm(direction))
        slides = joint.get("type") == "prismatic"
        marks.append(
            JointMark(joint.get("name", ""), placement[:3, 3], world, _rigid(link, fixed), slides)
        )
    return marks


def _root(urdf: str) -> ET.Element:
    try:
        return ET.fromstring(urdf)
    except ET.ParseError as error:
        raise FigureError(f"the URDF is not XML ({error}); nothing to draw") from None


def _moving(root: ET.Element) -> Iterator[ET.Element]:
    for joint in root.iter("joint"):
        if joint.get("type") in ("revolute", "continuous", "prismatic"):
            yield joint


def _color(material: ET.Element) -> Color:
    color = material.find("color")
    text = "0.6 0.6 0.6 1" if color is None else color.get("rgba", "0.6 0.6 0.6 1")
    red, green, blue = _vector(text, 4)[:3]
    return float(red), float(green), float(blue)


def _origin(element: ET.Element) -> Array:
    """The element's <origin> as a homogeneous matrix; fixed axes roll, pitch, yaw."""
    placement = np.eye(4)
    origin = element.find("origin")
    if origin is None:
        return placement
    roll, pitch, yaw = _vector(origin.get("rpy", "0 0 0"))
    cr, sr = np.cos(roll), np.sin(roll)
    cp, sp = np.cos(pitch), np.sin(pitch)
    cy, sy = np.cos(yaw), np.sin(yaw)
    placement[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    placement[:3, 3] = _vector(origin.get("xyz", "0 0 0"))
    return placement


def _fixed_children(root: ET.Element) -> dict[str, list[str]]:
    """Links that hang on fixed joints, by the link they are fixed to."""
    children: dict[str, list[str]] = {}
    for joint in root.iter("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        if joint.get("type") == "fixed" and parent is not None and child is not None:
            children.setdefault(parent.get("link", ""), []).append(child.get("link", ""))
    return children


def _rigid(link: str, fixed: Mapping[str, Sequence[str]]) -> frozenset[str]:
    """A link and all that is fixed to it."""
    found, waiting = set(), [link]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += fixed.get(name, ())
    return frozenset(found)


def _vector(text: str, length: int = 3) -> Array:
    try:
        vector = np.array([float(part) for part in text.split()])
    except ValueError:
        vector = np.empty(0)
    if vector.size != length or not np.isfinite(vector).all():
        raise FigureError(f"the URDF has '{text}' where {length} numbers are expected")
    return vector
