"""What a log's torques leave of the equations of motion, the unknown ground forces eliminated.

    r = S^T tau + J_c^T f - RNEA(q, v, a) = Y delta + friction + noise

S^T tau: measured torque at the joints and nothing at the six rows of a floating base, which are
data: the sum of the feet's forces is the weight. f: measured component by component with a variance
each, infinite where it was not measured. With R the covariance of the noise of r, the weight of a
sample is the inverse of R + J_c^T Sigma_f J_c; an unmeasured component counts in the limit, in
which it is projected out.

No rule for the ground's forces is assumed: legs that are position-controlled push against each
other. Sources: Mistry, Buchli, Schaal, ICRA 2010 (null space of the contact Jacobian); Ayusawa,
Venture, Nakamura, IJRR 2014 (base rows identify the bodies).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin

from actuators.arrays import Array, Index, Mask
from pipeline.robot.kinematics import LegChains, leg_posture
from pipeline.robot.robot import inverse_dynamics

#: Share of the largest below which a direction of the standing feet holds nothing.
_HELD = 1e-6
#: Weight of a known turning beside a foot that stands, whose lever is a good part of a metre.
_TOLD = 0.03


@dataclass(frozen=True, eq=False)
class Feet:
    """Standing feet at N samples, in the axes of the base."""

    jacobian: Array  #: Of the foot points, base first, shape (N, L, 3, nv) [m, 1].
    standing: Mask  #: Which feet carry load, shape (N, L).
    #: Of the ground on the robot [N], shape (N, L, 3); NaN where it was not measured.
    force: Array
    deviation: float = 0.0  #: Standard deviation of a measured component [N].

    @cached_property
    def rows(self) -> Array:
        """Jacobian of what stands, shape (N, 3 L, nv); zero rows for feet in the air."""
        J = np.where(self.standing[..., None, None], self.jacobian, 0.0)
        return J.reshape(len(J), -1, J.shape[-1])

    @cached_property
    def known(self) -> Array:
        """Measured forces, zero where nothing was measured, shape (N, 3 L) [N]."""
        force = np.where(self.standing[..., None], np.nan_to_num(self.force), 0.0)
        return force.reshape(len(force), -1)

    @cached_property
    def precision(self) -> Array:
        """Inverse variances, zero where nothing was measured, shape (N, 3 L) [1/N^2]."""
        exact = np.isfinite(self.force).reshape(len(self.force), -1)
        return np.where(exact, 1.0 / max(self.deviation, 1e-9) ** 2, 0.0)


@dataclass(frozen=True, eq=False)
class EquationsOfMotion:
    """A log's rows of the equations of motion: residual and weight.

    A motion's configuration (N, nq), velocity and acceleration (N, nv) are Pinocchio's, those of a
    floating base among them (`carried`).
    """

    model: pin.Model  #: Without armature.
    motion: tuple[Array, Array, Array]
    torque: Array  #: Measured; zero at the rows of a base, shape (N, nv) [N*m].
    noise: Array  #: Covariance R of the noise of r, shape (N, nv, nv); see `noise_covariance`.
    feet: Feet
    joints: Index  #: Rows of the logged joints among the velocities, shape (J,).
    known: Mask  #: Samples at which all of the motion is known, shape (N,).

    @cached_property
    def rigid(self) -> Array:
        """Generalised forces of the bodies, shape (N, nv) [N, N*m]."""
        return inverse_dynamics(self.model, self.motion)

    @cached_property
    def residual(self) -> Array:
        """What the model leaves beside the measured forces, shape (N, nv) [N, N*m]."""
        pushed = np.einsum("nfi,nf->ni", self.feet.rows, self.feet.known)
        return np.asarray(self.torque - self.rigid + pushed)

    @cached_property
    def whitening(self) -> Array:
        """W with W^T W the weight of a sample, shape (N, nv, nv)."""
        # R^-1 = L^T L; with L J^T = U s Q^T in units of the forces' own precision, the directions U
        # keep what the forces' knowledge leaves of them.
        L = np.linalg.inv(np.linalg.cholesky(self.noise))
        seen = self.feet.precision > 0
        B = np.einsum("nij,nfj->nif", L, self.feet.rows)  # (N, nv, 3 L)
        free = np.where(seen[:, None], 0.0, B)
        U, s, _ = np.linalg.svd(free, full_matrices=False)
        U = U * (s > _HELD * np.maximum(s.max(axis=1, keepdims=True), 1e-300))[:, None]
        # Measured components widen what the free ones leave.
        own = np.where(seen[:, None], B, 0.0)
        own = own - np.einsum("nik,njk,njf->nif", U, U, own, optimize=True)
        spread = own / np.sqrt(np.where(seen, self.feet.precision, 1.0))[:, None]
        V, t, _ = np.linalg.svd(spread, full_matrices=False)
        shrunk = V * (1.0 - 1.0 / np.sqrt(1.0 + t**2))[:, None]
        return np.asarray(L - (U @ U.swapaxes(1, 2) + shrunk @ V.swapaxes(1, 2)) @ L)

    def whitened(self, columns: Array) -> Array:
        """Columns (N, nv) or (N, nv, K) of r in standard deviations, what is unknown taken out."""
        if columns.ndim == 2:
            return np.asarray((self.whitening @ columns[..., None])[..., 0])
        return np.asarray(self.whitening @ columns)

    def at(self, rows: slice | Index) -> EquationsOfMotion:
        """Some of its samples."""
        own = (self.feet.jacobian[rows], self.feet.standing[rows], self.feet.force[rows])
        feet, (q, v, a) = Feet(*own, self.feet.deviation), (x[rows] for x in self.motion)
        torque, noise, known = self.torque[rows], self.noise[rows], self.known[rows]
        return replace(self, motion=(q, v, a), torque=torque, noise=noise, feet=feet, known=known)


def body_columns(model: pin.Model, motion: tuple[Array, Array, Array]) -> Array:
    """Ten inertial parameters of every body in Pinocchio's order, shape (N, nv, 10 B).

    What one unit of each adds to the generalised forces along a motion, Pinocchio's q, v and a.
    """
    data, out = model.createData(), []
    for q, v, a in zip(*motion, strict=True):
        out.append(pin.computeJointTorqueRegressor(model, data, q, v, a).copy())
    return np.reshape(out, (len(out), model.nv, 10 * (model.njoints - 1)))


def by_body(columns: Array) -> Array:
    """Columns of all bodies (N, n, 10 B) by body, shape (B, N, n, 10)."""
    split = columns.reshape(*columns.shape[:2], -1, 10)
    return np.ascontiguousarray(np.moveaxis(split, 2, 0))


def of_other_bodies(regressor: Array, new: pin.Model, old: pin.Model) -> Array:
    """What one model's bodies ask for beyond another's, (N, n), by columns of each body.

    Inverse dynamics is linear in the inertial parameters: one regressor serves all bodies.
    """
    out = np.zeros(regressor.shape[1:3])
    for k, own in enumerate(regressor, start=1):
        ten, before = (one.inertias[k].toDynamicParameters() for one in (new, old))
        if (ten != before).any():
            out += own @ (ten - before)
    return out


def foot_rows(model: pin.Model, legs: LegChains, joints: Index, q: Array) -> Array:
    """Jacobians of the feet in the axes of a floating base, shape (N, L, 3, nv).

    Args:
        model: With a free-flyer at its root.
        legs: Geometry, and its joints among the columns of `q`.
        joints: Their columns among the model's velocities, shape (J,).
        q: Joint positions, shape (N, J) [rad, m].
    """
    posture = leg_posture(legs, legs.by_leg(q))
    J = _beside_base(model, legs, joints, posture.columns)
    J[..., :3] = np.eye(3)
    x, y, z = np.moveaxis(posture.feet, -1, 0)
    J[..., 0, 4], J[..., 0, 5] = z, -y
    J[..., 1, 3], J[..., 1, 5] = -z, x
    J[..., 2, 3], J[..., 2, 4] = y, -x
    return J


def _beside_base(model: pin.Model, legs: LegChains, joints: Index, columns: Array) -> Array:
    """Columns of the legs' joints (N, L, K, 3) among all velocities, (N, L, 3, nv)."""
    J = np.zeros((*columns.shape[:2], 3, model.nv))
    for leg in range(columns.shape[1]):
        at = joints[legs.of(leg)]
        J[:, leg, :, at] = columns[:, leg, : at.size].swapaxes(0, 1)
    return J


