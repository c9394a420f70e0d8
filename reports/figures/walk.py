"""What pictures show of a walk: stretches of a cycle, and its steps of equal time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from reports.figures.robot.solids import Solid


@dataclass(frozen=True)
class Stretch:
    """Part of a gait during which the same feet stand, both ends included.

    N samples, L legs, J joints. A figure reads no more of it than it shows.
    """

    time: Array  #: Shape (N,) [s].
    stance: tuple[str, ...]  #: Legs that stand.
    velocity: Array  #: Of every joint, shape (N, J) [rad/s]; of sliding ones [m/s].
    torque: Array  #: Of every joint, shape (N, J) [N*m]; of sliding ones their force [N].
    feet: Array  #: In the base frame, shape (N, L, 3) [m].
    normal: Array  #: Force of the ground across it, by leg, shape (N, L) [N].
    friction: Array  #: Tangential over normal force, NaN where none rests, shape (N, L).
    mass_centre: Array  #: In the base frame, shape (N, 3) [m].
    #: Distance of the centre of mass from the nearest edge of the support polygon, seen from above,
    #: shape (N,) [m].
    margin: Array

    def every(self, rows: NDArray[np.intp]) -> Stretch:
        """The same at some of its samples, given by their numbers."""
        arrays = {name: value[rows] for name, value in vars(self).items() if name != "stance"}
        return Stretch(stance=self.stance, **arrays)


@dataclass(frozen=True)
class Body:
    """A rigid body of the robot and its way through S steps, in a frame that follows the robot."""

    name: str  #: Unique.
    leg: str  #: The leg it belongs to; empty for the trunk and what it carries.
    solids: tuple[Solid, ...]  #: Its surfaces as they are in the world in the first step.
    position: Array  #: Where their frame moves, shape (S, 3) [m].
    rotation: Array  #: How they turn, shape (S, 3, 3).
    load: bool = False  #: Whether it is no part of the robot but carried by it.


@dataclass(frozen=True)
class Steps:
    """One cycle in S steps, all places in a frame that follows the robot without turning, z up."""

    legs: tuple[str, ...]  #: All legs.
    joints: tuple[str, ...]  #: All joints of the legs.
    units: tuple[str, ...]  #: Of each joint's torque or force.
    time: Array  #: Of each step, from 0, shape (S,) [s].
    period: float  #: Duration of the cycle [s].
    bodies: tuple[Body, ...]  #: What is drawn.
    feet: Array  #: Shape (S, L, 3) [m].
    stands: NDArray[np.bool_]  #: Whether a foot stands, shape (S, L).
    force: Array  #: Of the ground on the feet, shape (S, L, 3) [N].
    places: Array  #: Where joints are, shape (S, J, 3) [m].
    torque: Array  #: At the joints, shape (S, J) [N*m].
    mass_centre: Array  #: Shape (S, 3) [m].
    margin: Array  #: Static stability, shape (S,) [m].
    origin: Array  #: Where the frame is in the world, shape (S, 3) [m].
    ground: Array  #: Unit normal of the ground, shape (3,).
