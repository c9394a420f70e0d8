"""Mesh files as triangles: where a URDF's name for one leads, what Trimesh reads there, thinned.

Nothing here moves a number of a result: a mesh that cannot be found or read is said and left out.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: With more faces than this a mesh is thinned, to cells of this share of its length.
_MANY, _CELL = 4000, 1 / 128
_TEXELS = 256  # along the side of a texture; more than a face of a picture shows


@dataclass(frozen=True)
class Surface:
    """Triangles in a frame of their own.

    Attributes:
        vertices: Shape (V, 3) [m].
        faces: Rows of `vertices`, shape (F, 3).
        colors: Of each face, red, green, blue from 0 to 1, shape (F, 3); None where the file has
            none.
    """

    vertices: Array
    faces: NDArray[np.intp]
    colors: Array | None = None


def mesh_file(name: str, beside: Path | None) -> Path | None:
    """The file that a URDF's ``<mesh filename>`` means; None where there is none.

    ``package://NAME/PATH`` is looked for as folder ``NAME`` in every folder above the URDF, in
    ``ROS_PACKAGE_PATH``, and among the robots of example-robot-data.

    Args:
        name: As the URDF has it.
        beside: Folder of the URDF.
    """
    scheme, separator, rest = name.partition("://")
    if not separator:
        places: Iterator[Path] = iter([(beside or Path()) / name])
    elif scheme == "file":
        places = iter([Path(unquote(rest))])
    else:
        package, _, path = rest.partition("/")
        places = (place / path for place in _packages(package, beside))
    return next((place for place in places if place.is_file()), None)


def _packages(package: str, beside: Path | None) -> Iterator[Path]:
    """Folders that may be the package."""
    above = [] if beside is None else [beside.absolute(), *beside.absolute().parents]
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
def read_surface(path: Path) -> Surface | None:
    """The triangles of a mesh file, thinned; None where Trimesh cannot read it."""
    import trimesh

    try:
        scene: Any = trimesh.load_scene(path, process=False)
        parts = [scene.graph[node] for node in scene.graph.nodes_geometry]
        read = [_part(scene.geometry[name], placement) for placement, name in parts]
    except Exception:
        return None
    read = [part for part in read if part.faces.size]
    return thinned(_joined(read)) if read else None


def _part(mesh: Any, placement: Array) -> Surface:
    vertices = np.asarray(mesh.vertices, float)
    faces = np.asarray(getattr(mesh, "faces", np.empty((0, 3))), dtype=np.intp)
    world = vertices @ placement[:3, :3].T + placement[:3, 3]
    return Surface(world, faces, _face_colors(mesh, faces))


def _face_colors(mesh: Any, faces: NDArray[np.intp]) -> Array | None:
    """Colour of every face: its texture where it has one, else the material's."""
    visual = getattr(mesh, "visual", None)
    if visual is None or not visual.defined:
        return None
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


def _joined(parts: list[Surface]) -> Surface:
    first = np.cumsum([0, *(len(part.vertices) for part in parts)])
    grey = np.full(3, 0.6)
    colors = None
    if any(part.colors is not None for part in parts):
        colors = np.concatenate(
            [
                np.tile(grey, (len(part.faces), 1)) if part.colors is None else part.colors
                for part in parts
            ]
        )
    return Surface(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.faces + n for part, n in zip(parts, first[:-1], strict=True)]),
        colors,
    )


def thinned(surface: Surface) -> Surface:
    """The surface with the vertices of each small cell drawn into one; as it is where it is small.

    Args:
        surface: Of any number of faces.
    """
    if len(surface.faces) <= _MANY:
        return surface
    low = surface.vertices.min(axis=0)
    cell = max(float(np.ptp(surface.vertices, axis=0).max()) * _CELL, 1e-9)
    cells = np.floor((surface.vertices - low) / cell).astype(np.int64)
    _, at = np.unique(cells @ np.array([1, 1 << 16, 1 << 32]), return_inverse=True)
    count = np.bincount(at)
    vertices = np.column_stack([np.bincount(at, v) / count for v in surface.vertices.T])
    faces = at[surface.faces].astype(np.intp)
    a, b, c = faces.T
    kept = (a != b) & (b != c) & (c != a)
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    kept &= np.isin(np.arange(len(faces)), first)
    colors = None if surface.colors is None else surface.colors[kept]
    return Surface(vertices, faces[kept], colors)


def cylinder(radius: float, length: float, sides: int = 32) -> Surface:
    """A cylinder about its z axis, as a URDF has it: centred at the origin.

    Args:
        radius: [m].
        length: [m].
        sides: Of the prism that is drawn.
    """
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    half = np.full((sides, 1), length / 2)
    vertices = np.concatenate(
        [
            np.hstack([ring, -half]),
            np.hstack([ring, half]),
            [[0, 0, -length / 2], [0, 0, length / 2]],
        ]
    )
    i = np.arange(sides, dtype=np.intp)
    j = (i + 1) % sides
    low, high = np.full(sides, 2 * sides), np.full(sides, 2 * sides + 1)
    faces = np.concatenate(
        [
            np.column_stack([i, j, j + sides]),
            np.column_stack([i, j + sides, i + sides]),
            np.column_stack([low, j, i]),
            np.column_stack([high, i + sides, j + sides]),
        ]
    )
    return Surface(vertices, faces)
