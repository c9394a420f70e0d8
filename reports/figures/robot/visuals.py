"""Visual primitives, joints and placements of a robot, as read from its URDF text.

Placements come from the caller (from Pinocchio); this module computes no kinematics.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reports.errors import FigureError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Primitive:
    """A box or a sphere somewhere in the world.

    Attributes:
        link: The link it belongs to.
        color: Red, green, blue from 0 to 1.
        placement: Of its centre in the world, homogeneous, shape (4, 4) [m].
        size: Edge lengths of a box, shape (3,) [m]; for a sphere its diameter three times.
        sphere: Whether it is a sphere.
    """

    link: str
    color: tuple[float, float, float]
    placement: Array
    size: Array
    sphere: bool


@dataclass(frozen=True)
class JointMark:
    """Where a joint is and which way it turns.

    Attributes:
        name: Of the joint.
        position: Origin in the world, shape (3,) [m].
        axis: Unit vector in the world, shape (3,); positive rotation is right-handed about it.
    """

    name: str
    position: Array
    axis: Array


def primitives(urdf: str, links: Mapping[str, Array]) -> list[Primitive]:
    """The boxes and spheres of a URDF, placed in the world.

    Args:
        urdf: Text of the URDF.
        links: Link name to its placement in the world, shape (4, 4) [m].

    Raises:
        FigureError: The text is not XML, or a link with a visual has no placement.

    Note:
        Cylinders and meshes are left out: the project's robots are built of boxes and spheres.
    """
    root = _root(urdf)
    colors = {
        material.get("name", ""): _color(material)
        for material in root.iter("material")
        if material.find("color") is not None
    }
    found = []
    for link in root.iter("link"):
        name = link.get("name", "")
        for visual in link.iter("visual"):
            shape = _shape(visual)
            if shape is None:
                continue
            if name not in links:
                raise FigureError(f"link '{name}' has a visual but no placement; give its 4x4")
            size, sphere = shape
            material = visual.find("material")
            color = (0.6, 0.6, 0.6)
            if material is not None:
                color = colors.get(material.get("name", ""), color)
            found.append(
                Primitive(name, color, links[name] @ _origin(visual), size, sphere),
            )
    return found


def joint_marks(urdf: str, links: Mapping[str, Array]) -> list[JointMark]:
    """Origin and axis of every moving joint, in the URDF's order.

    A URDF's joint frame is that of its child link, so the child's placement gives both.

    Raises:
        FigureError: The text is not XML, or a child link has no placement.
    """
    marks = []
    for joint in _moving(_root(urdf)):
        child = joint.find("child")
        link = "" if child is None else child.get("link", "")
        if link not in links:
            raise FigureError(f"joint '{joint.get('name')}': link '{link}' has no placement")
        axis = joint.find("axis")
        direction = _vector("1 0 0" if axis is None else axis.get("xyz", "1 0 0"))
        placement = links[link]
        world = placement[:3, :3] @ (direction / np.linalg.norm(direction))
        marks.append(JointMark(joint.get("name", ""), placement[:3, 3], world))
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


def _shape(visual: ET.Element) -> tuple[Array, bool] | None:
    box = visual.find("geometry/box")
    if box is not None:
        return _vector(box.get("size", "0 0 0")), False
    sphere = visual.find("geometry/sphere")
    if sphere is not None:
        return np.full(3, 2 * _vector(sphere.get("radius", "0"), 1)), True
    return None


def _color(material: ET.Element) -> tuple[float, float, float]:
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


def _vector(text: str, length: int = 3) -> Array:
    try:
        vector = np.array([float(part) for part in text.split()])
    except ValueError:
        vector = np.empty(0)
    if vector.size != length or not np.isfinite(vector).all():
        raise FigureError(f"the URDF has '{text}' where {length} numbers are expected")
    return vector
