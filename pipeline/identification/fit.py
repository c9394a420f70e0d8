"""Blocks and names at their estimates: scales by the evidence, what a name adds, who misses it.

With columns X, noise sigma_e and kappa_e independent samples per row of equation e, and a prior of
standard deviation s_b u_k for coordinate k of block b,

    A = sum_e kappa_e / sigma_e^2 X_e^T X_e + Lambda,    x = A^-1 b,
    ln E = b^T A^-1 b / 2 - ln det A / 2 + ln det Lambda / 2 - sum_e kappa_e n_e ln sigma_e + ...,
    s_b^2 = sum (x_k / u_k)^2 / sum (1 - A^-1_kk / (s_b u_k)^2),
    sigma_e^2 = kappa_e RSS_e / (kappa_e n_e - gamma_e)

(MacKay, "Bayesian interpolation", Neural Computation 4, 1992). kappa follows from the residual's
autocorrelation (Geyer's initial positive pairs, 1992). What every machine has stands in blocks of
one prior scale each, shrunk; a name stands with a prior of its own, heavy-tailed about the size
that it has in practice, and pays for it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
import scipy.linalg
import scipy.optimize

from actuators.arrays import Array, Index, Mask
from pipeline.identification.design import Design
from pipeline.identification.settings import CHUNKS, LOOSE
from pipeline.identification.tolerances import Slope

#: Prior scale at which a block is nothing.
NOTHING: Final = 1e-4
#: Turns of the updates of scales and noise, at most.
_TURNS: Final = 15
_RIDGE: Final = 1e-10
#: Turns at which blocks are tried as nothing, and those that are nothing at this scale.
_REVIEWED: Final = (0, 4, 10)
_REVIVED: Final = 0.03
#: Times that coordinates against their sign leave at once, and those that would have theirs return.
_EXCHANGED: Final = 6


@dataclass(frozen=True, eq=False)
class Fit:
    """A set of names on a design, beside the blocks that stay."""

    design: Design
    floor: Array  #: Sensors' noise of every equation, shape (E,).
    scales: Mapping[str, float]  #: Prior scale of every block.
    kappa: Array  #: Independent samples per row, shape (E,).
    sigma: Array  #: Noise, shape (E,).
    names: tuple[int, ...] = ()  #: Numbers of the terms that stand with a prior of their own.
    loose: frozenset[str] = frozenset()  #: Blocks of bodies that may be far from the files'.
    negative: Mask | None = None  #: Columns left out for their sign, shape (K,).
    omitted: frozenset[int] = frozenset()  #: Columns that are to be nothing.
    #: Prior standard deviation of names' columns where they are out in the tail, shape (K,).
    tails: Array | None = None

    @cached_property
    def active(self) -> Index:
        """Columns in use."""
        live = self.live if self.negative is None else self.live & ~self.negative
        return np.asarray(self.offered[live[self.offered]])

    @cached_property
    def live(self) -> Mask:
        """Columns but those of blocks that are nothing, shape (K,)."""
        out = self.deviation > NOTHING * self.design.unit
        out[self.design.of(self.names)] = True
        return out

    @cached_property
    def offered(self) -> Index:
        """Columns in use, those of blocks that are nothing, and those against their sign."""
        chosen = self.design.standing(self.names)
        gone = np.zeros(self.design.size, dtype=np.bool_)
        gone[list(self.omitted)] = True
        return np.asarray(chosen[~gone[chosen]])

    @cached_property
    def _places(self) -> Index:
        """Of every column among the active ones, -1 for those that are not, shape (K,)."""
        out = np.full(self.design.size, -1)
        out[self.active] = np.arange(self.active.size)
        return out

    def among(self, ids: Index) -> tuple[Index, Index]:
        """Which of some columns are active, and their places among the active ones."""
        at = self._places[ids]
        live = np.flatnonzero(at >= 0)
        return live, at[live]

    @cached_property
    def deviation(self) -> Array:
        """Prior standard deviation of every column, shape (K,)."""
        d = self.design
        scales = np.array([max(self.scale(b), NOTHING) for b in d.blocks] + [1.0])
        out = d.unit * scales[d.block_of]
        own = d.of(self.names)
        out[own] = (d.narrow if self.tails is None else self.tails)[own]
        return np.asarray(out)

    def scale(self, block: str) -> float:
        """Prior scale of a block."""
        return self.scales.get(block, 1.0)

    @cached_property
    def weights(self) -> Array:
        """Of the squared residuals, shape (E,)."""
        return np.asarray(self.kappa / self.sigma**2)

    @cached_property
    def _sums(self) -> tuple[Array, Array]:
        """Weighted X^T X and X^T r of what is offered."""
        return self.design.grams(self.offered).weighted(self.weights)

    @cached_property
    def sums(self) -> tuple[Array, Array]:
        """Weighted X^T X (n, n) and X^T r (n,) of the active columns."""
        H, h = self._sums
        return (
            (H, h) if self._use.size == h.size else (H[self._use[:, None], self._use], h[self._use])
        )

    @cached_property
    def _use(self) -> Index:
        """Places of the active columns among what is offered."""
        return np.searchsorted(self.offered, self.active)

    @property
    def _system(self) -> tuple[Array, Array]:
        """A (n, n) over the active columns, and b (n,)."""
        H, h = self.sums
        return H + np.diag(self.prior), h

    @cached_property
    def solved(self) -> tuple[Array, Array, Array]:
        """Cholesky factor of A over the active columns, their values, and b."""
        H, h = self.sums
        return *factored(H, h, self.prior), h

    @cached_property
    def prior(self) -> Array:
        """Prior precision of the active columns."""
        return np.asarray(self.deviation[self.active] ** -2.0)

    @cached_property
    def x(self) -> Array:
        """Values of all columns, shape (K,)."""
        out = np.zeros(self.design.size)
        out[self.active] = self.solved[1]
        return out

    @cached_property
    def covariance(self) -> Array:
        """Posterior covariance of the active columns."""
        if not self.active.size:  # LAPACK prints a remark of its own
            return np.zeros((0, 0))
        lower = np.tril(scipy.linalg.lapack.dpotri(self.solved[0], lower=1)[0])
        return np.asarray(lower + np.tril(lower, -1).T)

    @cached_property
    def evidence(self) -> float:
        """Its logarithm, priors of the names in it; up to a constant of the data and kappa."""
        L, x, b = self.solved
        out = 0.5 * float(b @ x) - float(np.log(np.diag(L)).sum())
        out += 0.5 * float(np.log(self.prior).sum())
        square, rows = self.design.totals
        out -= 0.5 * float(self.weights @ square) + float((self.kappa * rows) @ np.log(self.sigma))
        out += self.design.loose_cost(len(self.loose))
        own = self.design.of(self.names)
        if own.size and self.tails is not None:
            out -= float(np.log(self.tails[own] / self.design.narrow[own]).sum())
        return out + sum(self.design.cost[k] for k in self.names)

    @cached_property
    def misfit(self) -> Array:
        """Sum of squares that every equation leaves, shape (E,)."""
        grams, x = self.design.grams(self.offered), self.x[self.offered]
        left = self.design.totals[0] - 2.0 * grams.h @ x + grams.traces(np.outer(x, x))
        return np.maximum(left, 0.0)

    @cached_property
    def determined(self) -> Array:
        """Parameters that every equation determines, shape (E,)."""
        C = np.zeros((self.offered.size,) * 2)
        C[self._use[:, None], self._use] = self.covariance
        return np.asarray(self.weights * self.design.grams(self.offered).traces(C))

    @cached_property
    def worth(self) -> float:
        """Evidence and, on legs, how likely each direction of the base is by all other equations.

        A body is the same in all directions; what soft ground or a sole leaves in one is not.
        """
        out = self.evidence
        whole, right = self._system
        for k, e in enumerate(self.design.equations):
            if e.joint >= len(self.design.model.joints):
                mine, at = self.among(e.ids)
                G, h = e.total[0][mine[:, None], mine], e.total[1][mine]
                A, b = whole.copy(), right.copy()
                A[(at[:, None], at) if at.size < b.size else ...] -= self.weights[k] * G
                b[at] -= self.weights[k] * h
                np.einsum("ii->i", A)[...] *= 1.0 + _RIDGE
                x = np.linalg.solve(A, b)[at]
                left = max(float(e.total[2] - 2.0 * h @ x + x @ G @ x), 1e-300)
                out -= 0.5 * float(self.kappa[k] * e.total[3]) * float(np.log(left))
        return out

    def rise(self, other: Fit) -> float:
        """Of the evidence over another fit, as far as a base's directions agree."""
        return min(self.evidence - other.evidence, self.worth - other.worth)

    def with_prior(self, ids: Index, deviation: Array) -> float:
        """Rise of the evidence where some columns have another prior.

        Args:
            ids: Columns, all in use or of a block that is nothing, shape (n,).
            deviation: Standard deviations of their prior, shape (n,).
        """
        at = self.among(ids)[1]
        if not at.size:
            own, rest = np.searchsorted(self.offered, ids), self._use
            H, h = self._sums
            W = scipy.linalg.solve_triangular(self.solved[0], H[rest[:, None], own], lower=True)
            g = h[own] - H[own[:, None], rest] @ self.solved[1]
            S = H[own[:, None], own] - W.T @ W
            return float(_gain(S, g, deviation, deviation, self.design.signed[ids])[0])
        C, x = self.covariance[at[:, None], at], self.x[self.active[at]]
        p, q = self.prior[at], deviation**-2.0
        M = np.eye(at.size) + C * (q - p)
        change = float(x @ ((q - p) * np.linalg.solve(M, x)))
        return 0.5 * float(np.log(q / p).sum() - np.linalg.slogdet(M)[1] - change)

    @cached_property
    def against(self) -> tuple[Index, Index]:
        """Columns against their sign, and those left out for it that would have theirs."""
        x = self.solved[1]
        wrong = self.active[(x < 0.0) & ~self.design.signed[self.active]]
        if self.negative is None:
            return wrong, wrong[:0]
        out = np.flatnonzero((self.negative & self.live)[self.offered])
        H, h = self._sums
        return wrong, self.offered[out[h[out] > H[out[:, None], self._use] @ x]]

    def without(self, number: int) -> Fit:
        """The same with one name less; settle it."""
        return replace(self, names=tuple(k for k in self.names if k != number))

    @cached_property
    def _by_chunk(self) -> list[tuple[Index, Array, Array]]:
        """By equation: places among the active columns (m,), X^T X (C, m, m) and X^T r (C, m)."""
        every = [(e, *self.among(e.ids)) for e in self.design.equations]
        return [(at, *e.by_chunk(mine)) for e, mine, at in every]

    @cached_property
    def _less_chunks(self) -> tuple[Array, Array, Array]:
        """A without each chunk, scaled, its right side and the scale, each (C, n, ...)."""
        A, h = (np.tile(x, (CHUNKS, *(1,) * x.ndim)) for x in self._system)
        for w, (at, G, own) in zip(self.weights, self._by_chunk, strict=True):
            A[(slice(None), at[:, None], at) if at.size < h.shape[1] else ...] -= w * G
            h[:, at] -= w * own
        scale = np.sqrt(np.maximum(np.einsum("cii->ci", A), 1e-300))
        A /= scale[:, :, None] * scale[:, None]
        np.einsum("cii->ci", A)[...] += _RIDGE
        return A, h / scale, scale

    def lacking(self, terms: Sequence[int]) -> Fit:
        """The same where some terms are nothing; settle it."""
        omitted = self.omitted | set(self.design.of(terms).tolist())
        return replace(self, omitted=omitted)

    @cached_property
    def from_others(self) -> Array:
        """Values of all columns by estimates from all chunks but one, shape (C, K)."""
        out = np.zeros((CHUNKS, self.design.size))
        A, h, scale = self._less_chunks
        out[:, self.active] = np.linalg.solve(A, h[..., None])[..., 0] / scale
        return out

    @cached_property
    def _others(self) -> Array:
        """Covariance by all chunks but one, shape (C, n, n)."""
        A, _, scale = self._less_chunks
        return np.asarray(np.linalg.inv(A) / (scale[:, :, None] * scale[:, None]))

    @cached_property
    def _chunk_losses(self) -> Array:
        """Squares of every chunk by estimates from the others, of every equation, (C, E)."""
        out = []
        pairs = zip(self.design.equations, self._by_chunk, self._chunk_rests, strict=True)
        for e, (at, _, h), rest in pairs:
            x = self.from_others[:, self.active[at]]
            out.append(np.maximum(e.sums[1] - np.sum(x * (h + rest), axis=1), 0.0))
        return np.stack(out, axis=1)

    @cached_property
    def _chunk_rests(self) -> list[Array]:
        """By equation X^T (r - X x) of every chunk (C, m), x by estimates from the others."""
        out = []
        for at, G, h in self._by_chunk:
            x = self.from_others[:, self.active[at], None]
            out.append(h - (G @ x)[..., 0])
        return out

    def _lost(self, columns: Index, equations: Sequence[int]) -> Array:
        """Of some equations `_chunk_losses` where some active columns are nothing; scales stay.

        What other chunks make of the rest follows from the covariances at hand.
        """
        at, out = self.among(columns)[1], []
        C = self._others[:, :, at]
        v = C @ np.linalg.solve(C[:, at], self.from_others[:, columns, None])
        for k in equations:
            own, G, _ = self._by_chunk[k]
            change = (G @ v[:, own])[..., 0] + 2.0 * self._chunk_rests[k]
            out.append(self._chunk_losses[:, k] + np.sum(v[:, own, 0] * change, axis=1))
        return np.maximum(np.stack(out, axis=1), 0.0)

    def sure(self, less: Fit | Index, equations: Sequence[int]) -> tuple[float, float]:
        """How much worse another fit predicts chunks that it has not seen.

        Args:
            less: The other fit, or active columns that are nothing in it.
            equations: Of which.

        Returns:
            The sum over its standard error over chunks, and as a share of what this one leaves.
        """
        own = list(equations)
        rows = np.array([self.design.equations[k].sums[2] for k in own]).T
        mine = self._chunk_losses[:, own]
        here = less._chunk_losses[:, own] if isinstance(less, Fit) else self._lost(less, own)
        # With noise as large as what is left, so that no chunk has more say than its rows.
        noise = np.maximum(rows * self.floor[own] ** 2, 1e-300)
        d = (rows * np.log((here + noise) / (mine + noise))).sum(axis=1)
        error = float(np.sqrt(CHUNKS) * d.std(ddof=1))
        rise, left = ((x * self.weights[own]).sum() for x in (here - mine, mine))
        return float(d.sum()) / max(error, 1e-12), float(rise) / max(float(left), 1e-12)

    @cached_property
    def spread(self) -> Array:
        """Standard deviation of the values: the wider of posterior and jackknife, shape (K,)."""
        out = np.zeros(self.design.size)
        out[self.active] = np.sqrt(np.diag(self.covariance))
        jackknife = np.sqrt((CHUNKS - 1) * self.from_others.var(axis=0))
        return np.maximum(out, jackknife)

    def gains(self, offered: Sequence[int]) -> Array:
        """Rise of the evidence with each of some terms while scales and noise stay, (T,)."""
        h = self.weights @ self.design.rights
        return self._gains(offered, h)[0] + self.design.cost[list(offered)]

    def shares(self, offered: Sequence[int], columns: Index, x: Array) -> Array:
        """Of the squares of some columns at values (n,), beside this fit, what each term takes."""
        d, every = self.design, np.arange(self.design.size)
        h = d.between(self.weights, every, columns) @ x
        return 2.0 * self._gains(offered, h)[1] / self.beside(columns, x)

    def beside(self, columns: Index, x: Array) -> float:
        """Weighted squares of some columns at values (n,) that this fit does not take, at least."""
        d = self.design
        own = d.between(self.weights, columns, columns) @ x
        h = d.between(self.weights, self.active, columns) @ x
        taken = h @ scipy.linalg.cho_solve((self.solved[0], True), h)
        return max(float(x @ own - taken), 1e-300)

    def _gains(self, offered: Sequence[int], h: Array) -> Array:
        """Of a series by X^T y (K,): rise of the evidence, half of the squares taken, (2, T)."""
        d, L = self.design, self.solved[0]
        x = scipy.linalg.cho_solve((L, True), h[self.active])
        out, every = np.full((2, len(offered)), -np.inf), d.of(offered)
        where = np.full(d.size, -1)
        where[every] = np.arange(every.size)
        H = d.between(self.weights, self.active, every)
        W = scipy.linalg.solve_triangular(L, H, lower=True)
        g = h[every] - x @ H
        sizes = np.array([d.columns[k].size for k in offered], int)
        for size in np.unique(sizes):
            some = np.flatnonzero(sizes == size)
            own = np.array([d.columns[offered[k]] for k in some.tolist()])
            V = np.moveaxis(W[:, where[own]], 0, 2)
            S = d.apart(self.weights, own) - V @ V.swapaxes(1, 2)
            out[:, some] = _gain(S, g[where[own]], d.narrow[own], d.wide[own], d.signed[own])
        return out


