"""Joint positions, velocities and accelerations from a prescribed foot path.

A leg with joints to spare takes, of all postures that put its foot on the target, the one that
moves least from its nominal stance. A leg that lacks a direction puts its foot as near to the
target as it gets. Both are stationary points of

    w/2 (q - q0)^T W (q - q0) + 1/(2 s) |x(q) - t|^2,

with W one per joint (a sliding joint's metre counted by the leg's reach), w = 1 and s -> 0 for the
first, w = 0 and s = 1 for the second, and both for a leg that has joints to spare and lacks a
direction none the less, as three parallel axes do. With l = (t - x)/s this is

    w W (q - q0) - J^T l = 0,    x(q) + s l - t = 0,

to which damped Gauss-Newton comes near and Newton's iteration leads; velocities and accelerations
follow from its first and second derivative in time, so that they are exactly those of the
positions. The second derivative of x by joints j <= k is a_j x column_k with the axis a_j, zero
where j slides, and the Jacobian's column of joint k.

A step of damped Gauss-Newton is ``J^T (J J^T + m^2 1)^-1 e`` with the error e of the foot and a
damping m that falls with it (Nakamura and Hanafusa 1986; Wampler 1986). A path is followed from
coarse to fine: a few samples are solved from the start posture, which names the knee's branch,
those between start from a spline through them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.robot.kinematics import (
    LegChains,
    LegPosture,
    column_rates,
    cross,
    foot_positions,
    leg_posture,
)

ACCEPTED = 1e-9  # [m]
_JUMP = 0.2  # [rad] between two samples that no velocity explains
_PATH = 16  # samples; fewer are too coarse for velocities to predict the next position
_ITERATIONS, _NEWTON = 60, 30  # at most, damped and undamped
_MAX_STEP = 0.35  # [rad] per iteration, keeps the knee on the branch of the start posture
_REACHED, _STILL = 1e-13, 1e-12  # [m], [rad] of a step: what is left is out of reach
_LEAST_DAMPING, _DAMPING = 1e-8, 1e-2  # [m], relaxed as the iteration comes close
_STRIDE = 16  # samples of a path between those that are solved first
#: Share of a leg's reach within which a spline's guess is trusted to lie on the path's branch.
_NEAR = 5e-3
#: Weight of least motion against a miss of the foot, where a leg both lacks a direction and has
#: joints to spare, in squares of its reach: small enough to leave the foot where it gets.
_SLIGHT = 1e-9
#: Of the largest singular value: a direction in which the foot hardly moves, whatever the posture,
#: is one that the leg lacks.
_RANK = 1e-2
#: Condition number of a leg's Jacobian that is none any more.
_SINGULAR = 1e8
#: Determinant of J J^T over the cube of its trace, from which that number is far smaller.
_CLEAR = 1e-12
_POSES = 25


@dataclass(frozen=True)
class Freedom:
    """What a leg's joints can do to its foot."""

    joints: int  #: Number of joints.
    directions: int  #: Directions in which the foot moves, in postures that are not singular.

    @property
    def lacks(self) -> bool:
        """Whether the foot cannot follow every path."""
        return self.directions < 3

    @property
    def square(self) -> bool:
        """Whether nothing is left to choose."""
        return self.joints == self.directions == 3


def spread(count: int, joints: int) -> Array:
    """Points that fill the unit cube evenly, shape (count, joints).

    Kronecker's sequence of the root of x^(joints + 1) = x + 1: points do not stand in rows.
    """
    root = 2.0
    for _ in range(30):
        root = (1 + root) ** (1 / (joints + 1))
    steps = root ** -np.arange(1, joints + 1)
    points: Array = (0.5 + np.arange(1, count + 1)[:, None] * steps) % 1.0
    return points


@lru_cache
def freedoms(chains: LegChains) -> tuple[Freedom, ...]:
    """What each leg can do, from its Jacobian at postures spread over all angles."""
    q = 2 * np.pi * spread(_POSES, chains.real.shape[1]) - np.pi
    columns = leg_posture(chains, np.repeat(q[:, None], len(chains.names), axis=1)).columns
    values = np.linalg.svd(columns, compute_uv=False)
    ranks = (values > _RANK * values[..., :1]).sum(-1).max(axis=0)
    return tuple(Freedom(int(c), int(r)) for c, r in zip(chains.counts, ranks, strict=True))


