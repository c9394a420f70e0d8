"""Mesh files as triangles: where a URDF's name for one leads, what Trimesh reads there, thinned.

No number of a result depends on a mesh: one that cannot be found or read is reported and left out.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from reports.figures.robot.solids import GREY, Color, Solid, mesh

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
