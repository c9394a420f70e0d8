"""Rules by which the ground's forces are chosen among those that carry the robot.

The paper's rule is the least sum of squared tangential forces (`contact_forces`). The other starts
from its forces and adds internal forces to them, which change joint torques and leave the robot's
motion as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import closest
from pipeline.dynamics.internal_forces import internal_basis, least_within_bounds, out_of_bounds
from pipeline.errors import GaitError

LEAST_TANGENTIAL, LEAST_TORQUE = "least_tangential", "least_torque"
RULES = (LEAST_TANGENTIAL, LEAST_TORQUE)
#: Weight of the distance from the least tangential forces beside the torques: it decides between
#: forces that take the same.
_TIE = 1e-9


@dataclass(frozen=True)
class GroundForces:
    """How the ground's forces are chosen.

    Raises:
        GaitError: No such rule, or a friction coefficient that no ground has.
    """

    rule: str = LEAST_TANGENTIAL  #: One of `RULES`.
    #: Greatest tangential over normal force [1]; None for no limit.
    friction_coefficient: float | None = None

    def __post_init__(self) -> None:
        if self.rule not in RULES:
            raise GaitError(f"--forces {self.rule}: no such rule; {closest(self.rule, RULES)}")
        mu = self.friction_coefficient
        if mu is not None and not (0 < mu < np.inf):
            raise GaitError(f"friction coefficient {mu:g}: expected a finite number above 0")


PAPER = GroundForces()


def least_torque_forces(
    start: Array,
    feet: Array,
    torque: Array,
    unit_torque: Array,
    foot: NDArray[np.intp],
    friction_coefficient: float | None = None,
) -> Array:
    """Forces on K feet for the least sum of squared torques of the Q joints that they load.

    All are in a frame whose z axis is the ground's normal.

    Args:
        start: Forces that carry the robot, which those found are nearest to where torques are the
            same [N], shape (N, K, 3). Samples that break a bound keep theirs.
        feet: Points [m], shape (N, K, 3).
        torque: What the joints must apply without the ground [N*m], shape (N, Q).
        unit_torque: What a force of 1 N on its foot along each axis puts into a joint, shape (N,
            Q, 3) [N*m/N].
        foot: Which of the K feet loads each joint, shape (Q,).
        friction_coefficient: Greatest tangential over normal force [1]; None for no limit.

    Returns:
        Forces within the bounds [N], shape (N, K, 3).
    """
    force = np.array(start)
    rows = np.flatnonzero(~out_of_bounds(start, friction_coefficient))
    start, basis = start[rows], internal_basis(feet)[rows]
    needed = torque[rows] - np.einsum("nqi,nqi->nq", unit_torque[rows], start[:, foot])
    effect = -np.einsum("nqi,nqid->nqd", unit_torque[rows], basis[:, foot])
    metric = effect.transpose(0, 2, 1) @ effect
    mean = np.trace(metric, axis1=1, axis2=2) / metric.shape[-1]
    tie = _TIE * np.maximum(mean, np.finfo(float).tiny)
    metric += tie[:, None, None] * np.eye(metric.shape[-1])
    gradient = np.einsum("nqd,nq->nd", effect, needed)
    z = -np.linalg.solve(metric, gradient[..., None])[..., 0]
    found = start + np.einsum("nkid,nd->nki", basis, z)
    for i in np.flatnonzero(out_of_bounds(found, friction_coefficient)):
        bounded = least_within_bounds(
            metric[i], gradient[i], start[i], basis[i], friction_coefficient
        )
        found[i] = start[i] if bounded is None else bounded
    force[rows] = found
    return force
