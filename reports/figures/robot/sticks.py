"""Legs as sticks from joint to joint, where a URDF shows nothing of them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from reports.figures.robot.solids import Leg, Primitive, Solid

Array = NDArray[np.float64]
_GREY = (0.6, 0.6, 0.6)
_SLENDER = 0.03  # thickness over the leg's length


def with_sticks(scene: Sequence[Solid], legs: Sequence[Leg]) -> tuple[list[Solid], str]:
    """The scene, with sticks for every leg of whose moving links none has a shape but spheres.

    Args:
        scene: What the URDF shows, in the world.
        legs: In the same posture.

    Returns:
        The solids, and words for the picture; empty where no stick was added.
    """
    shown = {s.link for s in scene if not (isinstance(s, Primitive) and s.sphere)}
    bare = [leg for leg in legs if not any(shown & joint.links for joint in leg.joints)]
    if not bare:
        return list(scene), ""
    sticks = []
    centre = np.mean([leg.joints[0].position for leg in legs], axis=0)
    for leg in bare:
        points = [centre, *(joint.position for joint in leg.joints), leg.foot]
        length = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(points))
        for a, b in pairwise(points):
            if np.linalg.norm(b - a) > 1e-9:
                sticks.append(_stick(a, b, _SLENDER * length))
    which = "legs" if len(bare) == len(legs) else f"legs {', '.join(leg.name for leg in bare)}"
    return [*scene, *sticks], f"{which} without shapes in the URDF: sticks between their joints"


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
