"""Least squares on sums of blocks: training on some, predictive loss on others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.linalg
import scipy.stats
from numpy.typing import NDArray

from pipeline.regression.laws.bodies import Bodies
from pipeline.regression.statistics.gram import Key, System

Array = NDArray[np.float64]

#: Numerical ridge per diagonal element.
RIDGE: Final = 1e-10


@dataclass(frozen=True)
class Prior:
    """What is known before the log.

    Attributes:
        bodies: Of the URDF.
        sigma: Its uncertainty; 0 keeps the URDF's bodies.
        precision: Of every column that is no body: sizes are of the order of the torque, (P,).
    """

    bodies: Bodies
    sigma: float
    precision: Array

    @property
    def refit(self) -> bool:
        """Whether bodies may change."""
        return self.sigma > 0

    def terms(self, n: int) -> tuple[Array, Array]:
        """Addition to gram (P, P) and moment (P,) of a system whose first columns are bodies."""
        gram, moment = np.diag(self.precision), np.zeros(n)
        nb = self.bodies.nominal.size
        if self.refit:
            gram[:nb, :nb] += self.bodies.metric / self.sigma**2
            moment[:nb] += self.bodies.metric @ self.bodies.centre / self.sigma**2
        return gram, moment


class Fit:
    """Regressions of one system under one prior.

    Bodies that may not change are moved to the target, so that every other method sees columns
    that are all free.
    """

    def __init__(self, system: System, prior: Prior) -> None:
        self.system, self.prior = system, prior
        nb = prior.bodies.nominal.size
        self.n_bodies = nb
        fixed = ~prior.bodies.columns if prior.refit else np.ones(nb, dtype=bool)
        known = np.zeros(len(system.keys))
        known[:nb] = np.where(fixed, prior.bodies.nominal, 0.0)
        self.known = known
        self.free_bodies = np.flatnonzero(~fixed)
        effect = system.gram @ known  # (B, P)
        self.moment = system.moment - effect
        self.power = system.power - 2 * system.moment @ known + effect @ known
        gram, moment = prior.terms(len(system.keys))
        self.prior_gram, self.prior_moment = gram, moment - gram @ known * 0.0

    def columns(self, keys: Sequence[Key]) -> NDArray[np.intp]:
        """Columns of the free bodies and of keys."""
        return np.concatenate([self.free_bodies, self.system.index(keys)]).astype(np.intp)

    def normal(self, weight: Array, at: NDArray[np.intp]) -> tuple[Array, Array]:
        """Normal equations of weighted blocks on some columns."""
        used = np.flatnonzero(weight)
        gram = np.einsum("b,bij->ij", weight[used], self.system.gram[np.ix_(used, at, at)])
        return (
            gram + self.prior_gram[np.ix_(at, at)],
            weight[used] @ self.moment[np.ix_(used, at)] + self.prior_moment[at],
        )

    def solve(self, weight: Array, at: NDArray[np.intp]) -> Array:
        """Sizes on columns `at`."""
        gram, moment = self.normal(weight, at)
        return solve(gram, moment)

    def loss(self, block: int, at: NDArray[np.intp], x: Array) -> float:
        """Half the sum of squares of a block's whitened residual."""
        g = self.system.gram[block][np.ix_(at, at)]
        return 0.5 * float(x @ g @ x - 2 * x @ self.moment[block][at] + self.power[block])

    def losses(
        self, folds: Sequence[NDArray[np.intp]], weight: Array, at: NDArray[np.intp]
    ) -> Array:
        """Predictive loss of every block, fitted on the blocks of other folds, (B,)."""
        out = np.zeros(len(weight))
        for fold in folds:
            train = weight.copy()
            train[fold] = 0.0
            x = self.solve(train, at)
            for b in fold:
                if weight[b]:
                    out[b] = self.loss(int(b), at, x)
        return out


def solve(gram: Array, moment: Array) -> Array:
    """Solve symmetric equations of any scale, least norm where they are singular."""
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    scaled = gram / np.outer(scale, scale)
    scaled[np.diag_indices_from(scaled)] += RIDGE
    try:
        factor = scipy.linalg.cho_factor(scaled, check_finite=False)
        out: Array = scipy.linalg.cho_solve(factor, moment / scale, check_finite=False) / scale
    except np.linalg.LinAlgError:
        out = scipy.linalg.lstsq(scaled, moment / scale, cond=1e-10)[0] / scale
    return out


