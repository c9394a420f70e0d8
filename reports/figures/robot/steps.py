"""One cycle in steps of equal time: what the moving picture and the viewer play."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from reports.figures.robot.solids import Solid


@dataclass(frozen=True)
class Body:
    """A rigid body of the robot and its way through S steps, in a frame that follows the robot.

    Attributes:
        name: Unique.
        leg: The leg it belongs to; empty for the trunk and what it carries.
        solids: Its surfaces as they are in the world in the first step.
        position: Where their frame moves, shape (S, 3) [m].
        rotation: How they turn, shape (S, 3, 3).
        load: Whether it is no part of the robot but carried by it.
    """

    name: str
    leg: str
    solids: tuple[Solid, ...]
    position: Array
    rotation: Array
    load: bool = False


@dataclass(frozen=True)
class Steps:
    """One cycle in S steps, all places in a frame that follows the robot without turning, z up.

    Attributes:
        legs: All legs.
        joints: All joints of the legs.
        units: Of each joint's torque or force.
        time: Of each step, from 0, shape (S,) [s].
        period: Duration of the cycle [s].
        bodies: What is drawn.
        feet: Shape (S, L, 3) [m].
        stands: Whether a foot stands, shape (S, L).
        force: Of the ground on the feet, shape (S, L, 3) [N].
        places: Where joints are, shape (S, J, 3) [m].
        torque: At the joints, shape (S, J) [N*m].
        mass_centre: Shape (S, 3) [m].
        margin: Static stability, shape (S,) [m].
        origin: Where the frame is in the world, shape (S, 3) [m].
        ground: Unit normal of the ground, shape (3,).
    """

    legs: tuple[str, ...]
    joints: tuple[str, ...]
    units: tuple[str, ...]
    time: Array
    period: float
    bodies: tuple[Body, ...]
    feet: Array
    stands: NDArray[np.bool_]
    force: Array
    places: Array
    torque: Array
    mass_centre: Array
    margin: Array
    origin: Array
    ground: Array
