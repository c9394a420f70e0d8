"""What stands: sizes that hold no zero and close something, with what blocks left out say."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.regression.laws.bodies import consistent
from pipeline.regression.laws.friction import (
    BESIDE,
    LAW,
    SIGNED,
    kind,
    unit,
)
from pipeline.regression.result import Level, Term
from pipeline.regression.statistics.choosing import Choosing
from pipeline.regression.statistics.gram import Key
from pipeline.regression.statistics.jackknife import standard_error
from pipeline.regression.statistics.selection import UNNAMED, choose_laws, possible
from pipeline.regression.statistics.solve import Fit, compare

Array = NDArray[np.float64]


class Standing(Choosing):
    """Backward steps, final sizes and shares."""

    def _stand(self, fit: Fit, keys: list[Key]) -> tuple[list[Key], Array, Array]:
        """Drop, fit with bodies that are bodies, and drop what has the wrong sign then."""
        keys = self._drop(fit, keys)
        while True:
            x, replicas = self._final(fit, keys)
            where = fit.system.where
            wrong = [k for k in keys if not self._curve(k) and not possible(k[1], x[where[k]])]
            if not wrong:
                return keys, x, replicas
            keys = [k for k in keys if k not in wrong]

    def _drop(self, fit: Fit, keys: list[Key]) -> list[Key]:
        """Backward: leave out what has the wrong sign, holds zero or predicts nothing."""
        keys = self._even(fit, keys)
        while True:
            at = fit.columns(keys)
            n = len(at) - len(keys)
            full = fit.solve(self.weight, at)[n:]
            error = standard_error(np.array([fit.solve(w, at)[n:] for w in self._leave_one_out()]))
            t = self._quantile(self.options.coverage)
            weakest: tuple[float, Key] | None = None
            for key, size, e in zip(keys, full, error, strict=True):
                if self._curve(key):
                    continue
                ratio = abs(size) / max(e, 1e-300)
                if size < 0 and key[1] not in SIGNED:
                    ratio = -ratio
                if ratio <= t and (weakest is None or ratio < weakest[0]):
                    weakest = (ratio, key)
            if weakest is None:
                return keys
            keys.remove(weakest[1])

    def _even(self, fit: Fit, keys: Sequence[Key]) -> list[Key]:
        """Friction per load that is no other while driving than while driven is one share."""
        keys = list(keys)
        for j in range(self.model.nv):
            pair = [(str(j), "driving"), (str(j), "driven")]
            if not all(k in keys for k in pair):
                continue
            at = fit.columns(keys)
            mine = [len(at) - len(keys) + keys.index(k) for k in pair]
            more, less = fit.solve(self.weight, at)[mine]
            drawn = np.array([fit.solve(w, at)[mine] for w in self._leave_one_out()])
            error = float(standard_error(drawn[:, 0] - drawn[:, 1]))
            if abs(more - less) <= self._quantile(self.options.coverage) * error:
                keys = [k for k in keys if k not in pair] + [(str(j), "load")]
        return keys

    def _final(self, fit: Fit, keys: Sequence[Key]) -> tuple[Array, Array]:
        """Sizes of all columns with bodies that are bodies, and the same without each block."""
        at = fit.columns(keys)

        def solved(weight: Array, start: Array | None) -> Array:
            x = fit.known.copy()
            if not fit.prior.refit:
                x[at] = fit.solve(weight, at)
                return x
            used = np.concatenate([np.arange(fit.n_bodies), fit.system.index(keys)])
            gram, moment = fit.normal(weight, used.astype(np.intp))
            nb = fit.n_bodies
            gram[:nb, :nb] -= fit.prior_gram[:nb, :nb]
            moment[:nb] -= fit.prior_moment[:nb]
            free = np.isin(used, at)
            gram[~free], gram[:, ~free], moment[~free] = 0.0, 0.0, 0.0
            first = None if start is None else np.where(free, start[used], 0.0)
            y = consistent(gram, moment, self.bodies, self.sigma, first)
            x[used] = np.where(free, y, 0.0) + fit.known[used]
            return x

        x = solved(self.weight, None)
        return x, np.array([solved(w, x) for w in self._leave_one_out()])

    def _closing(self, fit: Fit, keys: Sequence[Key]) -> dict[Key, tuple[float, float]]:
        """What every named column closes, and by how many standard errors."""
        with_all = fit.losses(self.folds, self.weight, fit.columns(keys))
        out = {}
        for key in keys:
            if self._curve(key):
                continue
            rest = [other for other in keys if other != key]
            without = fit.losses(self.folds, self.weight, fit.columns(rest))
            mean, error = compare(without, with_all, self.weight)
            part = self._part(fit, key)
            out[key] = (mean * len(self.blocks) / part, mean / max(error, 1e-300))
        return out

    def _part(self, fit: Fit, key: Key) -> float:
        """Whitened power of the noise of the joints that a column acts on."""
        if key[0] == "shared":
            c = next(c for c in self.couplings if key[1] in c.names)
            joints = 2 if c.motor != c.other else 1
        else:
            joints = 1
        return 0.5 * float(fit.system.rows.sum()) / self.model.nv * joints

    def _told(self, fit: Fit, key: Key, x: Array) -> bool:
        """Whether a term of friction takes more than a model of the rest holds to, `LAW`."""
        place, term = key
        if place == "shared" or term in BESIDE:
            return True
        column = self._columns(self.couplings).local[int(place)][term]
        size = abs(float(x[fit.system.where[key]])) * float(np.sqrt((column**2).mean()))
        torque = self.rows.tau[:, int(place)]
        return size > LAW * float(np.sqrt((torque**2).mean()))

    def _small(
        self, fit: Fit, keys: Sequence[Key], x: Array, replicas: Array
    ) -> list[tuple[Key, Term]]:
        """The least of every joint's columns that closes next to nothing on validation blocks."""
        error, t = standard_error(replicas), self._quantile(self.options.coverage)
        least: dict[str, tuple[float, Key]] = {}
        for key, (closes, gain) in self._closing(fit, keys).items():
            if gain > 0 and closes > self.options.closes and self._told(fit, key, x):
                continue
            if key[0] not in least or closes < least[key[0]][0]:
                least[key[0]] = (closes, key)
        out = []
        for closes, key in least.values():
            value, e = float(x[fit.system.where[key]]), float(error[fit.system.where[key]])
            term = Term(
                self._place(key),
                kind(key[1]),
                key[1],
                value,
                value - t * e,
                value + t * e,
                unit(key[1]),
                0.0,
                closes,
                Level.SUSPECTED,
            )
            out.append((key, term))
        return out

    def _drawn_couplings(self, fit: Fit, weight: Array) -> None:
        """Count a coupling's terms where this draw predicts worse without them by an error."""
        keys = self._keys()
        if not self.couplings:
            return
        have = fit.losses(self.folds, weight, fit.columns(keys))
        for c in self.couplings:
            for name in c.names:
                rest = [k for k in keys if k != ("shared", name)]
                without = fit.losses(self.folds, weight, fit.columns(rest))
                mean, error = compare(without, have, weight)
                self.coupled[name] = self.coupled.get(name, 0.0) + float(mean > error)

    def _shares(self, fit: Fit) -> tuple[list[dict[str, float]], list[float]]:
        """How often every kind and every law is chosen when blocks are drawn anew."""
        rng = np.random.default_rng(self.options.seed)
        n = len(self.blocks)
        kinds: list[dict[str, float]] = [{} for _ in range(self.model.nv)]
        laws = [0.0] * self.model.nv
        done = 0
        self.coupled = {}
        barred = self.barred | (self.bodies_instead if fit.prior.refit else set())
        for _ in range(self.options.draws):
            weight = np.bincount(rng.integers(0, n, n), minlength=n).astype(float)
            drawn = choose_laws(fit, self.folds, weight, self.choices, self._shared, 1, barred)
            done += 1
            for j, c in enumerate(drawn):
                laws[j] += c.law.name == self.choices[j].law.name
                # The general member holds every term: what has a name next to it has the vote.
                law = c.best if c.law is UNNAMED else c.law
                for k in {kind(t) for t in (*(law.terms if law else ()), *c.beside)}:
                    kinds[j][k] = kinds[j].get(k, 0.0) + 1.0
            self._drawn_couplings(fit, weight)
        done = max(done, 1)
        self.coupled = {name: x / done for name, x in self.coupled.items()}
        return [{k: x / done for k, x in d.items()} for d in kinds], [x / done for x in laws]
