"""Laws that act at all joints at once, each with one prior scale that the evidence sets.

With columns X, noise sigma_j and kappa_j independent samples per row of joint j,

    A = sum_j kappa_j / sigma_j^2 X_j^T X_j + diag(1 / s_b^2),
    x = A^-1 sum_j kappa_j / sigma_j^2 X_j^T r_j,
    s_b^2 = sum x_k^2 / sum (1 - A^-1_kk / s_b^2), k in block b,
    sigma_j^2 = kappa_j RSS_j / (kappa_j n_j - gamma_j)

(MacKay, "Bayesian interpolation", Neural Computation 4, 1992). kappa follows from the residual's
autocorrelation (Geyer's initial positive pairs, 1992). A body moves along the logarithm of its
pseudo-inertia, J = L exp(E) L^T with L the Cholesky root of the model's, so that whatever E is some
body has it. Blocks that every machine has stay, shrunk; a rare one has to earn its place by the
evidence and on chunks that were left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
import pandas as pd

from actuators.arrays import Array, Index, Mask
from pipeline.identification.block_columns import CHUNKS, Block, BlockData

#: Evidence that a rare block has to bring (logarithm). Alone it lets false causes pass: a spring of
#: 61 on a pendulum without one. Twice or half of this and of the share below left the rare names of
#: 44 of 49 fits of real machines' logs as they were.
EVIDENCE: Final = 8.0
#: Share of the residual's variance at its own joints that a rare block's absence adds on left-out
#: parts, in so many of them.
WORSE: Final = 0.2
OF_PARTS: Final = (7, 8)
#: Evidence for a single number of a block (logarithm): "strong" (Kass and Raftery, 2 ln B = 6).
NAMED: Final = 3.0
#: Longest step along the logarithm of a body's pseudo-inertia.
_STEP: Final = 0.7
#: Prior scale at which a block is nothing.
_NOTHING: Final = 1e-4
_ROUNDS: Final = 80
_DIRECTIONS: Final = tuple((i, j) for i in range(4) for j in range(i, 4))


@dataclass(frozen=True, eq=False)
class BlockFit:
    """Blocks at their estimates."""

    data: BlockData  #: Columns.
    active: tuple[int, ...]  #: Numbers of the blocks.
    kappa: Array  #: Independent samples per row, shape (J,).
    sigma: Array  #: Noise, shape (J,) [N*m].
    scales: Array  #: Prior scale of every block, shape (B,); 0 where it is nothing.
    x: Array  #: Coordinates, shape (K,): of bodies E, of others in the columns' scale.
    free: Mask  #: Which of them are estimated, not left out by block or sign, shape (K,).

    @cached_property
    def map(self) -> tuple[Array, Array]:
        """Physical values at x (K,) and their derivative (K, K)."""
        return _physical(self.data, self.x)

    @property
    def values(self) -> Array:
        """Changes of inertial parameters and coefficients of laws in their units, shape (K,)."""
        return self.map[0]

    @cached_property
    def precision(self) -> Array:
        """Of the prior, shape (K,)."""
        out = np.ones(self.x.size)
        for block, s in zip(self.data.blocks, self.scales, strict=True):
            out[block.columns] = 1.0 / max(s, _NOTHING) ** 2
        return out / _share(self.data)

    def system(self, sums: tuple[Array, Array, Array, Array]) -> tuple[Array, Array]:
        """A (K, K) and b (K,) of the coordinates about x."""
        weights = self.kappa / self.sigma**2
        values, P = self.map
        G = np.einsum("j,jkl->kl", weights, sums[0])
        PG = P.T @ G
        b = P.T @ (weights @ sums[1]) - PG @ (values - P @ self.x)
        return PG @ P + np.diag(self.precision), b

    @cached_property
    def covariance(self) -> Array:
        """Posterior covariance of x, zero for what is not free, shape (K, K)."""
        A, f = self.system(self.data.total)[0], np.ix_(self.free, self.free)
        out = np.zeros_like(A)
        out[f] = np.linalg.inv(A[f])
        return out

    @cached_property
    def misfit(self) -> Array:
        """Sum of squares that every equation leaves, shape (J,) [N^2*m^2]."""
        return _misfits(self.data.total, self.values)

    @cached_property
    def evidence(self) -> float:
        """Its logarithm, up to a constant of the data and kappa."""
        f, prior = self.free, self.precision
        A = self.system(self.data.total)[0][np.ix_(f, f)]
        size = np.linalg.slogdet(A)[1] - np.log(prior[f]).sum()
        n = self.data.total[3]
        fit = self.kappa * (self.misfit / self.sigma**2 + n * np.log(self.sigma**2))
        return float(-0.5 * (fit.sum() + prior[f] @ self.x[f] ** 2 + size))

    def costs(self) -> dict[int, float]:
        """Evidence that each rare block brings while the others' scales stay.

        With S the posterior covariance of its coordinates and s^2 their prior variance,
        (x^T S^-1 x + ln det S - ln det s^2) / 2.
        """
        out = {}
        for b in self.active:
            ids = self.data.blocks[b].columns
            ids = ids[self.free[ids]]
            if self.data.blocks[b].law.common:
                continue
            S = self.covariance[np.ix_(ids, ids)]
            size = np.linalg.slogdet(S)[1] + np.log(self.precision[ids]).sum()
            x = self.x[ids]
            out[b] = float(0.5 * (x @ np.linalg.solve(S, x) + size)) if ids.size else 0.0
        return out

    def left_out(self) -> Array:
        """Misfit of every eighth of the log by estimates from the others, shape (8, J)."""
        out = []
        for part in np.array_split(np.arange(CHUNKS), OF_PARTS[1]):
            values = _physical(self.data, self._without(part))[0]
            out.append(_misfits(self.data.sums(part), values))
        return np.array(out)

    def _without(self, part: Index) -> Array:
        less = self.data.sums(part)
        total = self.data.total
        A, b = self.system((total[0] - less[0], total[1] - less[1], *total[2:]))
        x, f = np.zeros_like(self.x), self.free
        x[f] = np.linalg.solve(A[np.ix_(f, f)], b[f])
        return x

    @cached_property
    def deviation(self) -> Array:
        """Standard deviation of `values`: the wider of posterior and jackknife, shape (K,)."""
        P = self.map[1]
        posterior = np.sqrt(np.maximum(np.einsum("ki,ij,kj->k", P, self.covariance, P), 0.0))
        drawn = np.array([P @ self._without(np.array([c])) for c in range(CHUNKS)])
        spread = np.sqrt((CHUNKS - 1) * drawn.var(axis=0))
        return np.maximum(posterior, spread)

    def told(self) -> Mask:
        """Numbers that the log tells from nothing, shape (K,).

        The interval leaves zero, and the evidence against nothing passes: with d the deviation and
        s the prior's, (x^2 / d^2 - ln(s^2 / d^2)) / 2 above `NAMED`.
        """
        spread = np.where(self.free & (self.deviation > 0.0), self.deviation, np.inf)
        scale = np.sqrt(1.0 / self.precision) * np.abs(np.diag(self.map[1]))
        gain = 0.5 * (self.values / spread) ** 2 - np.log(np.maximum(scale / spread, 1.0))
        clear = np.abs(self.values) > 1.96 * spread
        return np.asarray(self.free & clear & (gain > NAMED))

    def table(self) -> pd.DataFrame:
        """A row per number of the laws: value, 95 % interval, whether it is told from nothing."""
        rows, told = [], self.told()
        for b in self.active:
            block, law = self.data.blocks[b], self.data.blocks[b].law
            if block.kind == "body":
                continue
            for place, k in zip(block.places, block.columns, strict=True):
                value, spread = float(self.values[k]), 1.96 * float(self.deviation[k])
                ends = (value - spread, value + spread)
                rows.append((block.kind, law.effect, place, value, *ends, law.unit, told[k]))
        names = ("block", "effect", "place", "value", "low", "high", "unit", "told")
        return pd.DataFrame(rows, columns=list(names))

    def bodies(self) -> Array:
        """Ten inertial parameters of every body at the estimates, shape (B, 10)."""
        count = self.data.start.size
        return self.data.start + self.values[:count].reshape(self.data.start.shape)


def fit_blocks(data: BlockData) -> BlockFit:
    """The blocks that a log shows, at their estimates.

    Common blocks stay; rare ones leave one after another, that one first without which the log is
    likeliest, until each that is left brings `EVIDENCE` and is missed on left-out parts.
    """
    count = data.blocks[-1].columns[-1] + 1
    _, _, s, n = data.total
    sigma = np.sqrt(np.maximum(s, 1e-12) / np.maximum(n, 1.0))
    scales = np.minimum(0.1, [b.law.bound for b in data.blocks])
    every, free = tuple(range(len(data.blocks))), np.ones(count, dtype=np.bool_)
    fit = BlockFit(data, every, np.full(sigma.size, 0.2), sigma, scales, np.zeros(count), free)
    for _ in range(2):
        fit = _settled(fit)
        fit = replace(fit, kappa=_independent(data, fit.values))
    fit = _settled(fit)
    gone = [b for b in fit.active if not data.blocks[b].law.common and fit.scales[b] <= _NOTHING]
    for b in gone:
        fit = _less(fit, b)
    while True:
        costs = fit.costs()
        kept = True
        for b in sorted(costs, key=costs.__getitem__):
            less = _settled(_less(fit, b))
            small = fit.evidence - less.evidence < EVIDENCE
            if small or not _missed(fit, less, data.blocks[b]):
                fit, kept = less, False
                break
        if kept:
            return fit


def _less(fit: BlockFit, number: int) -> BlockFit:
    active = tuple(b for b in fit.active if b != number)
    x, scales = fit.x.copy(), fit.scales.copy()
    x[fit.data.blocks[number].columns] = scales[number] = 0.0
    return replace(fit, active=active, x=x, scales=scales)


def _missed(fit: BlockFit, less: BlockFit, block: Block) -> bool:
    """Whether left-out parts miss it at some joint: a block may be the law of one joint alone."""
    own = list(block.joints)
    noise = fit.misfit / np.maximum(fit.data.total[3], 1.0)
    parts = np.array_split(np.arange(CHUNKS), OF_PARTS[1])
    n = np.array([fit.data.grams[3][part].sum(axis=0) for part in parts])  # (8, J)
    rise = (less.left_out() - fit.left_out()) / noise / np.maximum(n, 1.0)
    return bool(((rise[:, own] > WORSE).sum(axis=0) >= OF_PARTS[0]).any())


def _settled(fit: BlockFit) -> BlockFit:
    """Estimates, scales and noise that belong to each other."""
    data, before = fit.data, -np.inf
    bound = np.array([b.law.bound for b in data.blocks])
    share, bodies, K = _share(data), data.start.size, fit.x.size
    own, signed = np.full(K, -1), np.ones(K, dtype=np.bool_)
    for b, block in enumerate(data.blocks):
        signed[block.columns] = block.law.signed
        if b in fit.active:
            own[block.columns] = b
    wrong = np.zeros(K, dtype=np.bool_)
    n = data.total[3]
    for turn in range(_ROUNDS):
        live = (own >= 0) & (fit.scales[np.maximum(own, 0)] > _NOTHING)
        fit = replace(fit, free=live & ~wrong)
        f = fit.free
        x = fit.covariance @ fit.system(data.total)[1]
        against = f & ~signed & (x < 0)
        wrong |= against
        x[against] = 0.0
        step = x[:bodies] - fit.x[:bodies]
        x[:bodies] = fit.x[:bodies] + step * min(1.0, _STEP / max(np.abs(step).max(), 1e-12))
        scales = np.zeros_like(fit.scales)
        for k in fit.active:
            ids = data.blocks[k].columns
            ids = ids[f[ids] & ~against[ids]]
            if fit.scales[k] <= _NOTHING or not ids.size:
                continue
            C = np.diag(fit.covariance)[ids] / share[ids]
            told = np.sum(1.0 - C / fit.scales[k] ** 2)
            size = np.sum(x[ids] ** 2 / share[ids]) / max(told, 1e-9)
            scales[k] = min(np.sqrt(size), bound[k])
        P = fit.map[1]
        spread = P @ fit.covariance @ P.T
        gamma = fit.kappa / fit.sigma**2 * np.einsum("kl,jkl->j", spread, data.total[0])
        rows = np.maximum(fit.kappa * n - gamma, 0.1 * fit.kappa * n)
        fit = replace(fit, x=x, free=f & ~against)
        sigma = np.sqrt(np.maximum(fit.kappa * fit.misfit / np.maximum(rows, 1e-9), 1e-18))
        fit = replace(fit, scales=scales, sigma=sigma)
        change = abs(float(np.log(sigma) @ (fit.kappa * n)) - before)
        before = float(np.log(sigma) @ (fit.kappa * n))
        if turn > 4 and change < 0.05:
            break
    return fit


def _share(data: BlockData) -> Array:
    """Variance of every coordinate's prior in its block's, (K,): half off E's diagonal."""
    out = np.ones(data.blocks[-1].columns[-1] + 1)
    halved = [1.0 if i == j else 0.5 for i, j in _DIRECTIONS]
    out[: data.start.size] = np.tile(halved, len(data.start))
    return out


