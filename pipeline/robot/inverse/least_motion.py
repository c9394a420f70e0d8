"""Legs with more or fewer joints than a foot has coordinates, as one problem.

A leg with joints to spare takes, of all postures that put its foot on the target, the one that
moves least from its nominal stance. A leg that lacks a direction puts its foot as near to the
target as it gets. Both are stationary points of

    w/2 (q - q0)^T W (q - q0) + 1/(2 s) |x(q) - t|^2,

with W one per joint (a sliding joint's metre counted by the leg's reach), w = 1 and s -> 0 for the
first, w = 0 and s = 1 for the second, and both for a leg that has joints to spare and lacks a
direction none the less, as three parallel axes do. With l = (t - x)/s this is

    w W (q - q0) - J^T l = 0,    x(q) + s l - t = 0,

to which damped least squares come near and Newton's iteration leads; velocities and accelerations
follow from its first and second derivative in time, so that they are exactly those of the
positions. The second derivative of x by joints j <= k is a_j x column_k where j turns, zero where
it slides, with the axis a_j and the Jacobian's column of joint k.

A step of damped least squares is ``J^T (J J^T + m^2 1)^-1 e`` with the error e of the foot and a
damping m that falls with it (Nakamura and Hanafusa 1986; Wampler 1986): near a singular posture
steps stay small, near the target the iteration is Newton's. Paths are followed from coarse to fine:
a few samples are solved from the start posture, those between start from a spline through them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.robot.kinematics import (
    Swept,
    cross,
    foot_jacobian_rates,
    foot_jacobians,
    foot_positions,
    samples_last,
    swept,
)
from pipeline.robot.leg_chains import LegChains

_DAMPED_ITERATIONS = 60
_MAX_STEP = 0.35  # [rad] per iteration, keeps the knee on the branch of the start posture
_REACHED, _STILL = 1e-13, 1e-12  # [m], [rad] of a step: what is left is out of reach
_LEAST_DAMPING, _DAMPING = 1e-8, 1e-2  # [m], relaxed as the iteration comes close
_STRIDE = 16  # samples of a path between those that are solved first
#: Share of a leg's reach within which a spline's guess is trusted to lie on the path's branch.
_NEAR = 5e-3
_ITERATIONS = 30
_CONVERGED = 1e-12  # [m, rad]
_LARGEST_STEP = 0.3  # [rad]
#: Weight of least motion against a miss of the foot, where a leg both lacks a direction and has
#: joints to spare, in squares of its reach: small enough to leave the foot where it gets.
_SLIGHT = 1e-9
#: Of the largest singular value: a direction in which the foot hardly moves, whatever the posture,
#: is one that the leg lacks.
_RANK = 1e-2
#: Condition number of a leg's Jacobian that is none any more.
_SINGULAR = 1e8
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
    q = 2 * np.pi * spread(_POSES, chains.depth) - np.pi
    columns = swept(chains, np.repeat(q.T[None], len(chains.names), axis=0)).columns
    values = np.linalg.svd(columns.transpose(3, 2, 0, 1), compute_uv=False)
    ranks = (values > _RANK * values[..., :1]).sum(-1).max(axis=0)
    return tuple(Freedom(int(c), int(r)) for c, r in zip(chains.counts, ranks, strict=True))


class LeastMotion:
    """The problem for legs of one freedom."""

    def __init__(self, chains: LegChains, freedom: Freedom) -> None:
        self.chains, self.freedom = chains, freedom
        self.turns = (~chains.slides).astype(np.float64)  # (n, L)
        metric = np.where(chains.slides.T, 1 / chains.reach[:, None] ** 2, 1.0)
        slight = _SLIGHT * chains.reach[:, None] ** 2 if freedom.lacks else 1.0
        self.weight = metric * slight * (freedom.joints > freedom.directions)  # w W, (L, n)
        self.s = 1.0 if freedom.lacks else 0.0
        self.square = freedom.joints == freedom.directions == 3  # nothing is left to choose

    def positions(self, target: Array, start: Array) -> tuple[Array, Array]:
        """Postures, and what is left to the targets.

        `target`: foot positions in the base frame [m], shape (N, L, 3). `start`: shape (L, n) [rad,
        m]. Returns shapes (N, L, n) and (N, L) [m].
        """
        q, left = approach(self.chains, target, start)
        if self.square:
            return q, left
        n, level = q.shape[-1], self._multipliers(q, target)
        for _ in range(_ITERATIONS):
            legs, _, matrix = self._system(q, level)
            motion = self.weight * (q - self.chains.nominal)
            first = motion - np.einsum("cjln,nlc->nlj", legs.columns, level)
            second = legs.tip.transpose(2, 1, 0) + self.s * level - target
            try:
                step = -_solve(matrix, first, second)
            except np.linalg.LinAlgError:  # a singular posture: what is left shows it
                break
            largest = np.abs(step[..., :n]).max(axis=-1, keepdims=True)
            step *= np.minimum(1.0, _LARGEST_STEP / np.maximum(largest, 1e-300))
            q, level = q + step[..., :n], level + step[..., n:]
            if largest.max() < _CONVERGED:
                break
        return q, np.linalg.norm(target - foot_positions(self.chains, q), axis=-1)

    def rates(
        self, q: Array, target: Array, velocity: Array, acceleration: Array, time: Array
    ) -> tuple[Array, Array]:
        """Joint velocities and accelerations of the least motion, each (N, L, n).

        `q`: postures from `positions`, shape (N, L, n). `target`, `velocity`, `acceleration`: of
        the feet [m, m/s, m/s^2], shape (N, L, 3). `time`: for messages [s], shape (N,).

        Raises:
            LegwattError: The leg is stretched (singular) at a sample.
        """
        jacobians = np.ascontiguousarray(foot_jacobians(self.chains, q)[1])
        values = np.linalg.svd(jacobians, compute_uv=False)
        singular = ~(values[..., 0] < _SINGULAR * values[..., self.freedom.directions - 1])
        if singular.any():
            leg, sample = np.unravel_index(int(singular.T.argmax()), singular.T.shape)
            raise LegwattError(
                f"leg '{self.chains.names[leg]}' is stretched or folded to a singular posture at "
                f"t = {time[sample]:.4g} s; shorten the stroke or move the neutral foot"
            )
        if self.square:
            q_dot = _solve(jacobians, velocity)
            bias = foot_jacobian_rates(self.chains, q, q_dot)
            return q_dot, _solve(jacobians, acceleration - bias)
        n, level = q.shape[-1], self._multipliers(q, target)
        legs, second, matrix = self._system(q, level)
        both = _solve(matrix, np.zeros(q.shape), velocity)
        q_dot, level_dot = both[..., :n], both[..., n:]
        rate = samples_last(q_dot).transpose(1, 0, 2)
        column_rates = np.einsum("cjkln,jln->ckln", second, rate)
        bias = np.einsum("ckln,kln->nlc", column_rates, rate)
        turning = 2 * np.einsum("nlc,ckln->nlk", level_dot, column_rates)
        assert legs.axes is not None
        # Time derivative of the feet's second derivatives, shape (3, n, n, L, N).
        spin = legs.axes * (self.turns[..., None] * rate)
        carried = np.cumsum(spin, axis=1) - spin  # angular velocity of what a joint hangs on
        axis_rates = cross(carried, legs.axes)
        pairs = cross(axis_rates[:, :, None], legs.columns[:, None])
        pairs += cross(legs.axes[:, :, None], column_rates[:, None])
        third = _symmetric(self.turns[:, None, :, None] * pairs)
        turning += np.einsum("nlc,cjkln,kln->nlj", level, third, rate, optimize=True)
        return q_dot, _solve(matrix, turning, acceleration - bias)[..., :n]

    def _multipliers(self, q: Array, target: Array) -> Array:
        """The l of postures that are solutions, or nearly, shape (N, L, 3)."""
        legs = swept(self.chains, samples_last(q))
        if self.s:
            return np.asarray(target - legs.tip.transpose(2, 1, 0))
        jacobian = legs.columns.transpose(3, 2, 0, 1)
        wanted = jacobian @ (self.weight * (q - self.chains.nominal))[..., None]
        return np.asarray(np.linalg.solve(jacobian @ jacobian.swapaxes(-1, -2), wanted)[..., 0])

    def _system(self, q: Array, level: Array) -> tuple[Swept, Array, Array]:
        """The sweep of some postures, second derivatives of the feet and Newton's matrix.

        The matrix is [[w W - H(l), -J^T], [J, s 1]] with H(l) the second derivative of l . x(q).
        """
        n, legs = q.shape[-1], swept(self.chains, samples_last(q), axes=True)
        assert legs.axes is not None
        pairs = cross(legs.axes[:, :, None], legs.columns[:, None])
        second = _symmetric(self.turns[:, None, :, None] * pairs)
        matrix = np.zeros((*q.shape[:2], n + 3, n + 3))
        matrix[..., :n, :n] = -np.einsum("nlc,cjkln->nljk", level, second)
        matrix[..., range(n), range(n)] += self.weight
        matrix[..., n:, :n] = legs.columns.transpose(3, 2, 0, 1)
        matrix[..., :n, n:] = -matrix[..., n:, :n].swapaxes(-1, -2)
        matrix[..., range(n, n + 3), range(n, n + 3)] = self.s
        return legs, second, matrix


def _symmetric(pairs: Array) -> Array:
    """Entries of joints j <= k for both orders, shape (3, n, n, L, N)."""
    upper = np.triu(np.ones(pairs.shape[1:3], dtype=np.bool_))[..., None, None]
    return np.where(upper, pairs, pairs.swapaxes(1, 2))


def _solve(matrix: Array, *right: Array) -> Array:
    return np.asarray(np.linalg.solve(matrix, np.concatenate(right, axis=-1)[..., None])[..., 0])


def approach(chains: LegChains, target: Array, start: Array) -> tuple[Array, Array]:
    """Joint positions that bring the feet as close to their targets as the iteration gets.

    `target`: foot positions in the base frame [m], shape (N, L, 3). `start`: posture that names the
    branch (knee up or down) [rad, m], shape (L, K) or (N, L, K). Returns joint positions [rad, m],
    shape (N, L, K), and what is left to the targets [m], (N, L).
    """
    n = target.shape[0]
    q = np.broadcast_to(start, (*target.shape[:2], chains.depth)).copy()
    if start.ndim == 2 and n > 4 * _STRIDE:
        from scipy.interpolate import CubicSpline

        knots = np.unique(np.append(np.arange(0, n, _STRIDE), n - 1))
        q[knots] = _iterated(chains, target[knots], q[knots])[0]
        guess = CubicSpline(knots, q[knots])(np.arange(n))
        off = np.linalg.norm(foot_positions(chains, guess) - target, axis=-1)
        q = np.where((off < _NEAR * chains.reach)[..., None], guess, q)
    return _iterated(chains, target, q)


def _iterated(chains: LegChains, target: Array, q: Array) -> tuple[Array, Array]:
    left = np.empty(target.shape[:2])
    busy = np.arange(len(target))  # samples that are not there yet
    for iteration in range(_DAMPED_ITERATIONS + 1):
        feet, jacobians = foot_jacobians(chains, q[busy])
        error = target[busy] - feet
        left[busy] = np.linalg.norm(error, axis=-1)
        going = (left[busy] > _REACHED).any(axis=1)
        if iteration == _DAMPED_ITERATIONS or not going.any():
            break
        busy, own = busy[going], np.ascontiguousarray(jacobians[going])
        transposed = own.swapaxes(-1, -2)
        damping = np.clip(0.1 * left[busy], _LEAST_DAMPING, _DAMPING)[..., None, None]
        normal = own @ transposed + damping**2 * np.eye(3)
        step = (transposed @ np.linalg.solve(normal, error[going][..., None]))[..., 0]
        largest = np.abs(step).max(axis=-1, keepdims=True)
        step *= np.minimum(1.0, _MAX_STEP / np.maximum(largest, 1e-300))
        q[busy] += step
        busy = busy[np.abs(step).max(axis=(1, 2)) > _STILL]
    return q, left
