"""How well legs can follow their feet: directions they lack, distance from the path, singularity.

A leg of two joints cannot put its foot where it likes; it puts it as near as it gets
(`pipeline.robot.inverse`). What that costs is reported here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from actuators.arrays import Array
from pipeline.robot.inverse.inverse_kinematics import ACCEPTED
from pipeline.robot.inverse.least_motion import freedoms
from pipeline.robot.kinematics import foot_jacobians
from pipeline.robot.leg_chains import LegChains

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class FootTracking:
    """What one leg does with its foot's path."""

    leg: str  #: Its name.
    joints: int  #: Number of its joints.
    directions: int  #: In how many directions they move the foot.
    #: Unit vectors in the base frame along which they do not, at the first sample.
    cannot_move: tuple[Vector, ...]
    deviation: float  #: Largest distance of the foot from its path [m].
    deviation_time: float  #: When [s]; not a number where the foot follows.
    #: Of the Jacobian, among as many as there are directions [m/rad]: the smaller, the nearer to a
    #: stretched or folded leg.
    least_singular_value: float
    singular_time: float  #: When it is that small [s].


def foot_tracking(
    chains: LegChains, pieces: Sequence[tuple[Array, Array, Array]]
) -> tuple[FootTracking, ...]:
    """Judge a motion leg by leg.

    `pieces`: stretches of the motion: time (N,) [s], joint positions (N, L, K) [rad, m], and where
    the feet should be in the base frame (N, L, 3) [m].
    """
    time = np.concatenate([t for t, _, _ in pieces])
    q = np.concatenate([position for _, position, _ in pieces])
    target = np.concatenate([goal for _, _, goal in pieces])
    feet, jacobian = foot_jacobians(chains, q)
    off = np.linalg.norm(feet - target, axis=-1)
    left, values, _ = np.linalg.svd(jacobian)
    out = []
    for i, (name, own) in enumerate(zip(chains.names, freedoms(chains), strict=True)):
        smallest = values[:, i, own.directions - 1]
        far, near = int(off[:, i].argmax()), int(smallest.argmin())
        lacking: list[Vector] = []
        for direction in left[0, i, :, own.directions :].T:  # its largest component positive
            sign = np.sign(direction[int(np.abs(direction).argmax())])
            x, y, z = (float(round(sign * c, 9)) + 0.0 for c in direction)  # rounding is none
            lacking.append((x, y, z))
        out.append(
            FootTracking(
                leg=name,
                joints=own.joints,
                directions=own.directions,
                cannot_move=tuple(lacking),
                deviation=float(off[far, i]),
                deviation_time=float(time[far]) if off[far, i] > ACCEPTED else float("nan"),
                least_singular_value=float(smallest[near]),
                singular_time=float(time[near]),
            )
        )
    return tuple(out)
