"""The equations of motion along a log, of a fixed base and of one that its feet carry.

What a log does not hold is taken from what it does. The base of a legged robot moves as its
standing feet let it, and turns as columns of its angular velocity or orientation say where two feet
or fewer stand; without orientation the plane of the standing feet is level. Near a change of stance
a foot may carry load or not: its force is projected out, and its velocity not used.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
import pinocchio as pin
from scipy.ndimage import uniform_filter1d
from scipy.spatial.transform import Rotation

from actuators.arrays import Array, Index, Mask
from pipeline.dynamics.contact_forces import FeetOnGround
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
from pipeline.logs.reduce import changes
from pipeline.logs.speeds import within
from pipeline.machine.machine import MachineModel
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
#: Position, velocity, acceleration.
Course = tuple[Array, Array, Array]
#: Bytes of a regressor beyond which bodies go through inverse dynamics one by one.
_REGRESSOR: Final = 4e8


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
    known = stance.carried.determined
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
    reach = int(np.ceil(REACH * m.rate / m.bandwidth)) if np.isfinite(m.bandwidth) else 0
    return within(changes(standing, m.pieces), m.pieces, reach), _turning(m)


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


class RigidBodies:
    """Torque at the joints that bodies, gravity and ground ask for along one measured motion.

    The ground's forces are those that were measured, else those with the least tangential parts
    (`pipeline.dynamics.contact_forces`). What depends on the motion and the measured forces alone
    is computed once.
    """

    def __init__(self, measurement: Log) -> None:
        self.measurement = measurement
        self._moved: Moved | None = None
        self._measured: tuple[Array, Array] | None = None
        self._asked: tuple[Course, tuple[float, float]] | None = None
        #: Motion, model, its torque (N, nv), and the regressor by body (B, N, nv, 10).
        self._linear: tuple[Course, MachineModel, Array, Array] | None = None

    def torque(self, machine: MachineModel, motion: tuple[Array, Array, Array]) -> Array:
        """Joint torques, shape (N, J) [N*m].

        `motion`: position, velocity and acceleration of the joints, each (N, J).
        """
        robot = machine.robot
        q, v, a = robot.configuration(motion[0]), *map(robot.tangent, motion[1:])
        if robot.floating:
            if self._moved is None:  # the measured motion, whatever an effect makes of it
                self._moved = motion_of(machine, self.measurement)
            base = self._moved.motion
            q[:, :7], v[:, :6], a[:, :6] = base[0][:, :7], base[1][:, :6], base[2][:, :6]
        if self._moved is None:
            return np.asarray(self._of_bodies(machine, (q, v, a))[:, robot.velocity_index])
        generalised = inverse_dynamics(machine.rigid, (q, v, a))
        of_ground = self._of_ground(machine, motion[0], generalised[:, :6])
        return generalised[:, robot.velocity_index] - of_ground

    def _of_bodies(self, machine: MachineModel, motion: Course) -> Array:
        """Inverse dynamics on a fixed base, (N, nv).

        From the third time on that a motion is asked for one regressor serves all bodies.
        """
        rigid, tilt, asked = machine.rigid, machine.bodies.tilt, self._asked
        if self._linear is not None:
            of, old, out, regressor = self._linear
            same = old.robot is machine.robot and old.bodies.tilt == tilt
            if same and all(map(np.array_equal, of, motion)):
                return out + of_other_bodies(regressor, rigid, old.rigid)
        out, self._asked = inverse_dynamics(rigid, motion), (motion, tilt)
        again = (
            asked is not None and asked[1] == tilt and all(map(np.array_equal, asked[0], motion))
        )
        if again and 10 * out.nbytes * (rigid.njoints - 1) < _REGRESSOR:
            self._linear = motion, machine, out, by_body(body_columns(rigid, motion))
        return out

    def _of_ground(self, machine: MachineModel, q: Array, wrench: Array) -> Array:
        """What the ground's forces put into the joints, shape (N, J) [N*m]."""
        m = self.measurement
        # Measured forces ask for nothing of the bodies.
        measured = m.foot_force is not None and not np.isnan(m.foot_force[0]).any()
        if measured and self._measured is not None and self._measured[0] is q:
            return self._measured[1]
        assert self._moved is not None
        assert self._moved.stance is not None
        stance = self._moved.stance
        legs = machine.robot.chains
        feet = FeetOnGround(legs, legs.by_leg(q), stance.turn)
        force = np.full((*stance.standing.shape, 3), np.nan)
        if m.foot_force is not None:
            force[:] = m.foot_force
        if np.isnan(force).any():
            least = feet.least_tangential(wrench, stance.standing)
            force = np.where(np.isnan(force), least, force)
        out = legs.by_joint(feet.torque(force))
        if measured:
            self._measured = (q, out)
        return out