def sole_covariance(
    model: pin.Model, legs: LegChains, joints: Index, q: Array, force: Array, offset: float
) -> Array:
    """Covariance of r by not knowing where on its sole a foot stands, shape (N, nv, nv).

    A force f that acts at a point r off the foot's adds the moment r x f, whose covariance for r of
    standard deviation s in every direction is s^2 (|f|^2 1 - f f^T).

    Args:
        model: With a free-flyer at its root.
        legs: Geometry, and its joints among the columns of `q`.
        joints: Their columns among the model's velocities, shape (J,).
        q: Joint positions, shape (N, J) [rad, m].
        force: Of the feet in the base's axes, zero where not known, shape (N, L, 3) [N].
        offset: Standard deviation s [m].
    """
    J = _beside_base(model, legs, joints, leg_posture(legs, legs.by_leg(q)).axes)
    J[..., 3:6] = np.eye(3)
    moment = (force**2).sum(axis=-1)[..., None, None] * np.eye(3)
    moment = offset**2 * (moment - force[..., None] * force[..., None, :])
    return np.asarray(np.einsum("nlia,nlij,nljb->nab", J, moment, J, optimize=True))


@dataclass(frozen=True, eq=False)
class Carried:
    """Motion of a base that its standing feet carry."""

    velocity: Array  #: In the base's own axes as Pinocchio's, shape (N, 6) [m/s, rad/s].
    acceleration: Array  #: Likewise, shape (N, 6) [m/s^2, rad/s^2].
    determined: Mask  #: Where feet and turning tell all of it, shape (N,).
    #: Acceleration of the base by one of the standing feet in its place, shape (N, 6, 3 L).
    share: Array
    #: Acceleration that the feet are left with, zero of those in the air, shape (N, 3 L) [m/s^2].
    slip: Array


