"""Ground forces that carry the robot with the least sum of squared tangential forces.

The wrench which floating-base inverse dynamics demands of the base (gravity and inertia of all
links) must come from the feet. With at least three feet that are not in one line, the equations of
normal force and tipping moments can be met by the normal forces whatever the tangential ones are,
so that the horizontal force and the yaw moment alone bind the tangential ones, at whatever heights
the feet stand; "the tangential forces at the feet are the minimum ones which guarantee the desired
robot motion" (section II.B of the paper) then has a closed form: every foot takes an equal share of
the horizontal force, plus a share of the yaw moment in proportion to its distance from the centroid
of the stance. Of the normal forces that remain open with more than three feet, those of least
spread about their mean are taken; as their sum is bound, these are the ones of least squares. Two
feet meet all but the moment about their line, by which a trotting body rocks to and fro.

What forces on the feet put into the joints, J^T f, is computed here alone: standing and walking
(`joint_demand`) and prediction along a measured motion (`pipeline.simulation.rigid_bodies`) differ
in where their forces come from, not in what these do.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.dynamics.force_rules import (
    held_by_friction,
    internal_basis,
    least_within_bounds,
    out_of_bounds,
)
from pipeline.motion.motion import level_ground
from pipeline.robot.kinematics import leg_posture
from pipeline.robot.leg_chains import LegChains

_UNLOADED = 1e-9  # share of the largest load below which a foot bears none


@dataclass(frozen=True)
class ContactForces:
    """Forces of the ground on the feet during one segment."""

    legs: tuple[str, ...]  #: All legs, in the robot file's order.
    stance: tuple[str, ...]  #: Those whose feet carry load.
    time: Array  #: Shape (N,) [s].
    position: Array  #: Foot points in the base frame [m], shape (N, L, 3).
    force: Array  #: In the base frame, acting on the robot [N], shape (N, L, 3); zero in the air.
    force_world: Array  #: The same in the world frame [N], shape (N, L, 3).
    #: Unit normal of the ground in the world frame, shape (3,).
    normal: Array = field(default_factory=level_ground)

    @property
    def normal_force(self) -> Array:
        """Along the ground's normal, positive where the ground presses [N], shape (N, L)."""
        return self._in_ground[..., 2]

    @cached_property
    def _in_ground(self) -> Array:
        turn = ground_frame(self.normal)
        return self.force_world if turn is None else self.force_world @ turn.T

    @property
    def friction_needed(self) -> Array:
        """Tangential over normal force per foot [1], shape (N, L).

        NaN where no load rests; infinite where a foot without load would have to hold.
        """
        normal = self.normal_force
        tangential = np.hypot(self._in_ground[..., 0], self._in_ground[..., 1])
        nothing = _UNLOADED * float(np.abs(normal).max())
        loaded = normal > nothing
        needed = np.divide(tangential, normal, out=np.full(normal.shape, np.nan), where=loaded)
        needed[~loaded & (normal >= -nothing) & (tangential > nothing)] = np.inf
        return needed


def ground_frame(normal: Array) -> Array | None:
    """The smallest rotation from the world to a frame whose z axis is a normal; None for none.

    `normal`: upward unit vector in the world frame, shape (3,).
    """
    x, y, z = normal
    if z == 1.0:
        return None
    return np.array(
        [
            [1 - x * x / (1 + z), -x * y / (1 + z), -x],
            [-x * y / (1 + z), 1 - y * y / (1 + z), -y],
            [x, y, z],
        ]
    )


def least_tangential_forces(
    wrench: Array, feet: Array, friction_coefficient: float | None = None
) -> Array:
    """Foot forces that add up to a wrench, with the least sum of squared tangential forces.

    Of what that leaves open the normal forces have the least spread, and no foot pulls. Without a
    friction coefficient no foot braces against another: the tangential forces are those of the
    closed form, and of the feet that bear a load only. With one, every force lies in its (circular)
    cone, and the tangential forces are the least for which that is so.

    `wrench`: force and moment about the origin that the ground must supply, in a frame whose z axis
    is the ground's normal [N, N*m], shape (N, 6). `feet`: foot points in the same frame [m], shape
    (N, F, 3), F >= 2; two meet all of the wrench but the moment about their line.
    `friction_coefficient`: greatest tangential over normal force [1]; None for no limit. Returns
    forces on the robot [N], shape (N, F, 3). Rows that nothing satisfies come back in the closed
    form, with a foot that pulls or slides, and it is for the caller to refuse them. Feet in one
    line give normal forces that are not finite.
    """
    force = _closed_form(wrench, feet)
    if feet.shape[1] > 3:
        for row in np.flatnonzero(force[..., 2].min(axis=1) < 0):
            pushing = _pushing(wrench[row], feet[row])
            if pushing is not None:
                force[row] = pushing
    if friction_coefficient is not None:
        rows = np.flatnonzero(out_of_bounds(force, friction_coefficient))
        for row in rows:
            basis = internal_basis(feet[row : row + 1])[0]
            held = held_by_friction(force[row], basis, friction_coefficient)
            if held is not None:
                force[row] = held
    return force


