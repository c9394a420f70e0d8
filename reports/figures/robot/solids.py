"""What a picture of a robot is made of: coloured triangles in the world, joints and legs."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array

Color = tuple[float, float, float]
#: Of what has no colour of its own.
GREY: Color = (0.6, 0.6, 0.6)
_CORNERS = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)])
_SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
_SLENDER = 0.03  # thickness of a stick over the leg's length


@dataclass(frozen=True)
class Solid:
    """A surface of triangles."""

    kind: str  #: ``"box"``, ``"sphere"`` or ``"mesh"``.
    points: Array  #: Vertices, shape (V, 3) [m].
    faces: NDArray[np.intp]  #: Rows of `points`, shape (F, 3).
    colors: Array  #: Of each face, red, green, blue from 0 to 1, shape (F, 3).
    #: Number of the side to which each face belongs; a line is drawn around each, shape (F,).
    sides: NDArray[np.intp]
    #: Points within which it lies: of a box or sphere those of the box around it (x counts
    #: slowest), of a mesh its vertices, shape (P, 3) [m].
    corners: Array
    body: int = 0  #: Number of the rigid body that carries it.

    def moved(self, placement: Array) -> Solid:
        """The same elsewhere.

        Args:
            placement: Homogeneous, shape (4, 4) [m].
        """
        turn, shift = placement[:3, :3].T, placement[:3, 3]
        points = self.points @ turn + shift
        corners = points if self.kind == "mesh" else self.corners @ turn + shift
        return replace(self, points=points, corners=corners)


def box(size: Array, color: Color = GREY) -> Solid:
    """A box about the origin, of edge lengths of shape (3,) [m]."""
    corners = _CORNERS * size
    faces = np.array([half for a, b, c, d in _SIDES for half in ((a, b, c), (a, c, d))])
    sides = np.repeat(np.arange(6), 2)
    return Solid("box", corners, faces, np.tile(color, (12, 1)), sides, corners)


def mesh(points: Array, faces: NDArray[np.intp], colors: Array | Color = GREY) -> Solid:
    """Triangles with a colour of each, or one of all."""
    colors = np.broadcast_to(np.asarray(colors, float), (len(faces), 3))
    return Solid("mesh", points, faces, colors, np.zeros(len(faces), dtype=np.intp), points)


def cylinder(radius: float, length: float, color: Color = GREY) -> Solid:
    """A cylinder about the z axis, centred at the origin [m]."""
    half = length / 2
    return mesh(*_turned([0, radius, radius, 0], [-half, -half, half, half], 32), color)


def sphere(radius: float, color: Color = GREY) -> Solid:
    """A ball about the origin, of a radius [m]."""
    angle = np.linspace(0, np.pi, 37)
    ball = mesh(*_turned(radius * np.sin(angle), -radius * np.cos(angle), 72), color)
    return replace(ball, kind="sphere", corners=2 * radius * _CORNERS)


def _turned(
    radius: Sequence[float] | Array, z: Sequence[float] | Array, count: int
) -> tuple[Array, NDArray[np.intp]]:
    """Vertices and faces of the surface that a line from the lower to the upper end sweeps."""
    angle = 2 * np.pi * np.arange(count) / count
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.ones(count)])
    points = np.concatenate([ring * [r, r, height] for r, height in zip(radius, z, strict=True)])
    i = np.arange(count)
    j = (i + 1) % count
    strip = np.concatenate(
        [np.column_stack([i, j, j + count]), np.column_stack([i, j + count, i + count])]
    )
    return points, np.concatenate([strip + count * k for k in range(len(points) // count - 1)])


@dataclass(frozen=True)
class JointMark:
    """Where a joint is and which way it moves."""

    name: str  #: Of the joint.
    position: Array  #: Origin in the world, shape (3,) [m].
    #: Unit vector in the world, shape (3,); positive rotation is right-handed about it, positive
    #: sliding along it.
    axis: Array
    slides: bool = False  #: Whether it is prismatic.


@dataclass(frozen=True)
class Leg:
    """One leg in one posture."""

    name: str  #: Shown at the foot.
    joints: tuple[JointMark, ...]  #: From the base outward.
    foot: Array  #: Contact point in the world, shape (3,) [m].

    @property
    def links(self) -> list[tuple[Array, Array]]:
        """Both ends of each link in the world, shape (3,) each [m]."""
        return list(pairwise([*(joint.position for joint in self.joints), self.foot]))

    @property
    def length(self) -> float:
        """Of all links together [m]."""
        return sum(float(np.linalg.norm(b - a)) for a, b in self.links)


def sticks(leg: Leg, legs: Sequence[Leg], bodies: Sequence[int]) -> list[Solid]:
    """Sticks from the middle of the trunk through a leg's joints to its foot.

    Args:
        legs: All legs, whose first joints are around the middle of the trunk.
        bodies: Numbers of the bodies that carry each stick, from the trunk outward.
    """
    centre = np.mean([one.joints[0].position for one in legs], axis=0)
    ends = [(centre, leg.joints[0].position), *leg.links]
    thick = _SLENDER * sum(float(np.linalg.norm(b - a)) for a, b in ends)
    return [
        replace(_stick(a, b, thick), body=body)
        for body, (a, b) in zip(bodies, ends, strict=True)
        if np.linalg.norm(b - a) > 1e-9
    ]


def _stick(a: Array, b: Array, thick: float) -> Solid:
    length = float(np.linalg.norm(b - a))
    along = (b - a) / length
    side = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])  # any that is not along it
    side /= np.linalg.norm(side)
    placement = np.eye(4)
    placement[:3, :3] = np.column_stack([side, np.cross(along, side), along])
    placement[:3, 3] = (a + b) / 2
    return box(np.array([thick, thick, length + thick])).moved(placement)


def reach(scene: Sequence[Solid]) -> float:
    """Size of a robot: the longest edge of the box around it [m]."""
    return float(np.ptp(np.concatenate([solid.corners for solid in scene]), axis=0).max())


def outline(points: Array) -> Array:
    """Corners of the convex hull of points in a plane, counter-clockwise, shape (P, 2)."""
    from scipy.spatial import ConvexHull, QhullError

    points = np.unique(np.round(points, 6), axis=0)
    try:
        corners: Array = points[ConvexHull(points).vertices]
    except (QhullError, ValueError):
        return points[[0, -1]] if len(points) > 1 else points
    first = int(np.lexsort(corners.T[::-1])[0])
    return np.roll(corners, -first, axis=0)


def hull_points(points: Array, cell: float) -> Array:
    """Corners of the convex hull of points in space, those within one cell drawn into one.

    Args:
        points: Shape (P, 3) [m].
        cell: [m].

    Returns:
        Shape (Q, 3) [m]; all points where they have no hull.
    """
    from scipy.spatial import ConvexHull, QhullError

    with suppress(QhullError, ValueError):
        points = points[ConvexHull(points).vertices]
    _, first = np.unique(np.round(points / cell).astype(np.int64), axis=0, return_index=True)
    return points[np.sort(first)]