def carried(
    legs: LegChains,
    motion: tuple[Array, Array, Array],
    rows: Array,
    joints: Index,
    standing: Mask,
    turning: Array | None = None,
) -> Carried:
    """Motion of a base of which no foot that stands moves.

    Least squares over the rows of the standing feet. Two feet leave the turning about their line
    open, one foot all turning: there the angular velocity has to be known, and a sample whose
    motion is not determined counts as unknown. Where the feet tell, it has next to no say.

    Args:
        legs: Geometry, and its joints among the columns.
        motion: Position, velocity, acceleration of the joints, each (N, J).
        rows: Of `foot_rows`, shape (N, L, 3, nv), base first.
        joints: Their columns among the model's velocities, shape (J,).
        standing: Shape (N, L).
        turning: Angular velocity and acceleration of the base in its axes, shape (N, 6), NaN where
            not known, or None.
    """
    q, v, a = motion
    feet = np.stack([rows[..., 1, 5], rows[..., 2, 3], rows[..., 0, 4]], axis=2)
    speed, rate = (np.einsum("nlij,nj->nli", rows[..., joints], x) for x in (v, a))
    rate += leg_posture(legs, legs.by_leg(q)).drift(legs.by_leg(v))
    weight = standing.astype(float)[..., None]
    n = len(feet)
    A = (rows[..., :6] * weight[..., None]).reshape(n, -1, 6)
    turned = np.full((n, 6), np.nan) if turning is None else turning
    told = np.zeros((n, 3, 6))
    told[:, range(3), range(3, 6)] = _TOLD * np.isfinite(turned[:, :3])
    every = np.concatenate([A, told], axis=1)
    # By the 6 x 6 sums: a hundredth of the time of a decomposition of all rows.
    size, axes = np.linalg.eigh(every.swapaxes(1, 2) @ every)
    held = size > _HELD**2 * size[:, -1:]
    inverse = (axes * np.where(held, 1.0 / np.where(held, size, 1.0), 0.0)[:, None]) @ (
        axes.swapaxes(1, 2) @ every.swapaxes(1, 2)
    )

    def solved(right: Array, turned: Array) -> Array:
        known = np.concatenate([right.reshape(n, -1), _TOLD * np.nan_to_num(turned)], axis=1)
        return np.asarray((inverse @ known[..., None])[..., 0])

    velocity = solved(-speed * weight, turned[:, :3])
    linear, omega = velocity[:, None, :3], velocity[:, None, 3:]
    drift = np.cross(omega, linear + np.cross(omega, feet) + 2.0 * speed)
    asked = -(rate + drift) * weight
    acceleration = solved(asked, turned[:, 3:])
    return Carried(
        velocity,
        acceleration,
        np.asarray(size[:, 0] > (0.1 * _TOLD) ** 2 * size[:, -1]),
        inverse[..., : A.shape[1]],
        np.asarray(asked.reshape(n, -1) - (A @ acceleration[..., None])[..., 0]),
    )


def noise_covariance(
    model: pin.Model, q: Array, torque: Array, acceleration: Array, tilt: float = 0.0
) -> Array:
    """Covariance of r by what is uncertain in it, shape (N, nv, nv).

    Args:
        model: Pinocchio's.
        q: Configuration, shape (N, nq).
        torque: Variance of the measured torque, zero at a base, shape (nv,) or (N, nv) [N^2*m^2].
        acceleration: Covariance of the accelerations, (N, nv, nv) [m^2/s^4, rad^2/s^4]; more than
            zero at a base.
        tilt: Standard deviation of the base's orientation about either level axis [rad].
    """
    data, M = model.createData(), np.empty((len(q), model.nv, model.nv))
    for k, row in enumerate(q):
        M[k] = pin.crba(model, data, row)
    M = np.triu(M) + np.triu(M, 1).swapaxes(1, 2)
    out = M @ acceleration @ M
    if tilt:
        # Turning the base turns gravity: a horizontal acceleration of the whole.
        out += (tilt * 9.81) ** 2 * M[:, :, :2] @ M[:, :2]
    index = np.arange(model.nv)
    out[:, index, index] += torque
    return out