def _closed_form(wrench: Array, feet: Array) -> Array:
    """The least tangential forces and the normals of least squares, bounds left aside."""
    n_feet = feet.shape[1]
    force = np.empty(feet.shape)
    centre = feet.mean(axis=1)
    from_centre = feet - centre[:, None]
    x, y = from_centre[..., 0], from_centre[..., 1]

    # Tangential: equal shares plus a rotation about the centroid; Lagrange multipliers of
    # min sum |t|^2 subject to sum t = F, sum (p x t)_z = M_z.
    yaw = wrench[:, 5] - (centre[:, 0] * wrench[:, 1] - centre[:, 1] * wrench[:, 0])
    spread = np.einsum("nf,nf->n", x, x) + np.einsum("nf,nf->n", y, y)
    turn = (yaw / spread)[:, None]
    force[..., 0] = wrench[:, 0, None] / n_feet - turn * y
    force[..., 1] = wrench[:, 1, None] / n_feet + turn * x

    # Normal: what vertical force and tipping moments leave after the tangential forces' moments.
    z = feet[..., 2]
    moment_x = wrench[:, 3] + np.einsum("nf,nf->n", z, force[..., 1]) - centre[:, 1] * wrench[:, 2]
    moment_y = wrench[:, 4] - np.einsum("nf,nf->n", z, force[..., 0]) + centre[:, 0] * wrench[:, 2]
    force[..., 2] = _normals(x, y, wrench[:, 2], moment_x, moment_y)
    return force


def _normals(x: Array, y: Array, total: Array, moment_x: Array, moment_y: Array) -> Array:
    # Least squares about the centroid: N_i = total/F + a x_i + b y_i, with
    # sum y N = moment_x and -sum x N = moment_y; exact and unique for three feet.
    if x.shape[1] == 2:  # the moment across their line; nothing meets the one along it
        lean = (y[:, 1] * moment_x - x[:, 1] * moment_y) / (x[:, 1] ** 2 + y[:, 1] ** 2)
        return 0.5 * np.stack([total - lean, total + lean], axis=1)
    xx, yy = np.einsum("nf,nf->n", x, x), np.einsum("nf,nf->n", y, y)
    xy = np.einsum("nf,nf->n", x, y)
    det = xx * yy - xy * xy
    with np.errstate(divide="ignore", invalid="ignore"):  # feet in one line: not finite, refused
        a = (-moment_y * yy - moment_x * xy) / det
        b = (moment_x * xx + moment_y * xy) / det
        return total[:, None] / x.shape[1] + a[:, None] * x + b[:, None] * y


def _pushing(wrench: Array, feet: Array) -> Array | None:
    """Forces of one sample of which no normal force pulls, or None where there are none.

    The tangential forces are kept, which the closed form makes the least whatever the normal ones
    are. A foot that then bears nothing holds nothing either: the others share anew.
    """
    force = np.asarray(_closed_form(wrench[None], feet[None])[0])
    if not np.isfinite(force).all():
        return None
    if force[:, 2].min() >= 0:
        return force
    if len(feet) == 3:
        return None
    levers = np.stack([np.ones(len(feet)), *(feet - feet.mean(axis=0))[:, :2].T], axis=1)
    open_normals = np.linalg.qr(levers, mode="complete").Q[:, 3:]
    basis = np.zeros((*feet.shape, open_normals.shape[1]))
    basis[:, 2] = open_normals
    metric, gradient = np.eye(open_normals.shape[1]), open_normals.T @ force[:, 2]
    within = least_within_bounds(metric, gradient, force, basis, None)
    if within is None:
        return None
    loaded = within[:, 2] > 0
    if within[~loaded, :2].any() and loaded.sum() >= 3:
        shared = _pushing(wrench, feet[loaded])
        if shared is not None:
            within[:] = 0.0
            within[loaded] = shared
    return within


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
