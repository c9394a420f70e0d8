"""What a URDF shows of its links: boxes, spheres, cylinders and meshes."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from actuators.arrays import Array
from pipeline.errors import FigureError
from reports.figures.robot.meshes import mesh_file, read_mesh
from reports.figures.robot.solids import GREY, Color, Solid, box, cylinder, mesh, sphere


@dataclass(frozen=True)
class Visuals:
    """What a URDF shows of its robot."""

    #: Link and surface in the link's frame, in the URDF's order.
    solids: tuple[tuple[str, Solid], ...]
    #: Meshes that were not found or not read, as the URDF names them.
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


def read_visuals(urdf: str, folder: Path | None = None) -> Visuals:
    """The surfaces of a URDF: visuals, and where a visual's mesh is missing the collision shapes.

    Args:
        folder: Of the URDF, from which its meshes are looked for.

    Raises:
        FigureError: The text is not XML, or a shape's numbers are none.
    """
    try:
        root = ET.fromstring(urdf)
    except ET.ParseError as error:
        raise FigureError(f"the URDF is not XML ({error}); nothing to draw") from None
    named = {
        material.get("name", ""): _rgb(color)
        for material in root.iter("material")
        if (color := material.find("color")) is not None
    }
    solids: list[tuple[str, Solid]] = []
    missing: dict[str, None] = {}
    for link in root.iter("link"):
        lacking: list[str] = []
        seen = _shapes(link, "visual", named, folder, lacking)
        if lacking:
            seen += _shapes(link, "collision", named, folder, [])
        solids += [(link.get("name", ""), solid) for solid in seen]
        missing |= dict.fromkeys(lacking)
    return Visuals(tuple(solids), tuple(missing))


def _shapes(
    link: ET.Element, kind: str, named: Mapping[str, Color], folder: Path | None, lacking: list[str]
) -> list[Solid]:
    """A link's visuals or collision shapes; names of unusable meshes are added to `lacking`."""
    found = []
    for element in link.findall(kind):
        shape = element.find("geometry/*")
        if shape is None:
            continue
        color = element.find("material/color")
        name = element.find("material")
        rgb = _rgb(color) if color is not None else None
        if rgb is None and name is not None:
            rgb = named.get(name.get("name", ""))
        solid = _solid(shape, rgb, folder)
        if solid is None:
            lacking.append(shape.get("filename", shape.tag))
        else:
            found.append(solid.moved(_origin(element.find("origin"))))
    return found


def _solid(shape: ET.Element, rgb: Color | None, folder: Path | None) -> Solid | None:
    """A geometry about its own origin; None for what cannot be drawn."""

    def number(name: str) -> float:
        return float(_vector(shape.get(name, "0"), 1)[0])

    color = rgb or GREY
    if shape.tag == "box":
        return box(_vector(shape.get("size", "0 0 0")), color)
    if shape.tag == "sphere":
        return sphere(number("radius"), color)
    if shape.tag in ("cylinder", "capsule"):
        return cylinder(number("radius"), number("length"), color)
    file = mesh_file(shape.get("filename", ""), folder) if shape.tag == "mesh" else None
    read = None if file is None else read_mesh(file)
    if read is None:
        return None
    colors = read.colors if rgb is None else rgb
    return mesh(read.points * _vector(shape.get("scale", "1 1 1")), read.faces, colors)


def _rgb(color: ET.Element) -> Color:
    red, green, blue, _ = _vector(color.get("rgba", "0.6 0.6 0.6 1"), 4)
    return float(red), float(green), float(blue)


def _origin(origin: ET.Element | None) -> Array:
    """An <origin> as a homogeneous matrix; fixed axes roll, pitch, yaw."""
    placement = np.eye(4)
    if origin is not None:
        angles = _vector(origin.get("rpy", "0 0 0"))
        placement[:3, :3] = Rotation.from_euler("xyz", angles).as_matrix()
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
