"""A robot on legs along a log of its torques: what models leave of its equations of motion.

Which share the ground has is not known where its forces were not measured, and hardly known where
legs push against each other: rows of joints and base are taken with those forces eliminated
(`dynamics.residual`), and a prediction's are those that fit the log best.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Final

import numpy as np
from scipy.ndimage import convolve1d

from actuators.arrays import Array, Index
from pipeline.dynamics.residual import (
    EquationsOfMotion,
    body_columns,
    by_body,
    of_other_bodies,
    sole_covariance,
)
from pipeline.logs.log import Log
from pipeline.machine.machine import Bodies, MachineModel, changed_model
from pipeline.robot.robot import inverse_dynamics
from pipeline.simulation.equations import SOLE, Moved, equations_of, motion_of, told_of

#: Rows from which the level of friction is taken that a sign which is not known stands for.
_FEW: Final = 1500


def is_on_legs(model: MachineModel, m: Log) -> bool:
    """Whether a log holds the equations of motion of a robot on legs."""
    return model.robot.floating and m.channels == ("torque",)


@dataclass(frozen=True, eq=False)
class Left:
    """What a model leaves at N samples."""

    model: MachineModel
    q: Array  #: Joint positions, link side, shape (N, J) [rad].
    load: Array  #: That the drivetrains carry by the log's torques, shape (N, J) [N*m].
    moved: Moved
    rigid: Array  #: Generalised forces of the bodies, shape (N, nv) [N, N*m].

    def pushed(self, force: Array) -> Array:
        """Generalised forces of the ground (N, 3 L) [N], shape (N, nv) [N, N*m]."""
        assert self.moved.stance is not None
        return np.asarray(np.einsum("nfi,nf->ni", self.moved.stance.lever, force))

    def under(self, force: Array) -> Array:
        """Residual under forces of the ground (N, 3 L) [N], shape (N, nv) [N, N*m]."""
        r = self.pushed(force) - self.rigid
        r[:, self.moved.joints] += self.load
        return np.asarray(r)


class OnLegs:
    """Many models along one log, weighed by the covariances about the first of them."""

    def __init__(self, model: MachineModel, m: Log, load: Array) -> None:
        """Begin; `load`: that the model's drivetrains carry, shape (N, J) [N*m]."""
        self.m, self._told = m, told_of(m, len(model.robot.leg_names))
        self._leg_of = model.robot.chains.leg_of
        self._clear()
        moved = self._motion(model, m.q)
        e = equations_of(model, m, load=load, moved=moved)
        if m.unsure is not None:
            e = equations_of(model, m, load=load, moved=moved, friction=_friction(e, m))
        # Which forces fit a sample best is no matter of where on its sole a foot stands; how sure
        # its rows are is, also where no force was measured: a ball's radius under a whole robot's
        # weight is a base whose centre of mass lies elsewhere.
        self._alone = e
        force = np.where(np.isnan(e.feet.force), self._fitting(e.residual), 0.0)
        sole = sole_covariance(e.model, model.robot.chains, e.joints, m.q, force, SOLE)
        self.about = replace(e, noise=e.noise + sole)

    def _clear(self) -> None:
        self._moved: dict[bytes, Moved] = {}
        self._regressor: tuple[tuple[Array, Array, Array], Array] | None = None

    def part(self, rows: Index) -> OnLegs:
        """Some of its samples."""
        out = OnLegs.__new__(OnLegs)
        out.m, out._leg_of, out.about = self.m.at(rows), self._leg_of, self.about.at(rows)
        out._told = (self._told[0][rows], self._told[1][rows])
        out._alone = self._alone.at(rows)
        out._clear()
        return out

    def left(self, model: MachineModel, load: Array, q: Array, near: Left | None = None) -> Left:
        """What a model leaves, its drivetrains carrying a load, joints at q, each (N, J).

        `near`: what another model leaves, from which equal parts are taken over.
        """
        if (
            near is not None
            and q is near.q
            and model.robot is near.model.robot
            and model.bodies == near.model.bodies
        ):
            return replace(near, model=model, load=load)
        moved = self._motion(model, q)
        rigid = inverse_dynamics(moved.rigid, moved.motion)
        return Left(model, q, load, moved, rigid)

    def forces(self, left: Left) -> Array:
        """The ground's forces that fit a sample best, shape (N, 3 L) [N]."""
        fitting = self._fitting(left.under(self._alone.feet.known))
        return fitting.reshape(len(fitting), -1)

    def _fitting(self, r: Array) -> Array:
        """... to what is left under the measured forces (N, nv), shape (N, L, 3) [N]."""
        taken = self._alone.feet.known + np.einsum("nfi,ni->nf", self._share, r)
        return np.asarray(taken.reshape(len(r), -1, 3))

    def steady(self, force: Array) -> Array:
        """Forces (N, 3 L) by samples one to two periods of the cut-off away, to either side.

        Their noise is none of that which a sample's residual holds: a column that followed the
        force of the sample itself would explain its noise.
        """
        m = self.m
        period = int(np.ceil(m.rate / m.bandwidth)) if np.isfinite(m.bandwidth) else 1
        window = (np.abs(np.arange(-2 * period, 2 * period + 1)) > period).astype(float)
        out = np.empty_like(force)
        for piece in m.pieces:
            own = force[piece]
            count = convolve1d(np.ones((len(own), 1)), window, axis=0, mode="constant")
            total = convolve1d(own, window, axis=0, mode="constant")
            out[piece] = np.where(count > 0.5, total / np.maximum(count, 1.0), own.mean(axis=0))
        return out

    @cached_property
    def _share(self) -> Array:
        # forces(r) is linear in what is left under the measured forces.
        e = self._alone
        Ri = np.linalg.inv(e.noise)
        M = e.feet.rows @ Ri @ e.feet.rows.swapaxes(1, 2)
        M = M + np.eye(M.shape[1]) * e.feet.precision[:, None]
        return np.asarray(-np.linalg.pinv(M, 1e-6, hermitian=True) @ e.feet.rows @ Ri)

    @cached_property
    def sparse(self) -> Array:
        """Whitening in which a leg's rows hold its own joints alone, shape (N, J + 6, J + 6).

        Rows and columns are those of the joints, then of the base. A rotation of the whitened rows
        says the same; this one leaves all that joins the legs in the base's rows, but for what
        legs' errors of acceleration share, which is left out of the joints' rows.
        """
        e = self.about
        order = np.concatenate([np.arange(6), e.joints])
        T = np.asarray(np.linalg.qr(e.whitening[:, :, order], mode="r"))
        joints = e.joints.size
        out = np.zeros((len(T), joints + 6, joints + 6))
        out[:, joints:, joints:], out[:, joints:, :joints] = T[:, :6, :6], T[:, :6, 6:]
        own = self._leg_of[:, None] == self._leg_of
        out[:, :joints, :joints] = np.where(own, T[:, 6 : 6 + joints, 6:], 0.0)
        return out

    @cached_property
    def by_joint(self) -> Array:
        """`sparse` by what acts at a joint or the base, shape (J + 6, N, J + 6)."""
        return np.ascontiguousarray(np.moveaxis(self.sparse, 2, 0))

    def weighed(self, r: Array) -> Array:
        """Generalised forces (N, nv) as `sparse` rows of every joint, then of the base, (N, J + 6).

        The ground's unknown forces are eliminated.
        """
        r = np.hstack([r[:, self.about.joints], r[:, :6]])
        return np.asarray((self.sparse @ r[..., None])[..., 0])

    def of_bodies(self, left: Left, bodies: Bodies) -> Array:
        """What other bodies change of what a model leaves, weighed, (N, J + 6)."""
        if self._regressor is None or self._regressor[0] is not left.moved.motion:
            Y, e = body_columns(left.moved.rigid, left.moved.motion), self.about
            Y = self.sparse @ np.concatenate([Y[:, e.joints], Y[:, :6]], axis=1)
            self._regressor = left.moved.motion, by_body(Y)
        moved = changed_model(left.model.robot.model, bodies)
        return of_other_bodies(self._regressor[1], moved, left.moved.rigid)

    def _motion(self, model: MachineModel, q: Array) -> Moved:
        key = q.tobytes()
        if key not in self._moved:
            if len(self._moved) > 1:  # the first, of the log as it is, stays
                self._moved.popitem()
            self._moved[key] = motion_of(model, replace(self.m, q=q), self._told)
        return replace(self._moved[key], rigid=model.rigid)