class Eliminated:
    """Predictive losses of many small sets of columns beside one large common set.

    The common columns are eliminated once per fold; a set then costs the size of itself.
    """

    def __init__(
        self,
        fit: Fit,
        folds: Sequence[NDArray[np.intp]],
        weight: Array,
        common: NDArray[np.intp],
        own: NDArray[np.intp],
    ) -> None:
        self.weight = weight
        self.folds = [f[weight[f] > 0] for f in folds]
        n = len(common)
        both = np.concatenate([common, own])
        self.train: list[tuple[Array, Array]] = []
        self.quadratic = np.zeros((len(weight), len(own), len(own)))
        self.linear = np.zeros((len(weight), len(own)))
        self.constant = np.zeros(len(weight))
        total_gram, total_moment = fit.normal(weight, both)
        for fold in [*self.folds, np.zeros(0, dtype=np.intp)]:
            gram, moment = total_gram.copy(), total_moment.copy()
            for b in fold:
                gram -= weight[b] * fit.system.gram[b][np.ix_(both, both)]
                moment -= weight[b] * fit.moment[b][both]
            scale = np.sqrt(np.maximum(np.diag(gram)[:n], 1e-300))
            block = gram[:n, :n] / np.outer(scale, scale)
            block[np.diag_indices(n)] += RIDGE
            right = np.column_stack([gram[:n, n:], moment[:n]]) / scale[:, None]
            try:
                factor = scipy.linalg.cho_factor(block, check_finite=False)
                k = scipy.linalg.cho_solve(factor, right, check_finite=False) / scale[:, None]
            except np.linalg.LinAlgError:
                k = scipy.linalg.lstsq(block, right, cond=1e-10)[0] / scale[:, None]
            schur = gram[n:, n:] - gram[n:, :n] @ k[:, :-1]
            self.train.append((0.5 * (schur + schur.T), moment[n:] - gram[n:, :n] @ k[:, -1]))
            for b in fold:
                g, c = fit.system.gram[b][np.ix_(both, both)], fit.moment[b][both]
                t = np.vstack([-k[:, :-1], np.eye(len(own))])
                t0 = np.concatenate([k[:, -1], np.zeros(len(own))])
                gt = g @ t
                self.quadratic[b] = t.T @ gt
                self.linear[b] = t0 @ gt - c @ t
                self.constant[b] = t0 @ g @ t0 - 2 * c @ t0 + fit.power[b]

    def sizes(self, use: Sequence[int]) -> Array:
        """Sizes of a set, fitted on all blocks."""
        schur, right = self.train[-1]
        at = np.asarray(use, dtype=np.intp)
        return solve(schur[np.ix_(at, at)], right[at]) if len(at) else np.zeros(0)

    def mixed(self, mix: Array) -> Array:
        """Predictive loss of every block for combinations of own columns, (own, K), (B,)."""
        out = np.zeros(len(self.weight))
        for fold, (schur, right) in zip(self.folds, self.train[:-1], strict=True):
            x = mix @ solve(mix.T @ schur @ mix, mix.T @ right)
            out[fold] = 0.5 * (self.quadratic[fold] @ x @ x + 2 * self.linear[fold] @ x)
            out[fold] += 0.5 * self.constant[fold]
        return out

    def mixed_sizes(self, mix: Array) -> Array:
        """Sizes of combinations of own columns, fitted on all blocks, (K,)."""
        schur, right = self.train[-1]
        return solve(mix.T @ schur @ mix, mix.T @ right)

    def losses(self, use: Sequence[int]) -> Array:
        """Predictive loss of every block for a set of own columns, (B,)."""
        at = np.asarray(use, dtype=np.intp)
        out = np.zeros(len(self.weight))
        for fold, (schur, right) in zip(self.folds, self.train[:-1], strict=True):
            if len(at) == 0:
                out[fold] = 0.5 * self.constant[fold]
                continue
            x = solve(schur[np.ix_(at, at)], right[at])
            q = self.quadratic[np.ix_(fold, at, at)]
            out[fold] = 0.5 * (q @ x @ x + 2 * self.linear[np.ix_(fold, at)] @ x)
            out[fold] += 0.5 * self.constant[fold]
        return out


def compare(first: Array, second: Array, weight: Array) -> tuple[float, float]:
    """Mean of first - second over weighted blocks and its standard error."""
    n = float(weight.sum())
    d = first - second
    mean = float(weight @ d) / n
    variance = float(weight @ (d - mean) ** 2) / max(n - 1.0, 1.0)
    return mean, float(np.sqrt(variance / n))


def beyond_chance(first: Array, second: Array, rate: float) -> bool:
    """Whether losses of blocks are less in the second, by their sizes or by their ranks.

    A model that explains little fails at a few blocks by far more than at the rest: then the mean
    has no error to speak of, and ranks tell more (Wilcoxon, Biometrics Bulletin 1, 1945).

    Args:
        first: (B,).
        second: (B,).
        rate: At which either says so by chance, half of it each.
    """
    gain, error = compare(first, second, np.ones(len(first)))
    if gain > float(scipy.stats.t.isf(rate / 2, max(len(first) - 1, 1))) * error:
        return True
    ranks = scipy.stats.wilcoxon(first - second, alternative="greater")
    return bool(gain > 0 and ranks.pvalue < rate / 2)
