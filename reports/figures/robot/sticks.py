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
    """The scene, with sticks for every leg of which it shows nothing.

    Args:
        scene: What the URDF shows, in the world.
        legs: In the same posture.

    Returns:
        The solids, and words for the picture; empty where no stick was added.
    """
    bare = bare_legs(scene, legs)
    if not bare:
        return list(scene), ""
    centre = trunk_centre(legs)
    sticks = [s for leg in legs if leg.name in bare for _, s in leg_sticks(leg, centre)]
    which = "legs" if len(bare) == len(legs) else f"legs {', '.join(bare)}"
    return [*scene, *sticks], f"{which} without shapes in the URDF: sticks between their joints"


def bare_legs(scene: Sequence[Solid], legs: Sequence[Leg]) -> list[str]:
    """Names of the legs of whose moving links none has a shape but spheres."""
    shown = {s.link for s in scene if not (isinstance(s, Primitive) and s.sphere)}
    return [leg.name for leg in legs if not any(shown & joint.links for joint in leg.joints)]


def trunk_centre(legs: Sequence[Leg]) -> Array:
    """Where the legs' first joints are on average, shape (3,) [m]."""
    centre: Array = np.mean([leg.joints[0].position for leg in legs], axis=0)
    return centre


def leg_sticks(leg: Leg, centre: Array) -> list[tuple[int, Primitive]]:
    """Sticks from the trunk's centre through a leg's joints to its foot.

    Returns:
        Each with how many of the leg's joints carry it: 0 for the one fixed to the trunk.
    """
    points = [centre, *(joint.position for joint in leg.joints), leg.foot]
    length = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(points))
    return [
        (k, _stick(a, b, _SLENDER * length))
        for k, (a, b) in enumerate(pairwise(points))
        if np.linalg.norm(b - a) > 1e-9
    ]


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