@lru_cache
def _alike(chains: LegChains) -> tuple[tuple[LegChains, Freedom, list[int]], ...]:
    """Legs of the same freedom, by their indices."""
    legs: dict[Freedom, list[int]] = {}
    for leg, freedom in enumerate(freedoms(chains)):
        legs.setdefault(freedom, []).append(leg)
    return tuple((chains.of(own), freedom, own) for freedom, own in legs.items())


def reach(chains: LegChains, target: Array, start: Array) -> tuple[Array, Array]:
    """Joint positions that bring the feet as close to their targets as their legs get.

    `target`: foot positions in the base frame [m], shape (N, L, 3). `start`: posture that names the
    branch (knee up or down) [rad, m], shape (L, K), or one for every sample (N, L, K). Returns
    joint positions [rad, m], shape (N, L, K), and by how much a foot misses what its leg should
    reach [m], shape (N, L): all of the way to the target where the leg moves its foot in every
    direction, nothing where it lacks one and stands as near as it gets.
    """
    q, miss = np.zeros((*target.shape[:2], chains.real.shape[1])), np.zeros(target.shape[:2])
    for own, freedom, legs in _alike(chains):
        n = freedom.joints
        near, left = _approach(own, target[:, legs], start[..., legs, :n])
        if not freedom.square:
            near, left = _newton(own, freedom, target[:, legs], near)
        q[:, legs, :n] = near
        miss[:, legs] = 0.0 if freedom.lacks else left
    return q, miss


def solve_positions(chains: LegChains, target: Array, start: Array, time: Array) -> Array:
    """Joint positions that bring the feet to their targets.

    `target`: foot positions in the base frame [m], shape (N, L, 3). `start`: posture that names the
    branch (knee up or down) [rad, m], shape (L, K). `time`: for messages [s], shape (N,). Returns
    joint positions [rad, m], shape (N, L, K). A leg that lacks a direction puts its foot as near as
    it gets; `pipeline.robot.postures.foot_tracking` says how near.

    Raises:
        LegwattError: A target is not reached; names leg, instant and how far it is off.
    """
    q, miss = reach(chains, target, start)
    if miss.max() > ACCEPTED:
        sample, leg = np.unravel_index(int(miss.argmax()), miss.shape)
        far, at = float(miss.max()), float(time[sample])
        raise beyond_reach(chains.names[leg], target[sample, leg], far, at)
    return q


def beyond_reach(leg: str, target: Array, miss: float, time: float) -> LegwattError:
    """What to say of a target that no posture reaches.

    `target`: of its foot in the base frame [m], shape (3,). `miss`: what is left [m]. `time`: in
    the motion [s].
    """
    x, y, z = target
    return LegwattError(
        f"leg '{leg}' at t = {time:.4g} s: the foot target "
        f"({x:.3f}, {y:.3f}, {z:.3f}) m in the base frame lies {1e3 * miss:.1f} mm "
        "beyond its reach; shorten the stroke or the lift, or move the neutral foot"
    )


def solve_rates(
    chains: LegChains,
    q: Array,
    foot_velocity: Array,
    foot_acceleration: Array,
    time: Array,
    target: Array | None = None,
) -> tuple[Array, Array]:
    """Joint velocities and accelerations that move the feet as prescribed.

    `q`: joint positions from `solve_positions` [rad, m], shape (N, L, K). `foot_velocity`: in the
    base frame, relative to the base [m/s], shape (N, L, 3). `foot_acceleration`: likewise [m/s^2],
    shape (N, L, 3). `time`: for messages [s], shape (N,). `target`: where the feet should be [m],
    shape (N, L, 3); where they are by default. A leg that lacks a direction needs it: how it turns
    depends on how far it is off. Returns joint velocities [rad/s, m/s] and accelerations [rad/s^2,
    m/s^2], each (N, L, K).

    Raises:
        LegwattError: The leg is stretched (singular) at a sample, or changes its branch.
    """
    velocity, acceleration = np.zeros(q.shape), np.zeros(q.shape)
    for own, freedom, legs in _alike(chains):
        n = freedom.joints
        posture = leg_posture(own, q[:, legs, :n])
        _refuse_singular(own, freedom, posture, time)
        goal = posture.feet if target is None else target[:, legs]
        moved = foot_velocity[:, legs], foot_acceleration[:, legs]
        parts = _rates(own, freedom, q[:, legs, :n], posture, goal, *moved)
        velocity[:, legs, :n], acceleration[:, legs, :n] = parts
    step = np.diff(time)[:, None, None]
    if time.size < _PATH or step.min() <= 0:
        return velocity, acceleration
    # Between samples a joint goes as far as its velocities say, or it changed its branch. What the
    # trapezoid leaves out grows with the step, as the change of velocity does.
    gone = np.diff(q, axis=0)
    jump = np.abs(gone - 0.5 * step * (velocity[1:] + velocity[:-1]))
    jump -= 0.5 * step * np.abs(np.diff(velocity, axis=0))
    if jump.max() > _JUMP:
        sample, leg, joint = np.unravel_index(int(jump.argmax()), jump.shape)
        raise LegwattError(
            f"leg '{chains.names[leg]}', joint {joint + 1}: its position jumps by "
            f"{gone[sample, leg, joint]:.3g} rad at t = {time[sample]:.4g} s, from one branch of "
            "its inverse kinematics to another; keep the foot away from the axis of joint 1 and "
            "the leg from being stretched, or state another start_posture"
        )
    return velocity, acceleration