def _gain(S: Array, g: Array, narrow: Array, wide: Array, signed: Mask) -> Array:
    """Rise of the evidence with some coordinates (..., n), and half the squares they take.

    Those against their sign are left out.
    """
    own = np.einsum("...ii->...i", S) + wide**-2.0
    size = np.clip(np.abs(g / own), narrow, wide)
    free = np.ones(g.shape, dtype=np.bool_)
    while True:
        M = np.where(free[..., None] & free[..., None, :], S, 0.0)
        np.einsum("...ii->...i", M)[...] += np.where(free, size**-2.0, 1.0)
        np.einsum("...ii->...i", M)[...] *= 1.0 + _RIDGE * free
        b = np.where(free, g, 0.0)
        x = np.linalg.solve(M, b[..., None])[..., 0]
        wrong = (x < 0.0) & ~signed
        if not wrong.any():
            break
        free &= ~wrong
    sign, volume = np.linalg.slogdet(M)
    rare = np.sum(free * np.log(size**2 / narrow), axis=-1)
    taken = 0.5 * np.sum(b * x, axis=-1)
    seen = (sign > 0) & free.any(axis=-1)
    return np.where(seen, [taken - 0.5 * volume - rare, taken], -np.inf)


def factored(H: Array, h: Array, prior: Array) -> tuple[Array, Array]:
    """Cholesky factor of H + diag(prior), and (H + diag(prior))^-1 h; scaled before it is taken."""
    A = H.copy()
    A.flat[:: len(A) + 1] += prior
    scale = np.sqrt(np.diag(A))
    A /= scale[:, None]
    A /= scale
    A.flat[:: len(A) + 1] += _RIDGE
    L = np.asarray(scale[:, None] * np.linalg.cholesky(A))
    return L, scipy.linalg.cho_solve((L, True), h, check_finite=False)