def _misfits(sums: tuple[Array, Array, Array, Array], values: Array) -> Array:
    G, h, s, _ = sums
    return np.maximum(
        s + np.einsum("k,jkl,l->j", values, G, values, optimize=True) - 2.0 * h @ values, 1e-18
    )


def _physical(data: BlockData, x: Array) -> tuple[Array, Array]:
    """Values (K,) of coordinates and their derivative (K, K)."""
    values, P = np.zeros_like(x), np.zeros((x.size, x.size))
    change, slope = _bodies(data, x[: data.start.size].reshape(-1, 10))
    for k in range(len(data.start)):
        own = slice(10 * k, 10 * k + 10)
        values[own], P[own, own] = change[k], slope[k]
    for block in data.blocks:
        if block.kind != "body":
            values[block.columns] = block.scale * x[block.columns]
            P[block.columns, block.columns] = block.scale
    return values, P


def _bodies(data: BlockData, E: Array) -> tuple[Array, Array]:
    """Changes of ten inertial parameters (B, 10) by E (B, 10), and their derivatives."""
    steps = np.concatenate([np.zeros((1, 10)), 1e-5 * np.eye(10), -1e-5 * np.eye(10)])
    e = E[:, None] + steps  # (B, 21, 10)
    S = np.zeros((*e.shape[:2], 4, 4))
    for k, (i, j) in enumerate(_DIRECTIONS):
        S[..., i, j] = S[..., j, i] = e[..., k]
    w, V = np.linalg.eigh(S)
    L = data.roots[:, None]
    J = L @ (V * np.exp(w)[..., None, :]) @ V.swapaxes(-1, -2) @ L.swapaxes(-1, -2)
    inertia = np.trace(J[..., :3, :3], axis1=-2, axis2=-1)[..., None, None] * np.eye(3)
    inertia = inertia - J[..., :3, :3]
    at, to = [0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]
    ten = np.concatenate([J[..., 3, 3:], J[..., :3, 3], inertia[..., at, to]], axis=-1)
    slope = (ten[:, 1:11] - ten[:, 11:]) / 2e-5  # (B, 10 of E, 10)
    return ten[:, 0] - data.start, slope.swapaxes(-1, -2)


def _independent(data: BlockData, values: Array) -> Array:
    """Independent samples per row by the autocorrelation of what is left, shape (J,)."""
    out = []
    for e in data.equations:
        left = e.r - e.X @ values
        if left.size < 4 or not left.any():
            out.append(1.0)
            continue
        n = 1 << (2 * left.size - 1).bit_length()
        f = np.fft.rfft(left, n)
        rho = np.fft.irfft(f * f.conj(), n)[: left.size]
        rho = rho / rho[0]
        pairs = rho[: rho.size // 2 * 2].reshape(-1, 2).sum(axis=1)
        ends = np.flatnonzero(pairs <= 0.0)
        positive = np.minimum.accumulate(pairs[: ends[0] if ends.size else pairs.size])
        out.append(1.0 / max(2.0 * positive.sum() - 1.0, 1.0))
    return np.array(out)
