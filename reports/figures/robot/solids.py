"""What a picture of a robot is made of: boxes, spheres and meshes in the world, and joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_CORNERS = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)])


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

    @property
    def points(self) -> Array:
        """Corners of the box around it in the world, shape (8, 3) [m]."""
        return (self.size * _CORNERS) @ self.placement[:3, :3].T + self.placement[:3, 3]


@dataclass(frozen=True)
class Mesh:
    """Triangles somewhere in the world.

    Attributes:
        link: The link it belongs to.
        points: Its vertices in the world, shape (V, 3) [m].
        faces: Rows of `points`, shape (F, 3).
        colors: Of each face, red, green, blue from 0 to 1, shape (F, 3).
    """

    link: str
    points: Array
    faces: NDArray[np.intp]
    colors: Array


#: Anything with a surface.
Solid = Primitive | Mesh


@dataclass(frozen=True)
class JointMark:
    """Where a joint is and which way it moves.

    Attributes:
        name: Of the joint.
        position: Origin in the world, shape (3,) [m].
        axis: Unit vector in the world, shape (3,); positive rotation is right-handed about it,
            positive sliding along it.
        links: Those that it carries, its own child and what is fixed to that.
        slides: Whether it is prismatic.
    """

    name: str
    position: Array
    axis: Array
    links: frozenset[str] = frozenset()
    slides: bool = False
