"""Legs with more or fewer joints than a foot has coordinates, as one problem.

A leg with joints to spare takes, of all postures that put its foot on the target, the one that
moves least from its nominal stance. A leg that lacks a direction puts its foot as near to the
target as it gets. Both are stationary points of

    w/2 (q - q0)^T W (q - q0) + 1/(2 s) |x(q) - t|^2,

with W one per joint (a sliding joint's metre counted by the leg's reach), w = 1 and s -> 0 for the
first, w = 0 and s = 1 for the second, and both for a leg that has joints to spare and lacks a
direction none the less, as three parallel axes do. With l = (t - x)/s this is

    w W (q - q0) - J^T l = 0,    x(q) + s l - t = 0,

solved by Newton's iteration; velocities and accelerations follow from its first and second
derivative in time, so that they are exactly those of the positions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.robot.inverse.damped import approach
from pipeline.robot.kinematics import Swept, bias_acceleration, cross, swept
from pipeline.robot.leg_chains import LegChains

Array = NDArray[np.float64]
_ITERATIONS = 30
_CONVERGED = 1e-12  # [m, rad]
_LARGEST_STEP = 0.3  # [rad]
#: Weight of least motion against a miss of the foot, where a leg both lacks a direction and has
#: joints to spare, in squares of its reach: small enough to leave the foot where it gets.
_SLIGHT = 1e-9
#: Of the largest singular value: a direction in which the foot hardly moves, whatever the posture,
#: is one that the leg lacks.
_RANK = 1e-2
_POSES = 25
_PRIMES = (2, 3, 5, 7, 11, 13, 17)


@dataclass(frozen=True)
class Freedom:
    """What a leg's joints can do to its foot.

    Attributes:
        joints: Number of joints.
        directions: Directions in which the foot moves, in postures that are not singular.
    """

    joints: int
    directions: int

    @property
    def square(self) -> bool:
        """Whether joints and coordinates are three of each."""
        return self.joints == 3 and self.directions == 3

    @property
    def lacks(self) -> bool:
        """Whether the foot cannot follow every path."""
        return self.directions < 3


def freedoms(chains: LegChains) -> tuple[Freedom, ...]:
    """What each leg can do, from its Jacobian at postures spread over all angles."""
    made: dict[str, tuple[Freedom, ...]] = chains.__dict__.setdefault("_freedoms", {})
    if "all" not in made:
        steps = np.sqrt(_PRIMES[: chains.depth])  # irrational to one another
        q = 2 * np.pi * ((np.arange(1, _POSES + 1)[:, None] * steps) % 1.0) - np.pi
        pose = np.repeat(q.T[None], len(chains.names), axis=0)
        columns = swept(chains, pose).columns.transpose(3, 2, 0, 1)
        values = np.linalg.svd(columns, compute_uv=False)  # (poses, L, min(3, K))
        ranks = (values > _RANK * values[..., :1]).sum(-1).max(axis=0)
        made["all"] = tuple(
            Freedom(int(c), int(r)) for c, r in zip(chains.counts, ranks, strict=True)
        )
    return made["all"]


@dataclass(frozen=True)
class _System:
    """Matrix and ingredients of the problem at some postures, samples and legs first.

    Attributes:
        matrix: [[w W - H(l), -J^T], [J, s 1]], shape (N, M, n + 3, n + 3).
        jacobian: Shape (N, M, 3, n).
        legs: The sweep that made it.
    """

    matrix: Array
    jacobian: Array
    legs: Swept


class LeastMotion:
    """The problem for legs of one freedom.

    Args:
        chains: Those legs alone.
        freedom: Theirs.
        nominal: Posture about which they move least, shape (M, K) [rad, m].
    """

    def __init__(self, chains: LegChains, freedom: Freedom, nominal: Array) -> None:
        self.chains, self.n = chains, freedom.joints
        self.nominal = nominal[:, : self.n]
        slides = chains.slides.T[:, : self.n]
        self.metric = np.where(slides, 1 / chains.reach[:, None] ** 2, 1.0)  # W, (M, n)
        slight = _SLIGHT * chains.reach[:, None] ** 2
        spare = freedom.joints > freedom.directions
        self.s = 1.0 if freedom.lacks else 0.0
        self.weight = self.metric * (slight if freedom.lacks else 1.0) * (1.0 if spare else 0.0)
        self.turns = (~slides).astype(np.float64)

    def positions(self, target: Array, start: Array) -> tuple[Array, Array]:
        """Postures, and what is left to the targets.

        Args:
            target: Foot positions in the base frame [m], shape (N, M, 3).
            start: Shape (M, K) or (N, M, K).

        Returns:
            Shape (N, M, K), zero beyond the legs' joints, and (N, M) [m].
        """
        full, _ = approach(self.chains, target, start)
        q = full[..., : self.n].copy()
        level = self._multipliers(q, target)
        for _ in range(_ITERATIONS):
            system = self._system(q, level)
            foot = system.legs.tip.transpose(2, 1, 0)
            first = self.weight * (q - self.nominal) - np.einsum(
                "nmij,nmi->nmj", system.jacobian, level
            )
            second = foot + self.s * level - target
            both = np.concatenate([first, second], axis=-1)
            try:
                step = -np.linalg.solve(system.matrix, both[..., None])[..., 0]
            except np.linalg.LinAlgError:  # a singular posture: what is left tells of it
                break
            largest = np.abs(step[..., : self.n]).max(axis=-1, keepdims=True)
            step *= np.minimum(1.0, _LARGEST_STEP / np.maximum(largest, 1e-300))
            q += step[..., : self.n]
            level += step[..., self.n :]
            if largest.max() < _CONVERGED:
                break
        full[..., : self.n] = q
        foot = swept(self.chains, np.array(full.transpose(1, 2, 0))).tip.transpose(2, 1, 0)
        return full, np.linalg.norm(target - foot, axis=-1)

    def rates(
        self, q: Array, velocity: Array, acceleration: Array, target: Array
    ) -> tuple[Array, Array]:
        """Joint velocities and accelerations of the least motion, each (N, M, K).

        Args:
            q: Postures from `positions`, shape (N, M, K).
            velocity: Of the targets [m/s], shape (N, M, 3).
            acceleration: Of the targets [m/s^2], shape (N, M, 3).
            target: Where they are [m], shape (N, M, 3).
        """
        own, n = q[..., : self.n], self.n
        level = self._multipliers(own, target)
        system = self._system(own, level)
        none = np.zeros(own.shape)
        first = np.linalg.solve(system.matrix, np.concatenate([none, velocity], -1)[..., None])
        q_dot, level_dot = first[..., :n, 0], first[..., n:, 0]
        rate = np.zeros(q.shape)
        rate[..., :n] = q_dot
        bias = bias_acceleration(
            self.chains, np.array(q.transpose(1, 2, 0)), np.array(rate.transpose(1, 2, 0))
        ).transpose(2, 1, 0)
        turning = 2 * np.einsum("nmjk,nmk->nmj", self._bend(system.legs, level_dot), q_dot)
        turning += np.einsum("nmjk,nmk->nmj", self._bend_rate(system.legs, level, q_dot), q_dot)
        right = np.concatenate([turning, acceleration - bias], -1)
        second = np.linalg.solve(system.matrix, right[..., None])[..., :n, 0]
        faster = np.zeros(q.shape)
        faster[..., :n] = second
        return rate, faster

    def _multipliers(self, q: Array, target: Array) -> Array:
        """The l of postures that are solutions, or nearly, shape (N, M, 3)."""
        full = np.zeros((*q.shape[:2], self.chains.depth))
        full[..., : self.n] = q
        legs = swept(self.chains, np.array(full.transpose(1, 2, 0)))
        if self.s:
            return np.asarray(target - legs.tip.transpose(2, 1, 0))
        jacobian = legs.columns.transpose(3, 2, 0, 1)[..., : self.n]
        normal = jacobian @ jacobian.swapaxes(-1, -2)
        wanted = np.einsum("nmij,nmj->nmi", jacobian, self.weight * (q - self.nominal))
        return np.asarray(np.linalg.solve(normal, wanted[..., None])[..., 0])

    def _system(self, q: Array, level: Array) -> _System:
        n = self.n
        full = np.zeros((*q.shape[:2], self.chains.depth))
        full[..., :n] = q
        legs = swept(self.chains, np.array(full.transpose(1, 2, 0)), axes=True)
        jacobian = legs.columns.transpose(3, 2, 0, 1)[..., :n]
        matrix = np.zeros((*q.shape[:2], n + 3, n + 3))
        matrix[..., :n, :n] = -self._bend(legs, level)
        matrix[..., range(n), range(n)] += self.weight
        matrix[..., :n, n:] = -jacobian.swapaxes(-1, -2)
        matrix[..., n:, :n] = jacobian
        matrix[..., range(n, n + 3), range(n, n + 3)] = self.s
        return _System(matrix, jacobian, legs)

    def _bend(self, legs: Swept, level: Array) -> Array:
        """H(l), the second derivative of l . x(q), shape (N, M, n, n).

        Its entry of joints j <= k is l . (a_j x column_k) where j turns, zero where it slides.
        """
        assert legs.axes is not None
        axes, columns, force = legs.axes, legs.columns, level.transpose(2, 1, 0)

        def entry(j: int, k: int) -> Array:
            return np.asarray((force * cross(axes[:, j], columns[:, k])).sum(0))

        return self._symmetric(entry, force.shape)

    def _bend_rate(self, legs: Swept, level: Array, q_dot: Array) -> Array:
        """Time derivative of H(l) at constant l, shape (N, M, n, n)."""
        assert legs.axes is not None
        axes, columns, n = legs.axes, legs.columns, self.n
        force, rate = level.transpose(2, 1, 0), q_dot.transpose(2, 1, 0)
        turns = self.turns.T[:, :, None]
        spins = np.zeros((3, n, *force.shape[1:]))  # angular velocity of what joint j hangs on
        for j in range(1, n):
            spins[:, j] = spins[:, j - 1] + axes[:, j - 1] * (turns[j - 1] * rate[j - 1])
        axis_rates = [cross(spins[:, j], axes[:, j]) for j in range(n)]
        # d(column_k)/dt = sum over i of what joint i does to it: a_min x column_max where it turns.
        column_rates = []
        for k in range(n):
            change = np.zeros(force.shape)
            for i in range(n):
                low, high = min(i, k), max(i, k)
                turned = cross(axes[:, low], columns[:, high])
                change += turned * (turns[low] * rate[i])
            column_rates.append(change)

        def entry(j: int, k: int) -> Array:
            both = cross(axis_rates[j], columns[:, k]) + cross(axes[:, j], column_rates[k])
            return np.asarray((force * both).sum(0))

        return self._symmetric(entry, force.shape)

    def _symmetric(self, entry: Callable[[int, int], Array], shape: tuple[int, ...]) -> Array:
        n, (_, legs, samples) = self.n, shape
        turns = self.turns.T[:, :, None]
        out = np.empty((n, n, legs, samples))
        for j in range(n):
            for k in range(j, n):
                out[j, k] = out[k, j] = turns[j] * entry(j, k)
        return out.transpose(3, 2, 0, 1)