def with_known_motion(model: MachineModel, m: Log) -> Log:
    """A log of a robot on legs that is compared wherever torques and the base's motion are known.

    Rest and changes of stance need no mask: what is not known there enters the rows' variance.
    """
    if not is_on_legs(model, m):
        return m
    e = equations_of(model, m)
    known = (m.mask if m.known is None else m.known) & e.known[:, None]
    # The covariances hold the motion's noise.
    noise = np.sqrt(np.maximum(m.noise**2 - _motion_noise(e, m) ** 2, 0.01 * m.noise**2))
    return replace(m, mask=known, noise=noise)


def motion_noise(model: MachineModel, m: Log) -> Array:
    """Standard deviation of the torques by that of the motion, orientation and forces, (J, 1)."""
    return _motion_noise(equations_of(model, m), m)


def _motion_noise(e: EquationsOfMotion, m: Log) -> Array:
    own = np.median(np.diagonal(e.noise, axis1=1, axis2=2)[:, e.joints], axis=0)
    return np.sqrt(np.maximum(own[:, None] - m.noise[:, :1] ** 2, 0.0))


def on_legs(model: MachineModel, m: Log, load: Callable[[], Array]) -> OnLegs:
    """Of a robot on legs whose torques a log holds; `load`: that its drivetrains carry."""
    begun = _begun(m)
    if not begun:
        begun.append(OnLegs(model, m, load()))
    return begun[0]


@lru_cache(maxsize=4)
def _begun(m: Log) -> list[OnLegs]:
    """Covariances are taken once for a log."""
    return []


def _friction(e: EquationsOfMotion, m: Log) -> Array:
    """Level of the joints' dry friction beside viscous one and a load on the base, (J,) [N*m]."""
    rows = np.flatnonzero(e.known)
    rows, joints = rows[:: max(1, rows.size // _FEW)], m.q.shape[1]
    if not rows.size or m.sign is None:
        return np.zeros(joints)
    e = e.at(rows)
    laws: Array = np.zeros((2, rows.size, e.torque.shape[1], joints))
    for law, x in zip(laws, (m.smooth(m.sign), m.v), strict=True):
        law[:, e.joints, np.arange(joints)] = x[rows]
    base = body_columns(e.model, e.motion)[..., :4]  # its mass and first moment
    X = e.whitened(np.concatenate([*laws, base], axis=2))
    sizes = np.linalg.lstsq(X.reshape(-1, X.shape[2]), e.whitened(e.residual).ravel())[0]
    return np.maximum(sizes[:joints], 0.0)