def _refuse_singular(chains: LegChains, freedom: Freedom, posture: LegPosture, time: Array) -> None:
    gram = posture.columns.swapaxes(-1, -2) @ posture.columns
    if (np.linalg.det(gram) > _CLEAR * gram.trace(axis1=-2, axis2=-1) ** 3).all():
        return
    values = np.linalg.svd(posture.columns, compute_uv=False)
    singular = ~(values[..., 0] < _SINGULAR * values[..., freedom.directions - 1])
    if singular.any():
        leg, sample = np.unravel_index(int(singular.T.argmax()), singular.T.shape)
        raise LegwattError(
            f"leg '{chains.names[leg]}' is stretched or folded to a singular posture at "
            f"t = {time[sample]:.4g} s; shorten the stroke or move the neutral foot"
        )


def _approach(chains: LegChains, target: Array, start: Array) -> tuple[Array, Array]:
    """Postures from damped Gauss-Newton (N, L, K), and what is left to the targets [m], (N, L)."""
    n = len(target)
    q = np.broadcast_to(start, (*target.shape[:2], start.shape[-1])).copy()
    if start.ndim == 2 and n > 4 * _STRIDE:
        from scipy.interpolate import CubicSpline

        knots = np.unique(np.append(np.arange(0, n, _STRIDE), n - 1))
        q[knots] = _gauss_newton(chains, target[knots], q[knots])[0]
        guess = CubicSpline(knots, q[knots])(np.arange(n))
        off = np.linalg.norm(foot_positions(chains, guess) - target, axis=-1)
        q = np.where((off < _NEAR * chains.reach)[..., None], guess, q)
    return _gauss_newton(chains, target, q)


def _gauss_newton(chains: LegChains, target: Array, q: Array) -> tuple[Array, Array]:
    left = np.empty(target.shape[:2])
    busy = np.arange(len(target))  # samples that are not there yet
    for iteration in range(_ITERATIONS + 1):
        legs = leg_posture(chains, q[busy])
        error = target[busy] - legs.feet
        left[busy] = np.linalg.norm(error, axis=-1)
        going = (left[busy] > _REACHED).any(axis=1)
        if iteration == _ITERATIONS or not going.any():
            break
        busy, transposed = busy[going], np.ascontiguousarray(legs.columns[going])
        damping = np.clip(0.1 * left[busy], _LEAST_DAMPING, _DAMPING)[..., None, None]
        normal = transposed.swapaxes(-1, -2) @ transposed + damping**2 * np.eye(3)
        step = (transposed @ np.linalg.solve(normal, error[going][..., None]))[..., 0]
        q[busy] += _shortened(step, step.shape[-1])
        busy = busy[np.abs(step).max(axis=(1, 2)) > _STILL]
    return q, left


def _shortened(step: Array, joints: int) -> Array:
    """A step whose first entries are joints', of which none takes more than `_MAX_STEP`."""
    largest = np.abs(step[..., :joints]).max(axis=-1, keepdims=True)
    return np.asarray(step * np.minimum(1.0, _MAX_STEP / np.maximum(largest, 1e-300)))


