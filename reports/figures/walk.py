"""What pictures show of a walk: stretches of a cycle."""

from __future__ import annotations

from dataclasses import dataclass

from actuators.arrays import Array


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
