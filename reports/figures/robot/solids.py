"""What a picture of a robot is made of: boxes, spheres and meshes in the world, and joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reports.errors import FigureError

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


@dataclass(frozen=True)
class Leg:
    """One leg in one posture.

    Attributes:
        name: Shown at the foot.
        joints: From the base outward.
        foot: Contact point in the world, shape (3,) [m].
    """

    name: str
    joints: tuple[JointMark, ...]
    foot: Array


def legs_of(
    names: Mapping[str, tuple[Sequence[str], str]],
    marks: Sequence[JointMark],
    links: Mapping[str, Array],
) -> list[Leg]:
    """Gather legs from joint marks and link placements.

    Args:
        names: Leg to (its joints' names from the base outward, its foot link).
        marks: From `visuals.joint_marks`.
        links: Link name to placement, shape (4, 4) [m].

    Raises:
        FigureError: A joint or foot that is not there.
    """
    by_name = {mark.name: mark for mark in marks}
    legs = []
    for leg, (joints, foot) in names.items():
        lacking = [joint for joint in joints if joint not in by_name]
        if lacking or foot not in links:
            raise FigureError(f"leg '{leg}': '{(lacking or [foot])[0]}' is not placed")
        legs.append(Leg(leg, tuple(by_name[j] for j in joints), links[foot][:3, 3]))
    return legs


def reach(scene: Sequence[Solid]) -> float:
    """Size of a robot: the longest edge of the box around it [m]."""
    points = np.concatenate([solid.points for solid in scene])
    return float(np.ptp(points, axis=0).max())