def start_fit(design: Design, floor: Array) -> Fit:
    """Blocks alone, before any update.

    Independent samples are counted on what everything together leaves: a large cause that is still
    missing has a long memory and would leave its own joint next to no sample to be found by.
    """
    scales = {b: min(0.1, _bound(design, b, frozenset())) for b in design.blocks}
    size = np.sqrt([e.total[2] / max(e.total[3], 1.0) for e in design.equations])
    kappa = np.array([independent(e.least) for e in design.equations])
    return Fit(design, floor, scales, kappa, np.maximum(np.maximum(size, 1e-12), floor))


def _bound(design: Design, block: str, loose: frozenset[str]) -> float:
    return LOOSE if block in loose else next(t.bound for t in design.terms if t.block == block)


def settled(fit: Fit, turns: int = _TURNS) -> Fit:
    """Scales, noise and signs at which the evidence is largest."""
    d = fit.design
    rows = d.totals[1]
    blocks: dict[str, list[int]] = {}
    for k, t in enumerate(d.terms):
        # The slope of a nonlinear parameter is nothing where that converged, and not known to be.
        if t.block and k not in fit.names and not isinstance(t.effect, Slope):
            blocks.setdefault(t.block, []).extend(d.columns[k].tolist())
    bounds = {b: _bound(d, b, fit.loose) for b in blocks}
    fit = replace(fit, scales={b: min(s, bounds.get(b, np.inf)) for b, s in fit.scales.items()})
    before = -np.inf
    for turn in range(turns):
        if fit.names or fit.tails is not None:
            fit = replace(fit, tails=d.tail(np.arange(d.size), fit.x) if fit.names else None)
        fit = _right_signs(fit)
        if turn in _REVIEWED:
            fit = _reviewed(fit, bounds)
        variance = np.zeros(d.size)
        variance[fit.active] = np.diag(fit.covariance)
        scales, change = dict(fit.scales), 0.0
        for b, every in blocks.items():
            ids = fit.active[fit.among(np.array(every))[1]]
            now = scales[b]
            if not ids.size or now <= NOTHING:
                continue
            u = d.unit[ids]
            told = float(np.sum(1.0 - variance[ids] / (now * u) ** 2))
            size = float(np.sum((fit.x[ids] / u) ** 2))
            ratio = np.sqrt(size / max(told, 1e-6)) / now
            # A block that is nothing approaches it slowly.
            scales[b] = float(np.clip(now * min(ratio, ratio**1.5), NOTHING, bounds[b]))
            change = max(change, abs(np.log(scales[b] / now)))
        spare = np.maximum(fit.kappa * rows - fit.determined, 0.1 * fit.kappa * rows + 1e-9)
        sigma = np.sqrt(fit.kappa * fit.misfit / spare)
        fit = replace(fit, scales=scales, sigma=np.maximum(sigma, np.maximum(fit.floor, 1e-12)))
        if change < 0.1 and abs(fit.evidence - before) < 0.1:
            break
        before = fit.evidence
    return _right_signs(fit)


