"""One bounded regression of the supply's power on terms, compared by what it predicts.

Rows lie in blocks of consecutive samples. Some blocks are for the test alone. Of the others each is
predicted by a fit to the rest; a term is taken in where that predicts better, by Wilcoxon's
signed-rank test over blocks at 5 % over all terms tried (Bonferroni), and by 5 % of the error at
least. Terms that may stand in another's place without predicting worse by the same test are
reported with it. Intervals are those of a bootstrap of blocks (Künsch 1989, Annals of Statistics
17(3)).

Under a supply's current its voltage falls (Plett, Battery Management Systems I, section 2.3):

    V = V0 - R I - a t
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from scipy.stats import wilcoxon

from actuators.arrays import Array, Mask
from pipeline.identification.supply.samples import Samples
from pipeline.identification.supply.terms import Rows, Term

LEVEL: Final = 0.05
#: Share of the root mean square error by which a prediction has to be better.
LITTLE: Final = 0.05
#: Share of the mean power that no meter at a supply distinguishes from nothing.
METER: Final = 1e-3
#: Blocks a log is cut into, and the fewest samples of one.
BLOCKS: Final = 24
SMALLEST: Final = 2
#: Every so many blocks one is for the test.
PROVES: Final = 4
#: Fits that leave blocks out, and draws of the bootstrap.
FOLDS: Final = 6
DRAWS: Final = 300
#: Of what bootstraps draw.
SEED: Final = 1


@dataclass(frozen=True, eq=False)
class Problem:
    """Rows that estimate and choose, and terms that may be taken in."""

    rows: Rows  #: Without test rows.
    block: NDArray[np.intp]  #: Of each of them, shape (K,).
    terms: tuple[Term, ...]  #: All of them.

    def fit(self, names: Sequence[str], kept: NDArray[np.intp] | slice = slice(None)) -> Array:
        """Coefficients of some terms by some rows, (T,)."""
        if not names:
            return np.zeros(0)
        by_name = {t.name: t for t in self.terms}
        x = np.stack([self.rows.columns[n][kept] for n in names], axis=1)
        y = (self.rows.power - self.rows.predicted)[kept]
        size = np.linalg.norm(x, axis=0)
        size[size == 0.0] = 1.0
        low = np.array([by_name[n].low for n in names]) * size
        high = np.array([by_name[n].high for n in names]) * size
        return np.asarray(lsq_linear(x / size, y, (low, high), method="bvls").x / size)

    def ahead(self, names: Sequence[str]) -> Array:
        """Squared error of each block as predicted by the others, (B,) [W^2]."""
        left = self.rows.power - self.rows.predicted
        for fold in range(FOLDS):
            out = np.flatnonzero(self.block % FOLDS == fold)
            rest = np.flatnonzero(self.block % FOLDS != fold)
            for name, c in zip(names, self.fit(names, rest), strict=True):
                left[out] -= c * self.rows.columns[name][out]
        return self._by_block(left)

    def ahead_of_sum(self, kind: str) -> Array:
        """The same for motor currents times the supply's voltage taken as the power."""
        x, y = self.rows.summed[kind], self.rows.power
        left = np.empty_like(y)
        for fold in range(FOLDS):
            out, rest = self.block % FOLDS == fold, self.block % FOLDS != fold
            scale = float(x[rest] @ y[rest]) / float(x[rest] @ x[rest])
            left[out] = y[out] - scale * x[out]
        return self._by_block(left)

    def _by_block(self, left: Array) -> Array:
        _, number = np.unique(self.block, return_inverse=True)
        return np.asarray(np.bincount(number, left**2) / np.bincount(number))


def better(new: Array, old: Array, tried: int = 1) -> bool:
    """Whether squared errors of blocks are smaller than others, by more than chance and little.

    One-sided, at 5 % over all tried. Where a motion repeats, so do the model's own errors, and what
    is no better in truth is a little better in every block.
    """
    if not new.mean() < (1.0 - LITTLE) ** 2 * old.mean():
        return False
    return bool(wilcoxon(old, new, alternative="greater").pvalue < LEVEL / tried)


def choose(problem: Problem) -> tuple[str, ...]:
    """Names of the terms that predict better than without, in the order they were taken in."""
    every = [t.name for t in problem.terms]
    chosen: list[str] = []
    before, least = problem.ahead(chosen), (METER * problem.rows.power.mean()) ** 2
    while before.mean() > least and (rest := [n for n in every if n not in chosen]):
        tried = {n: problem.ahead([*chosen, n]) for n in rest}
        best = min(tried, key=lambda n: float(tried[n].mean()))
        if not better(tried[best], before, len(rest)):
            break
        chosen.append(best)
        # Each term is replaced by another as long as that predicts better on average.
        before = tried[best]
        for _ in range(len(problem.terms)):
            found = None
            for k in range(len(chosen) - 1):
                for other in (t.name for t in problem.terms if t.name not in chosen):
                    new = [*chosen[:k], other, *chosen[k + 1 :]]
                    own = problem.ahead(new)
                    if own.mean() < before.mean() * (1.0 - 1e-9):
                        found, before = new, own
            if found is None:
                break
            chosen = found
    return tuple(chosen)


