"""Rules by which the ground's forces are chosen among those that carry the robot.

The paper's rule is the least sum of squared tangential forces (`contact_forces`). Others start from
its forces and add internal forces to them, which change joint torques and leave the robot's motion
as it is. They are given the standing legs' statics and answer with forces; a rule that knows
actuators is made above this room and handed down.

`JointDemand` is what a motion then demands of the actuated joints.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.dynamics.internal_forces import Bounds, internal_basis, out_of_bounds
from pipeline.errors import GaitError
from pipeline.motion.motion import Segment

Rows = NDArray[np.intp] | slice
ALL = slice(None)
LEAST_TANGENTIAL = "least_tangential"
#: Weight of the distance from the least tangential forces beside a rule's own cost: it decides
#: between forces that cost the same.
_TIE = 1e-9


@dataclass(frozen=True)
class Stance:
    """Standing legs over one segment, as a rule sees them: K feet, Q joints that they load."""

    segment: Segment  #: The motion.
    demand: JointDemand  #: Of all joints, without the ground's forces.
    loaded: NDArray[np.intp]  #: Columns of the standing legs' joints among all, shape (Q,).
    foot: NDArray[np.intp]  #: Which of the K feet loads each of them, shape (Q,).
    #: Torque that a force of 1 N on that foot along each axis of the ground's frame puts into the
    #: joint, shape (N, Q, 3) [N*m/N].
    unit_torque: Array
    feet: Array  #: In a frame whose z axis is the ground's normal [m], shape (N, K, 3).
    force: Array  #: The least tangential forces in the same frame [N], shape (N, K, 3).
    #: Greatest tangential over normal force [1]; None for no limit.
    friction_coefficient: float | None

    def loaded_torque(self, force: Array, rows: Rows = ALL) -> Array:
        """What the standing legs' joints must apply, shape (n, Q) [N*m].

        `force`: at some samples, shape (n, K, 3) [N].
        """
        from_ground = np.einsum("nqi,nqi->nq", self.unit_torque[rows], force[:, self.foot])
        return np.asarray(self.demand.torque[rows][:, self.loaded] - from_ground)


class ForceRule(Protocol):
    """Chooses the ground's forces of one segment."""

    @property
    def name(self) -> str:
        """As options and tables call it."""

    def forces(self, stance: Stance) -> Array:
        """Forces on the standing feet in the ground's frame [N], shape (N, K, 3).

        They carry the robot and stay within the bounds wherever `stance.force` does.
        """


@dataclass(frozen=True)
class LeastTorque:
    """The least sum of squared torques of the standing legs' joints."""

    name: str = "least_torque"

    def forces(self, stance: Stance) -> Array:
        """One quadratic problem: exact."""
        descent = Descent(stance)
        force, rows = np.array(stance.force), descent.free
        torque = stance.loaded_torque(force[rows], rows)
        force[rows] = descent.step(rows, force[rows], 2.0 * torque, np.full_like(torque, 2.0))
        return force


class Descent:
    """Steps of a cost of joint torques, in internal forces within the feet's bounds."""

    def __init__(self, stance: Stance) -> None:
        self._stance = stance
        self._basis = internal_basis(stance.feet)
        #: Change of joint torques with z, shape (N, Q, D).
        self._effect = -np.einsum("nqi,nqid->nqd", stance.unit_torque, self._basis[:, stance.foot])
        self._bounds: dict[int, Bounds] = {}  # by sample

    @property
    def free(self) -> NDArray[np.intp]:
        """Samples at which there is a choice; where the start breaks a bound, all forces do."""
        stance = self._stance
        return np.flatnonzero(~out_of_bounds(stance.force, stance.friction_coefficient))

    def step(self, rows: NDArray[np.intp], force: Array, slope: Array, curvature: Array) -> Array:
        """Forces that minimise a quadratic model of the cost.

        `rows`: samples, shape (n,). `force`: at which the model was made, within bounds [N], shape
        (n, K, 3). `slope`: derivative of the cost with each joint's torque, shape (n, Q). Returns
        forces within bounds [N], shape (n, K, 3).
        """
        d = self._basis.shape[-1]
        effect, basis = self._effect[rows], self._basis[rows]
        metric = effect.transpose(0, 2, 1) @ (effect * curvature[..., None])
        tie = _TIE * np.maximum(np.trace(metric, axis1=1, axis2=2) / d, np.finfo(float).tiny)
        metric += tie[:, None, None] * np.eye(d)
        away = np.einsum("nki,nkid->nd", force - self._stance.force[rows], basis)
        gradient = np.einsum("nqd,nq->nd", effect, slope) + tie[:, None] * away
        z = -np.linalg.solve(metric, gradient[..., None])[..., 0]
        found = force + np.einsum("nkid,nd->nki", basis, z)
        limit = self._stance.friction_coefficient
        for i in np.flatnonzero(out_of_bounds(found, limit)):
            bounds = self._bounds.setdefault(int(rows[i]), Bounds(basis[i], limit))
            bounded = bounds.minimum(metric[i], gradient[i], force[i])
            found[i] = force[i] if bounded is None else bounded
        return found


@dataclass(frozen=True)
class GroundForces:
    """How the ground's forces are chosen.

    Raises:
        GaitError: A friction coefficient that no ground has.
    """

    #: None for the paper's, the least sum of squared tangential forces.
    rule: ForceRule | None = None
    #: Greatest tangential over normal force [1]; None for no limit.
    friction_coefficient: float | None = None

    def __post_init__(self) -> None:
        mu = self.friction_coefficient
        if mu is not None and not (0 < mu < np.inf):
            raise GaitError(f"friction coefficient {mu:g}: expected a finite number above 0")

    @property
    def name(self) -> str:
        """The rule's."""
        return LEAST_TANGENTIAL if self.rule is None else self.rule.name


PAPER = GroundForces()


@dataclass(frozen=True)
class JointDemand:
    """Motion and torque of the actuated joints over one segment."""

    joints: tuple[str, ...]  #: Names, in the robot file's order; they label the columns.
    time: Array  #: Shape (N,) [s].
    position: Array  #: Shape (N, J) [rad].
    velocity: Array  #: Shape (N, J) [rad/s].
    acceleration: Array  #: Shape (N, J) [rad/s^2].
    torque: Array  #: What the actuator must apply to the joint, shape (N, J) [N*m].
    segment: str  #: The segment's name.