def _newton(chains: LegChains, freedom: Freedom, target: Array, q: Array) -> tuple[Array, Array]:
    """From near postures to those of least motion or least miss; what is left to the targets."""
    n, legs = q.shape[-1], leg_posture(chains, q)
    weight, slack = _weight(chains, freedom)
    level = _multipliers(legs, weight * (q - chains.nominal), slack, target)
    for _ in range(_NEWTON):
        motion = weight * (q - chains.nominal) - np.einsum("nljc,nlc->nlj", legs.columns, level)
        matrix = _matrix(legs, level, weight, slack)
        try:
            step = -_solve(matrix, motion, legs.feet + slack * level - target)
        except np.linalg.LinAlgError:  # a singular posture: what is left shows it
            break
        shorter = _shortened(step, n)
        q, level = q + shorter[..., :n], level + shorter[..., n:]
        legs = leg_posture(chains, q)
        if np.abs(step[..., :n]).max() < _STILL:
            break
    return q, np.linalg.norm(target - legs.feet, axis=-1)


def _weight(chains: LegChains, freedom: Freedom) -> tuple[Array, float]:
    """The w W of the legs (L, n), and s."""
    far = chains.reach[:, None] ** 2
    slight = _SLIGHT * far if freedom.lacks else 1.0
    metric = np.where(chains.slides, 1 / far, 1.0)
    return metric * slight * (freedom.joints > freedom.directions), float(freedom.lacks)


def _multipliers(legs: LegPosture, motion: Array, slack: float, target: Array) -> Array:
    """The l of postures that are solutions, or nearly, shape (N, L, 3)."""
    if slack:
        return np.asarray((target - legs.feet) / slack)
    jacobian = legs.columns.swapaxes(-1, -2)
    return _solve(jacobian @ legs.columns, (jacobian @ motion[..., None])[..., 0])


def _matrix(legs: LegPosture, level: Array, weight: Array, slack: float) -> Array:
    """Newton's: [[w W - H(l), -J^T], [J, s 1]] with H(l) the second derivative of l . x(q)."""
    n = legs.columns.shape[2]
    matrix = np.zeros((*legs.columns.shape[:2], n + 3, n + 3))
    matrix[..., :n, :n] = -np.einsum("nlc,nljkc->nljk", level, _pairs(legs.axes, legs.columns))
    matrix[..., range(n), range(n)] += weight
    matrix[..., :n, n:] = -legs.columns
    matrix[..., n:, :n] = legs.columns.swapaxes(-1, -2)
    matrix[..., range(n, n + 3), range(n, n + 3)] = slack
    return matrix


def _pairs(axes: Array, columns: Array) -> Array:
    """axes_j x columns_k of joints j <= k, in both orders: (N, L, n, 3) to (N, L, n, n, 3)."""
    pairs = cross(axes[:, :, :, None], columns[:, :, None])
    upper = np.triu(np.ones(pairs.shape[2:4], dtype=np.bool_))[..., None]
    return np.where(upper, pairs, pairs.swapaxes(2, 3))


def _solve(matrix: Array, *right: Array) -> Array:
    return np.asarray(np.linalg.solve(matrix, np.concatenate(right, axis=-1)[..., None])[..., 0])


def _rates(
    chains: LegChains,
    freedom: Freedom,
    q: Array,
    legs: LegPosture,
    target: Array,
    velocity: Array,
    acceleration: Array,
) -> tuple[Array, Array]:
    """Joint velocities and accelerations of legs of one freedom, each (N, L, n)."""
    if freedom.square:
        jacobian = legs.columns.swapaxes(-1, -2)
        q_dot = _solve(jacobian, velocity)
        bias = (column_rates(legs, q_dot) * q_dot[..., None]).sum(axis=2)
        return q_dot, _solve(jacobian, acceleration - bias)
    n, (weight, slack) = q.shape[-1], _weight(chains, freedom)
    level = _multipliers(legs, weight * (q - chains.nominal), slack, target)
    matrix = _matrix(legs, level, weight, slack)
    both = _solve(matrix, np.zeros(q.shape), velocity)
    q_dot, level_dot = both[..., :n], both[..., n:]
    rates = column_rates(legs, q_dot)
    bias = (rates * q_dot[..., None]).sum(axis=2)
    turning = 2 * np.einsum("nlc,nlkc->nlk", level_dot, rates)
    # Time derivative of the feet's second derivatives, shape (N, L, n, n, 3).
    spin = legs.axes * q_dot[..., None]
    axis_rates = cross(np.cumsum(spin, axis=2) - spin, legs.axes)
    third = _pairs(axis_rates, legs.columns) + _pairs(legs.axes, rates)
    turning += np.einsum("nlc,nljkc,nlk->nlj", level, third, q_dot, optimize=True)
    return q_dot, _solve(matrix, turning, acceleration - bias)[..., :n]
