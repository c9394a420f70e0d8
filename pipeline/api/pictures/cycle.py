"""What the player shows: surfaces of moving bodies, and one cycle in steps."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reports.figures.robot.gait_steps import Steps
from reports.figures.robot.solids import Mesh, Primitive, Solid

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MovingBody:
    """A rigid body and its way through the cycle.

    Attributes:
        name: Unique.
        solids: Its surfaces as they are in the first step, in the frame of the steps.
        position: Where its frame moves, relative to the first step, shape (S, 3) [m].
        rotation: How it turns, relative to the first step, shape (S, 3, 3).
    """

    name: str
    solids: tuple[Solid, ...]
    position: Array
    rotation: Array


@dataclass(frozen=True)
class Cycle:
    """Everything to be played.

    Attributes:
        title: Robot and gait.
        bodies: What moves.
        steps: Feet, forces, joints and torques.
        joints: Names of the joints of `steps`.
        units: Of each joint's torque or force.
        ground: Unit normal of the ground, shape (3,).
    """

    title: str
    bodies: tuple[MovingBody, ...]
    steps: Steps
    joints: tuple[str, ...]
    units: tuple[str, ...]
    ground: Array


def triangles(solids: Iterable[Solid]) -> Any:
    """Surfaces as one Trimesh with a colour for every face."""
    import trimesh

    parts: list[Any] = []
    for solid in solids:
        part: Any
        if isinstance(solid, Mesh):
            part = trimesh.Trimesh(solid.points, solid.faces, process=False)
            colors = solid.colors
        else:
            part = _primitive(solid)
            colors = np.tile(solid.color, (len(part.faces), 1))
        alpha = np.ones((len(colors), 1))
        part.visual.face_colors = np.round(255 * np.hstack([colors, alpha])).astype(np.uint8)
        parts.append(part)
    return trimesh.util.concatenate(parts)


def _primitive(solid: Primitive) -> Any:
    import trimesh

    if solid.sphere:
        part = trimesh.creation.icosphere(subdivisions=2, radius=float(solid.size[0]) / 2)
        part.apply_transform(solid.placement)
        return part
    return trimesh.creation.box(extents=solid.size, transform=solid.placement)


def quaternions(rotation: Array) -> Array:
    """Rotations as w, x, y, z: (S, 3, 3) to (S, 4)."""
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(rotation).as_quat().T
    return np.column_stack([w, x, y, z])


def arrow(width: float) -> tuple[Array, NDArray[np.intp]]:
    """Vertices and faces of an arrow along z, one long, to be scaled.

    Args:
        width: Radius of its head [m].
    """
    import trimesh

    shaft: Any = trimesh.creation.cylinder(
        radius=0.4 * width, segment=np.array([[0, 0, 0], [0, 0, 0.8]])
    )
    head: Any = trimesh.creation.cone(radius=width, height=0.2)
    head.apply_translation([0, 0, 0.8])
    both: Any = trimesh.util.concatenate([shaft, head])
    return np.asarray(both.vertices, float), np.asarray(both.faces, dtype=np.intp)


def towards(direction: Array) -> Array:
    """The least rotation from z to a unit vector, as w, x, y, z, shape (4,)."""
    x, y, z = direction
    if z < -1 + 1e-12:
        return np.array([0.0, 1.0, 0.0, 0.0])
    turned = np.array([1 + z, -y, x, 0.0])
    quaternion: Array = turned / np.linalg.norm(turned)
    return quaternion
