"""What the ground's forces on the feet put into the joints: J^T f, and f where it is computed.

The one place for it: standing and walking (`joint_demand`) and prediction along a measured motion
(`pipeline.simulation.rigid_bodies`) differ in where their forces come from, not in what these do.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.dynamics.contact_forces import least_tangential_forces
from pipeline.robot.kinematics import leg_posture
from pipeline.robot.leg_chains import LegChains


def inverse_dynamics(
    model: pin.Model, motion: tuple[Array, Array, Array], pool: pin.ModelPool, threads: int = 1
) -> Array:
    """Generalised forces without contact, by Pinocchio's RNEA over the batch.

    `model`: its armature is zero, reflected rotor inertia being the actuator chain's. `motion`:
    configuration (N, nq), velocity (N, nv) and acceleration (N, nv). `threads`: for Pinocchio's
    thread pool; the result is the same with any number. Returns generalised forces, shape (N, nv)
    [N, N*m].
    """
    q, v, a = (x.T for x in motion)
    # Pinocchio drops the sample axis of a single sample.
    forces = np.asarray(pin.rneaInParallel(threads, pool, q, v, a))
    return forces.T.reshape(-1, model.nv)


class FeetOnGround:
    """Legs at N samples and their feet on a plane.

    Forces are in the ground's frame: origin in the base's, z axis along the ground's normal.

    `q`: joint positions by leg [rad, m], shape (N, L, K). `turn`: from the base's axes to the
    ground's, shape (N, 3, 3); None where they are the same.
    """

    def __init__(self, chains: LegChains, q: Array, turn: Array | None) -> None:
        self._posture, self._turn = leg_posture(chains, q), turn

    @property
    def in_base(self) -> Array:
        """Foot points in the base frame [m], shape (N, L, 3)."""
        return self._posture.feet

    @property
    def points(self) -> Array:
        """Foot points in the ground's frame [m], shape (N, L, 3)."""
        return self._to_ground(self.in_base)

    def least_tangential(
        self,
        wrench: Array,
        standing: NDArray[np.bool_],
        friction_coefficient: float | None = None,
        least: int = 3,
    ) -> Array:
        """Forces that supply a wrench, with the least tangential parts.

        `wrench`: force and moment demanded of the base, in its frame [N, N*m], shape (N, 6).
        `standing`: which feet do, shape (N, L). `friction_coefficient`: greatest tangential over
        normal force [1]; None for no limit. `least`: feet that stand; samples with fewer have no
        forces. Returns shape (N, L, 3) [N]; zero in the air. See `least_tangential_forces` for
        samples at which nothing supplies the wrench.
        """
        feet = self.points
        turned = self._to_ground(wrench.reshape(-1, 2, 3)).reshape(-1, 6)
        force = np.zeros(feet.shape)
        codes = standing @ (1 << np.arange(feet.shape[1]))
        for code in np.unique(codes):
            rows = np.flatnonzero(codes == code)
            stance = np.flatnonzero(standing[rows[0]])
            if stance.size >= least:
                own = np.ix_(rows, stance)
                force[own] = least_tangential_forces(turned[rows], feet[own], friction_coefficient)
        return force

    def to_base(self, vectors: Array) -> Array:
        """From the ground's axes to the base's, shape (N, L, 3)."""
        if self._turn is None:
            return vectors
        return np.einsum("nji,nfj->nfi", self._turn, vectors)

    def torque(self, force: Array) -> Array:
        """What forces put into the legs' joints, shape (N, L, K) [N*m, N where one slides].

        `force`: on every foot [N], shape (N, L, 3).
        """
        return self._posture.force_torques(self.to_base(force))

    def unit_torque(self) -> Array:
        """The same of a force of 1 N along each axis of the ground, shape (N, L, K, 3)."""
        units = np.broadcast_to(np.eye(3)[:, None, None], (3, *self.in_base.shape))
        return np.stack([self.torque(unit) for unit in units], axis=-1)

    def _to_ground(self, vectors: Array) -> Array:
        if self._turn is None:
            return vectors
        return np.einsum("nij,nfj->nfi", self._turn, vectors)
