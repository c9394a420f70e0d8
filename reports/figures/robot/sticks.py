"""Legs as sticks from joint to joint, for robots whose URDF shows meshes alone."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from reports.figures.robot.visuals import Primitive

if TYPE_CHECKING:
    from reports.figures.robot.robot_view import Leg

Array = NDArray[np.float64]
_GREY = (0.6, 0.6, 0.6)
_SLENDER = 0.03  # thickness over the leg's length
#: Words for a picture with sticks in it.
REMARK = "the URDF shows no boxes: legs are drawn as sticks between their joints"


def with_sticks(scene: Sequence[Primitive], legs: Sequence[Leg]) -> tuple[list[Primitive], str]:
    """The scene, with sticks for the legs where it has no box.

    Args:
        scene: Visual primitives in the world.
        legs: In the same posture.

    Returns:
        The primitives, and `REMARK` where sticks were added.
    """
    if any(not primitive.sphere for primitive in scene):
        return list(scene), ""
    sticks = []
    centre = np.mean([leg.joints[0].position for leg in legs], axis=0)
    for leg in legs:
        points = [centre, *(joint.position for joint in leg.joints), leg.foot]
        length = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(points))
        for a, b in pairwise(points):
            if np.linalg.norm(b - a) > 1e-9:
                sticks.append(_stick(a, b, _SLENDER * length))
    return [*scene, *sticks], REMARK


def _stick(a: Array, b: Array, thickness: float) -> Primitive:
    along = (b - a) / np.linalg.norm(b - a)
    # Any direction that is not along it.
    side = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
    side /= np.linalg.norm(side)
    placement = np.eye(4)
    placement[:3, :3] = np.column_stack([side, np.cross(along, side), along])
    placement[:3, 3] = (a + b) / 2
    size = np.array([thickness, thickness, float(np.linalg.norm(b - a)) + thickness])
    return Primitive("", _GREY, placement, size, sphere=False)