def _reviewed(fit: Fit, bounds: Mapping[str, float]) -> Fit:
    """With blocks that are nothing where that is likelier, and back where it is not."""
    d = fit.design
    for b in bounds:
        now = fit.scale(b)
        trial = NOTHING if now > NOTHING else min(_REVIVED, bounds[b])
        pool = fit.offered if now <= NOTHING else fit.active
        ids = pool[d.block_of[pool] == d.blocks.index(b)]
        if trial == now or not ids.size:
            continue
        if fit.with_prior(ids, trial * d.unit[ids]) > 0.0:
            scales = {**fit.scales, b: trial}
            fit = _right_signs(replace(fit, scales=scales))
    return fit


def _right_signs(fit: Fit) -> Fit:
    """The estimate whose coordinates have their signs: those left out would come out against it."""
    if fit.negative is not None and (fit.negative & ~fit.live).any():
        fit = replace(fit, negative=fit.negative & fit.live)
    for _ in range(_EXCHANGED):  # which mostly leads to where only one set is
        wrong, back = fit.against
        if not wrong.size and not back.size:
            return fit
        negative = (
            np.zeros(fit.design.size, np.bool_) if fit.negative is None else fit.negative.copy()
        )
        negative[wrong], negative[back] = True, False
        fit = replace(fit, negative=negative)
    fit = replace(fit, negative=None)
    L, x, _ = fit.solved
    signed = fit.design.signed[fit.active]
    # Penalised squares in the others, at the best of those that may have either sign for each.
    order = np.argsort(~signed, kind="stable")
    R = np.asarray(np.linalg.qr(L.T[:, order], mode="r"))[signed.sum() :, signed.sum() :]
    size = np.linalg.norm(R, axis=0)
    values, _ = scipy.optimize.nnls(R / size, R @ x[~signed], maxiter=30 * size.size)
    negative = np.zeros(fit.design.size, np.bool_)
    negative[fit.active[~signed][values == 0.0]] = True
    return replace(fit, negative=negative)


def refreshed(fit: Fit) -> Fit:
    """With as many independent samples as the residual now has.

    A cause that is left out has a long memory, which leaves its own joint next to no sample to be
    found by, so that more is left out: the count is the geometric mean of what the fit leaves and
    of what everything that was offered leaves together.
    """
    kappa = []
    for e in fit.design.equations:
        own = e.left(fit.x)[e.chunk >= 0]
        kappa.append(np.sqrt(independent(own) * independent(e.least)))
    return replace(fit, kappa=np.array(kappa))


def independent(left: Array) -> float:
    """Independent samples per row by the autocorrelation of a series (R,)."""
    if left.size < 4 or not left.any():
        return 1.0
    n = 1 << (2 * left.size - 1).bit_length()
    f = np.fft.rfft(left, n)
    rho = np.fft.irfft(f * f.conj(), n)[: left.size]
    rho = rho / rho[0]
    pairs = rho[: rho.size // 2 * 2].reshape(-1, 2).sum(axis=1)
    ends = np.flatnonzero(pairs <= 0.0)
    positive = np.minimum.accumulate(pairs[: ends[0] if ends.size else pairs.size])
    return float(1.0 / max(2.0 * positive.sum() - 1.0, 1.0))
