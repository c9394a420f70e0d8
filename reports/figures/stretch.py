"""What figures show of a walk."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array


@dataclass(frozen=True)
class Stretch:
    """Part of a gait during which the same feet stand, both ends included.

    N samples, L legs, J joints. A figure reads no more of it than it shows.

    Attributes:
        time: Shape (N,) [s].
        stance: Legs that stand.
        velocity: Of every joint, shape (N, J) [rad/s]; of sliding ones [m/s].
        torque: Of every joint, shape (N, J) [N*m]; of sliding ones their force [N].
        feet: In the base frame, shape (N, L, 3) [m].
        normal: Force of the ground across it, by leg, shape (N, L) [N].
        friction: Tangential over normal force, NaN where none rests, shape (N, L).
        mass_centre: In the base frame, shape (N, 3) [m].
        margin: Distance of the centre of mass from the nearest edge of the support polygon, seen
            from above, shape (N,) [m].
    """

    time: Array
    stance: tuple[str, ...]
    velocity: Array
    torque: Array
    feet: Array
    normal: Array
    friction: Array
    mass_centre: Array
    margin: Array

    def every(self, rows: NDArray[np.intp]) -> Stretch:
        """The same at some of its samples, given by their numbers."""
        arrays = {name: value[rows] for name, value in vars(self).items() if name != "stance"}
        return Stretch(stance=self.stance, **arrays)
