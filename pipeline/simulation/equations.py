"""The equations of motion along a log, and what models leave of them.

What a log does not hold is taken from what it does. The base of a legged robot moves as its
standing feet let it, and turns as columns of its angular velocity or orientation say where two feet
or fewer stand; without orientation the plane of the standing feet is level. Near a change of stance
a foot may carry load or not: its force is projected out, and its velocity not used.

Which share the ground has is not known where its forces were not measured, and hardly known where
legs push against each other: rows of joints and base are taken with those forces eliminated
(`dynamics.residual`), and a prediction's are those that fit the log best (`OnLegs`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Final

import numpy as np
import pinocchio as pin
from scipy.ndimage import convolve1d, uniform_filter1d
from scipy.spatial.transform import Rotation

from actuators.arrays import Array, Index, Mask
from pipeline.dynamics.residual import (
    Carried,
    EquationsOfMotion,
    Feet,
    body_columns,
    by_body,
    carried,
    foot_rows,
    noise_covariance,
    of_other_bodies,
    sole_covariance,
)
from pipeline.logs.log import Log
from pipeline.logs.speeds import changes, within
from pipeline.machine.machine import Bodies, MachineModel, changed_model
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.robot import inverse_dynamics

#: Standard deviation of an orientation that a column tells, an attitude sensor's, ...
TOLD: Final = 3e-3  # [rad]
#: ... and of ground that is taken as level, half a degree.
LEVEL: Final = 1e-2  # [rad]
#: How far a filter carries a jump of the ground's forces, in periods of its cut-off.
REACH: Final = 1.5
#: Least standard deviation of a foot's acceleration: nothing stands stiller [m/s^2].
STILL: Final = 1e-2
#: Where on its sole a foot stands, standard deviation: a ball's radius below its centre [m].
SOLE: Final = 5e-3
#: Standard deviation of a foot's force over the largest one, where the log does not tell it: the
#: class of common force cells.
FORCE_CLASS: Final = 0.01
#: Standard deviation of a torque that was not measured, over the largest one that was.
_UNKNOWN: Final = 1e3


def equations_of(
    model: MachineModel,
    m: Log,
    *,
    load: Array | None = None,
    friction: Array | None = None,
    moved: Moved | None = None,
) -> EquationsOfMotion:
    """Rows of the equations of motion of a robot on legs along a log that holds torque.

    Args:
        model: Machine.
        m: Its log.
        load: What its drivetrains carry at that torque (`Simulator.load`), shape (N, J) [N*m]; the
            torque by default.
        friction: Level of the joints' friction, (J,) or (N, J) [N*m], by which the sign that is not
            known enters a row's variance (`m.unsure`); none by default.
        moved: From `motion_of`, where it is at hand.
    """
    moved = moved or motion_of(model, m)
    rigid, at, q, stance = moved.rigid, moved.joints, moved.motion[0], moved.stance
    assert stance is not None
    unknown = ~(m.mask if m.known is None else m.known)
    torque, variance = np.zeros((2, len(m.q), rigid.nv))
    torque[:, at] = np.where(unknown, 0.0, m.effort[..., 0] if load is None else load)
    largest = max(float(np.abs(torque).max()), 1.0)
    # A joint that no column tells of is held by a torque that none tells.
    variance[:, 6:] = (_UNKNOWN * largest) ** 2
    variance[:, at] = m.noise[:, 0] ** 2
    if friction is not None and m.unsure is not None:
        variance[:, at] += (friction * m.unsure) ** 2
    variance[:, at] += np.where(unknown, (_UNKNOWN * largest) ** 2, 1e-12 * largest**2)
    shaking = np.zeros(rigid.nv)
    if m.rate_noise is not None:
        shaking[at] = m.rate_noise[1]
    shaken = _shaken(stance, shaking, m)
    noise = noise_covariance(rigid, q, variance, shaken, stance.tilt or LEVEL)
    force, deviation = _forces(m, stance)
    if np.isfinite(force).any():
        noise += sole_covariance(rigid, model.robot.chains, at, m.q, np.nan_to_num(force), SOLE)
    feet = Feet(stance.rows, stance.standing | stance.near, force, deviation)
    # Where a log begins or ends, nobody knows what a filter would have seen beyond.
    ends = np.zeros((len(m), 1), np.bool_)
    ends[[k for piece in m.pieces for k in (piece.start, piece.stop - 1)]] = True
    known = stance.carried.determined & ~within(ends, m.pieces, _reach(m))[:, 0]
    return EquationsOfMotion(rigid, moved.motion, torque, noise, feet, at, known)


@dataclass(frozen=True, eq=False)
class Stance:
    """How a machine stands along a log."""

    standing: Mask  #: Shape (N, L).
    near: Mask  #: Within the filter's reach of a change of it, shape (N, L).
    turn: Array  #: Base to level axes but for yaw, shape (N, 3, 3).
    tilt: float  #: Standard deviation of that where a column tells it, else 0 [rad].
    rows: Array  #: Of `foot_rows`, shape (N, L, 3, nv).
    carried: Carried  #: Motion of the base by the feet that stand for sure.

    @cached_property
    def lever(self) -> Array:
        """Of feet that may stand on the generalised forces, shape (N, 3 L, nv)."""
        stands = (self.standing | self.near)[..., None, None]
        return np.where(stands, self.rows, 0.0).reshape(len(stands), -1, self.rows.shape[-1])


@dataclass(frozen=True, eq=False)
class Moved:
    """Motion of all of a machine along a log."""

    rigid: pin.Model  #: With the machine's changes of bodies.
    motion: tuple[Array, Array, Array]  #: Pinocchio's q (N, nq), v and a (N, nv).
    joints: Index  #: Columns of the logged joints among the velocities, shape (J,).
    stance: Stance | None  #: None for a fixed base.


#: What a log tells of its base whatever the joints' positions are: which feet are near a change of
#: stance (N, L), and angular velocity and acceleration in its axes (N, 6), NaN where not known.
Told = tuple[Mask, Array]


def told_of(m: Log, legs: int) -> Told:
    """By its stances, its attitude and the rates of it."""
    standing = np.ones((len(m), legs), np.bool_) if m.standing is None else m.standing
    return within(changes(standing, m.pieces), m.pieces, _reach(m)), _turning(m)


def _reach(m: Log) -> int:
    """Samples that a filter carries a jump."""
    return int(np.ceil(REACH * m.rate / m.bandwidth)) if np.isfinite(m.bandwidth) else 0


def motion_of(model: MachineModel, m: Log, told: Told | None = None) -> Moved:
    """Motion of a machine, that of its base among it, along a log.

    `told`: from `told_of`, where the log is some rows of a longer one.
    """
    rigid, robot = model.rigid, model.robot
    q, v, a = robot.configuration(m.q), robot.tangent(m.v), robot.tangent(m.a)
    at, legs = robot.velocity_index, robot.chains
    if not robot.floating:
        return Moved(rigid, (q, v, a), at, None)
    standing = np.ones((len(m.q), len(legs.names)), dtype=np.bool_)
    standing = standing if m.standing is None else m.standing
    near, turning = told or told_of(m, standing.shape[1])
    stands = standing & ~near
    turn, tilt = _orientation(model, m, stands)
    q[:, 3:7] = Rotation.from_matrix(turn).as_quat()
    rows = foot_rows(rigid, legs, at, m.q)
    base = carried(legs, (m.q, m.v, m.a), rows, at, stands, turning)
    v[:, :6], a[:, :6] = base.velocity, base.acceleration
    return Moved(rigid, (q, v, a), at, Stance(standing, near, turn, tilt, rows, base))


def _orientation(model: MachineModel, m: Log, stands: Mask) -> tuple[Array, float]:
    """Base to level axes but for yaw, shape (N, 3, 3), and how sure a column is; 0 without one."""
    if not m.base_roll is m.base_pitch is None:
        return _turned(m, None), TOLD
    legs = model.robot.chains
    feet = foot_positions(legs, legs.by_leg(m.q))
    weight = stands[..., None].astype(float)
    count = np.maximum(weight.sum(axis=1, keepdims=True), 1.0)
    apart = (feet - (weight * feet).sum(axis=1, keepdims=True) / count) * weight
    _, level, axes = np.linalg.svd(apart)
    # With fewer feet, or in one line, the ground is where it was seen before and after.
    seen = np.flatnonzero(level[:, 1] > 0.1 * np.maximum(level[:, 0], 1e-9))
    if seen.size == 0:
        return np.tile(np.eye(3), (len(m.q), 1, 1)), 0.0
    up = axes[:, 2] * np.where(axes[:, 2, 2:] < 0.0, -1.0, 1.0)
    up = np.stack([np.interp(m.time, m.time[seen], x) for x in up[seen].T], axis=1)
    angles = [-np.arcsin(np.clip(up[:, 0], -1.0, 1.0)), np.arctan2(up[:, 1], up[:, 2])]
    return Rotation.from_euler("YX", np.stack(angles, axis=1)).as_matrix(), 0.0


def _turned(m: Log, yaw: Array | None) -> Array:
    """R_z(yaw) R_y(pitch) R_x(roll) by columns, zero where there is none, shape (N, 3, 3)."""
    none = np.zeros(len(m.q))
    angles = [none if x is None else x for x in (yaw, m.base_pitch, m.base_roll)]
    return Rotation.from_euler("ZYX", np.stack(angles, axis=1)).as_matrix()


def _turning(m: Log) -> Array:
    """Angular velocity and acceleration of the base in its axes, (N, 6), NaN where not known.

    Of a base that is nearly level roll and pitch tell two of three components, whatever its yaw.
    """
    if m.base_rate is not None:
        return np.hstack([m.base_rate, m.derivative(m.base_rate)])
    if m.base_roll is m.base_pitch is None:
        return np.full((len(m.q), 6), np.nan)
    R = _turned(m, m.base_yaw)
    spin = R.swapaxes(1, 2) @ m.derivative(R.reshape(-1, 9)).reshape(R.shape)
    omega = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    if m.base_yaw is None:
        omega[:, 2] = np.nan
    return np.hstack([omega, m.derivative(omega)])


def _shaken(stance: Stance, shaking: Array, m: Log) -> Array:
    """Covariance of the accelerations, shape (N, nv, nv) [m^2/s^4, rad^2/s^4].

    Errors of the joints' accelerations, of standard deviation `shaking` (nv,), reach the base
    through the standing feet; what the feet are left with beyond them is movement of their own
    (soft ground, slip), which comes with changes of load: it follows what they are left with within
    a period of the cut-off about a sample.
    """
    base, stands = stance.carried, stance.standing & ~stance.near
    n, nv = len(stands), shaking.size
    rows = (stance.rows * stands[..., None, None]).reshape(n, -1, nv)
    spread = np.tile(np.diag(shaking), (n, 1, 1))
    spread[:, :6] = -base.share @ (rows @ np.diag(shaking))
    # Of 3 k equations of k feet six are taken by the base.
    free = np.maximum(3.0 * stands.sum(axis=1) - 6.0, 0.0)
    joints = float(((rows @ np.diag(shaking)) ** 2).sum() / (3.0 * max(stands.sum(), 1)))
    square = (base.slip**2).sum(axis=1) * (free > 0.0)
    whole = square.sum() / max(float(free.sum()), 1.0)
    width = 2 * int(np.ceil(m.rate / m.bandwidth)) + 1 if np.isfinite(m.bandwidth) else 3
    slip = np.empty(n)
    for piece in m.pieces:
        left, count = (width * uniform_filter1d(x[piece], width) for x in (square, free))
        # As so few equations tell it, half the way from that of all samples.
        slip[piece] = np.sqrt(whole * (left + whole) / (count + 1.0))
    own = np.maximum(slip - joints, STILL**2)[:, None, None]
    out = spread @ spread.swapaxes(1, 2)
    out[:, :6, :6] += own * base.share @ base.share.swapaxes(1, 2)
    index = np.arange(6)
    out[:, index, index] += STILL**2
    return out


def _forces(m: Log, stance: Stance) -> tuple[Array, float]:
    """Measured forces in the base's axes, (N, F, 3) [N], NaN where unknown, and their deviation."""
    force, R = np.full((*stance.standing.shape, 3), np.nan), stance.turn
    if m.foot_force is None:
        return force, 0.0
    force[:] = m.foot_force
    largest = float(np.nanmax(np.abs(force), initial=0.0))
    deviation = FORCE_CLASS * largest if m.foot_noise is None else m.foot_noise
    # Components along the base's axes need all three, unless the base is level.
    turned = np.einsum("nji,nfj->nfi", R, force)
    level = R[:, 2, 2, None, None] > np.cos(LEVEL)
    force = np.where(np.isnan(turned) & level, force, turned)
    return np.where(stance.near[..., None], np.nan, force), max(deviation, 1e-3 * largest, 1e-6)


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
