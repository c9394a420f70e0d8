"""What a URDF shows of its links: boxes, spheres, cylinders, and meshes from their files.

No number of a result depends on a mesh: one that cannot be found or read is reported and left out.
"""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from actuators.arrays import Array
from pipeline.errors import FigureError
from reports.figures.robot.solids import GREY, Color, Solid, box, cylinder, mesh, sphere

#: With more faces than this a mesh is thinned, to cells of this share of its length.
_MANY, _CELL = 4000, 1 / 128
_TEXELS = 256  # along the side of a texture; more than a face of a picture shows


def mesh_file(name: str, folder: Path | None) -> Path | None:
    """The file that a URDF's ``<mesh filename>`` means; None where there is none.

    ``package://NAME/PATH`` is looked for as folder ``NAME`` in every folder above the URDF, in
    ``ROS_PACKAGE_PATH``, and among the robots of example-robot-data.
    """
    scheme, separator, rest = name.partition("://")
    if not separator:
        places: Iterator[Path] = iter([(folder or Path()) / name])
    elif scheme == "file":
        places = iter([Path(unquote(rest))])
    else:
        package, _, path = rest.partition("/")
        places = (place / path for place in _packages(package, folder))
    return next((place for place in places if place.is_file()), None)


def _packages(package: str, folder: Path | None) -> Iterator[Path]:
    """Folders that may be the package."""
    above = [] if folder is None else [folder.absolute(), *folder.absolute().parents]
    found = [Path(p) for p in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if p]
    for folder in (*above, *found, *_example_robots()):
        if folder.name == package:
            yield folder
        yield folder / package


def _example_robots() -> list[Path]:
    """Where example-robot-data keeps its robots, and the package's own name for it."""
    spec = find_spec("example_robot_data")
    for root in Path(spec.origin).parents if spec is not None and spec.origin else ():
        share = root / "share" / "example-robot-data"
        if share.is_dir():
            return [share, share / "robots"]
    return []


@lru_cache(maxsize=256)
def read_mesh(path: Path) -> Solid | None:
    """The triangles of a mesh file, thinned; None where Trimesh cannot read it."""
    import trimesh

    try:
        scene: Any = trimesh.load_scene(path, process=False)
        parts = [scene.graph[node] for node in scene.graph.nodes_geometry]
        read = [_part(scene.geometry[name]).moved(placement) for placement, name in parts]
    except Exception:
        return None
    read = [part for part in read if part.faces.size]
    return thinned(_joined(read)) if read else None


def _part(part: Any) -> Solid:
    faces = np.asarray(getattr(part, "faces", np.empty((0, 3))), dtype=np.intp)
    return mesh(np.asarray(part.vertices, float), faces, _face_colors(part, faces))


def _face_colors(part: Any, faces: NDArray[np.intp]) -> Array | Color:
    """Colour of every face: its texture where it has one, else the material's."""
    visual = getattr(part, "visual", None)
    if visual is None or not visual.defined:
        return GREY
    material, uv = getattr(visual, "material", None), getattr(visual, "uv", None)
    if material is None:
        return np.asarray(visual.face_colors, float)[:, :3] / 255
    image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    if image is None or uv is None:
        return np.tile(np.asarray(material.main_color, float)[:3] / 255, (len(faces), 1))
    image.draft("RGB", (_TEXELS, _TEXELS))  # a JPEG is then read at a fraction of its cost
    texels = np.asarray(image.convert("RGB").resize((_TEXELS, _TEXELS)), float) / 255
    u, v = (np.asarray(uv)[faces].mean(axis=1) % 1.0).T
    return texels[((1 - v) * (_TEXELS - 1)).astype(int), (u * (_TEXELS - 1)).astype(int)]


def _joined(parts: list[Solid]) -> Solid:
    first = np.cumsum([0, *(len(part.points) for part in parts)])
    return mesh(
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.faces + n for part, n in zip(parts, first[:-1], strict=True)]),
        np.concatenate([part.colors for part in parts]),
    )


def thinned(whole: Solid) -> Solid:
    """A mesh with the vertices of each small cell drawn into one; as it is where it is small."""
    if len(whole.faces) <= _MANY:
        return whole
    cell = max(float(np.ptp(whole.points, axis=0).max()) * _CELL, 1e-9)
    cells = np.floor((whole.points - whole.points.min(axis=0)) / cell).astype(np.int64)
    _, at = np.unique(cells @ np.array([1, 1 << 16, 1 << 32]), return_inverse=True)
    points = np.column_stack([np.bincount(at, v) for v in whole.points.T])
    faces = at[whole.faces].astype(np.intp)
    a, b, c = faces.T
    kept = (a != b) & (b != c) & (c != a)
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    kept &= np.isin(np.arange(len(faces)), first)
    return mesh(points / np.bincount(at)[:, None], faces[kept], whole.colors[kept])


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