def rivals_of(problem: Problem, chosen: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Terms that may stand in a chosen one's place without predicting worse."""
    error = problem.ahead(chosen)
    out = {}
    for k, name in enumerate(chosen):
        others = [t.name for t in problem.terms if t.name not in chosen]
        alike = [
            o
            for o in others
            if not better(error, problem.ahead([*chosen[:k], o, *chosen[k + 1 :]]))
        ]
        out[name] = tuple(alike)
    return out


def drawn_coefficients(problem: Problem, chosen: Sequence[str]) -> Array:
    """Coefficients by blocks drawn with replacement, (DRAWS, T)."""
    rng = np.random.default_rng(SEED)
    rows = [np.flatnonzero(problem.block == b) for b in np.unique(problem.block)]
    out = np.empty((DRAWS, len(chosen)))
    for d in range(DRAWS):
        kept = np.concatenate([rows[b] for b in rng.integers(0, len(rows), len(rows))])
        out[d] = problem.fit(chosen, kept)
    return out


def intervals(
    problem: Problem, chosen: Sequence[str], draws: Array, rivals: Mapping[str, Sequence[str]]
) -> dict[str, tuple[float, float]]:
    """95 % intervals of coefficients, whichever of the terms that do as well is in the sum.

    Args:
        problem: Rows and terms.
        chosen: Terms.
        draws: Their coefficients, shape (DRAWS, T).
        rivals: Of each of them: with one in its place the others have other coefficients.
    """
    sets: list[tuple[int | None, Array]] = [(None, draws)]
    for k, name in enumerate(chosen):
        for other in rivals[name]:
            exchanged = [*chosen[:k], other, *chosen[k + 1 :]]
            sets.append((k, drawn_coefficients(problem, exchanged)))
    out = {}
    for k, name in enumerate(chosen):
        ends = [np.quantile(d[:, k], [0.025, 0.975]) for out_of, d in sets if out_of != k]
        out[name] = float(min(e[0] for e in ends)), float(max(e[1] for e in ends))
    return out


def blocks_of(rows: Rows, holdout: int, prove_last: float | None) -> tuple[NDArray[np.intp], Mask]:
    """Number of each row's block, (K,), and whether it is for the test, (K,).

    Args:
        rows: Of all logs.
        holdout: Logs at the end of the list that are for the test.
        prove_last: Share at the end of every other log that is for the test instead of blocks in
            between.
    """
    block, proves = np.empty(len(rows), dtype=np.intp), np.zeros(len(rows), dtype=np.bool_)
    logs, first = int(rows.log.max()) + 1, 0
    for k in range(logs):
        own = np.flatnonzero(rows.log == k)
        count = max(1, min(BLOCKS, own.size // SMALLEST))
        place = np.arange(own.size) * count // max(1, own.size)
        block[own] = first + place
        if k >= logs - holdout:
            proves[own] = True
        elif prove_last is not None:
            proves[own] = np.arange(own.size) >= (1.0 - prove_last) * own.size
        elif not holdout:
            proves[own] = place % PROVES == PROVES - 1
        first += count
    return block, proves


@dataclass(frozen=True)
class Sag:
    """A supply's resistance with its 95 % interval, and how it shows."""

    resistance: float  #: [ohm].
    low: float  #: Lower end [ohm].
    high: float  #: Upper end [ohm].
    voltage: float  #: Without current, at the first sample [V].
    #: Mean power that the resistance turns into heat before the voltage is measured [W].
    lost: float


def sag_of(samples: Sequence[Samples]) -> Sag | None:
    """The supply's resistance; None where voltage and current were not both measured.

    Each log has a voltage without current and a slope in time of its own: a battery runs down.
    """
    if not all(s.measured and np.isfinite(s.current).all() for s in samples):
        return None
    x, y, block = [], [], []
    for k, s in enumerate(samples):
        own = np.zeros((s.end.size, 1 + 2 * len(samples)))
        own[:, 0] = -s.current
        own[:, 1 + 2 * k], own[:, 2 + 2 * k] = 1.0, s.end - s.end[0]
        x.append(own)
        y.append(s.voltage)
        count = max(1, min(BLOCKS, s.end.size // SMALLEST))
        block.append(k * BLOCKS + np.arange(s.end.size) * count // s.end.size)
    design, volts, number = np.concatenate(x), np.concatenate(y), np.concatenate(block)
    current = -design[:, 0]
    if np.ptp(current) == 0.0:
        return None
    found = np.linalg.lstsq(design, volts, rcond=None)[0]
    rows = [np.flatnonzero(number == b) for b in np.unique(number)]
    rng = np.random.default_rng(SEED)
    draws = []
    for _ in range(DRAWS):
        kept = np.concatenate([rows[b] for b in rng.integers(0, len(rows), len(rows))])
        draws.append(np.linalg.lstsq(design[kept], volts[kept], rcond=None)[0][0])
    low, high = np.quantile(draws, [0.025, 0.975])
    lost = float(found[0] * np.mean(current**2))
    return Sag(float(found[0]), float(low), float(high), float(found[1]), lost)
