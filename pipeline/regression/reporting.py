"""From sizes and shares to findings with levels and the table of base parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.stats
from numpy.typing import NDArray

from pipeline.regression.excluding import Excluding
from pipeline.regression.laws.base_parameters import base_set
from pipeline.regression.laws.bodies import with_parameters
from pipeline.regression.laws.extras import TOLERATED, Kind, orders
from pipeline.regression.laws.friction import (
    BESIDE,
    LAW,
    SIGNED,
    STRIBECK_SPEEDS,
    kind,
    name_of,
    unit,
)
from pipeline.regression.result import BaseParameter, Beside, Friction, Level, Result, Term
from pipeline.regression.statistics.gram import Key
from pipeline.regression.statistics.jackknife import standard_error
from pipeline.regression.statistics.selection import (
    UNNAMED,
)
from pipeline.regression.statistics.solve import Fit, compare

Array = NDArray[np.float64]


class Reporting(Excluding):
    """Findings."""

    def _result(
        self,
        fit: Fit,
        keys: Sequence[Key],
        x: Array,
        replicas: Array,
        shares: Sequence[dict[str, float]],
        laws: Sequence[float],
        suspected: Sequence[Term],
    ) -> Result:
        t, error = self._quantile(self.options.coverage), self._errors(fit, keys, x, replicas)
        moved = self._exclude(keys, dict(zip(fit.system.keys, x, strict=True)))
        at = fit.system.index(keys)
        error[at] = np.hypot(error[at], 0.5 * moved)
        terms = self._terms(fit, keys, x, error, shares)
        frictions = [self._friction(j, fit, keys, x, terms, laws[j]) for j in range(len(laws))]
        base, condition, lost = self._base(x, replicas, t)
        nb = fit.n_bodies
        return Result(
            with_parameters(self.model, x[:nb]) if self.sigma > 0 else self.model.copy(),
            self.sigma > 0,
            self.sigma,
            base,
            condition,
            lost,
            (*terms, *suspected),
            tuple(frictions),
            tuple(self.couplings),
            self._besides(fit, keys, x, replicas, error),
            {key: float(x[fit.system.where[key]]) for key in keys},
            {key: float(t * error[fit.system.where[key]]) for key in keys},
            x[:nb],
            self._bodies_spread(fit, keys),
            self._bodies_scatter(replicas[:, :nb]),
            self._bodies_half(fit, keys, error, t),
            self.refit_share,
            tuple(self.noise),
            self.rows.cutoff,
            len(self.blocks),
            self.rows.sigma_v,
            self.rows.rate,
            1.0 + self.gain,
            frozenset(self._structured),
            self.loaded,
        )

    def _terms(
        self,
        fit: Fit,
        keys: Sequence[Key],
        x: Array,
        error: Array,
        shares: Sequence[dict[str, float]],
    ) -> list[Term]:
        """Every size with a name, with its level."""
        o, t = self.options, self._quantile(self.options.coverage)
        strict = self._quantile(1 - o.error_rate / max(len(keys), 1))
        terms = []
        for key, (closes, gain) in self._closing(fit, keys).items():
            place, term = key
            k = fit.system.where[key]
            share, short = self.coupled.get(term, 0.0), 0.0
            if place != "shared":
                share = shares[int(place)].get(kind(term), 0.0)
                short = self.choices[int(place)].short
            stands = (
                abs(x[k]) > strict * error[k]
                and share >= o.sure
                and short <= 1.0
                and gain > 1.0
                and closes > o.closes
                and (x[k] > 0 or term in SIGNED)
                and self._confirms([int(place)] if place != "shared" else [])
                and key in self.excluded
            )
            level = Level.CONFIRMED if stands else Level.APPROXIMATE
            terms.append(
                Term(
                    self._place(key),
                    kind(term),
                    term,
                    float(x[k]),
                    float(x[k] - t * error[k]),
                    float(x[k] + t * error[k]),
                    unit(term),
                    share,
                    closes,
                    level,
                )
            )
        return terms

    def _errors(self, fit: Fit, keys: Sequence[Key], x: Array, replicas: Array) -> Array:
        """Standard errors of all sizes, (P,).

        The scatter over blocks, at least what the curvature of the fit allows (the URDF's
        uncertainty is in it, which no block knows); what another Stribeck speed would make of a
        size; and that no law of a textbook holds better than `LAW`.
        """
        out = standard_error(replicas)
        gram, _ = fit.normal(self.weight, fit.columns(keys))
        scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        inverse = np.linalg.pinv(gram / np.outer(scale, scale), rcond=1e-12, hermitian=True)
        own = np.sqrt(np.maximum(np.diag(inverse), 0.0)) / scale
        at = fit.system.index(keys)
        out[at] = np.maximum(out[at], own[-len(keys) :] if keys else own[:0])
        out[at] = np.hypot(np.hypot(out[at], self._shape_errors(fit, keys)), LAW * np.abs(x[at]))
        return out

    def _shape_errors(self, fit: Fit, keys: Sequence[Key]) -> Array:
        """Half of what sizes change by at the next Stribeck speeds, (K,)."""
        out = np.zeros(len(keys))
        base = fit.solve(self.weight, fit.columns(keys))[-len(keys) :] if keys else out
        for place, term in keys:
            kind_, _, number = term.partition("@")
            if kind_ != "stribeck" or self._curve((place, term)):
                continue
            for k in (int(number) - 1, int(number) + 1):
                if 0 <= k < len(STRIBECK_SPEEDS):
                    other = [
                        (p, f"stribeck@{k}") if (p, u) == (place, term) else (p, u) for p, u in keys
                    ]
                    size = fit.solve(self.weight, fit.columns(other))[-len(keys) :]
                    mine = np.array([p == place for p, _ in keys])
                    out = np.maximum(out, 0.5 * np.abs(size - base) * mine)
        return out

    def _besides(
        self, fit: Fit, keys: Sequence[Key], x: Array, replicas: Array, error: Array
    ) -> tuple[Beside, ...]:
        """Every extra with its level: what chance or a rival may be is suspected."""
        o, bent = self.options, self._bent(keys) if self.extras else set()
        blocks = len(self.blocks)
        have = fit.losses(self.folds, self.weight, fit.columns(keys))
        out = []
        for e in self.extras:
            at = fit.system.index(self._of(e))
            rest = [k for k in keys if k not in self._of(e)]
            without = fit.losses(self.folds, self.weight, fit.columns(rest))
            mean, doubt = compare(without, have, self.weight)
            joints = [j for n in e.names for j in self.actions[n]]
            closes = mean * blocks / self._noise_power(fit, joints)
            spread = np.cov(replicas[:, at].T) * (blocks - 1) ** 2 / blocks
            size = float(x[at] @ np.linalg.pinv(np.atleast_2d(spread)) @ x[at]) / len(at)
            chance = float(scipy.stats.f.sf(size, len(at), max(blocks - len(at), 1)))
            if e.kind is Kind.RIPPLE:  # its order is the best of many
                chance *= max(orders(self.rows, e.joint).size, 1)
            won, level = self.won[e], Level.SUSPECTED
            if mean > doubt and closes > o.worth and chance < 1.0 - o.coverage:
                level = Level.APPROXIMATE
                known = closes > o.stands and chance < o.error_rate / max(len(keys), 1)
                if won.share >= o.sure and known:
                    level = Level.CONFIRMED
            half = self._quantile(o.coverage) * error[at]
            if abs(x[at][0]) - half[0] < TOLERATED.get(e.kind, -np.inf):
                level = Level.SUSPECTED
            doubted = e.joint in bent or self._harmonic(e) or not self._confirms(joints)
            doubted = doubted or not self.excluded.issuperset(self._of(e))
            if level is Level.CONFIRMED and doubted:
                level = Level.APPROXIMATE
            out.append(Beside(e, x[at], half, won.share, won.rivals, closes, level))
        return tuple(out)

    def _friction(
        self,
        j: int,
        fit: Fit,
        keys: Sequence[Key],
        x: Array,
        terms: Sequence[Term],
        drawn: float,
    ) -> Friction:
        """Friction of one joint, whose law was drawn in a share of draws."""
        choice = self.choices[j]
        have = tuple(key[1] for key in keys if key[0] == str(j) and key[1] not in BESIDE)
        mine = [u for u in terms if u.place == self.names[j] and u.term not in BESIDE]
        unnamed = choice.law is UNNAMED
        sure = not unnamed and all(u.level is Level.CONFIRMED for u in mine)
        named = min((u.share for u in mine), default=drawn)
        return Friction(
            self.names[j],
            UNNAMED.name if unnamed else name_of(have),
            {u: float(x[fit.system.where[(str(j), u)]]) for u in have},
            self.design.shapes[j],
            drawn if unnamed else named,
            Level.CONFIRMED if sure else Level.APPROXIMATE,
            choice.short,
        )

    def _bodies_scatter(self, replicas: Array) -> Array:
        """Covariance of body parameters by leaving out blocks (B, 10 B), (10 B, 10 B).

        With as many degrees of freedom as there are blocks, a normal one that covers as much.
        """
        b = len(replicas)
        off = replicas - replicas.mean(axis=0)
        wide = self._quantile(self.options.coverage) / scipy.stats.norm.ppf(0.975)
        return np.asarray(off.T @ off * ((b - 1) / b) * wide**2)

    def _bodies_spread(self, fit: Fit, keys: Sequence[Key]) -> Array:
        """Covariance of body parameters by the curvature of the fit, (10 B, 10 B)."""
        nb = fit.n_bodies
        out = np.zeros((nb, nb))
        if not fit.prior.refit:
            return out
        gram, _ = fit.normal(self.weight, fit.columns(keys))
        scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        inverse = np.linalg.pinv(gram / np.outer(scale, scale), rcond=1e-12, hermitian=True)
        count = len(fit.free_bodies)
        own = inverse[:count, :count] / np.outer(scale[:count], scale[:count])
        out[np.ix_(fit.free_bodies, fit.free_bodies)] = own
        return out

    def _bodies_half(self, fit: Fit, keys: Sequence[Key], error: Array, t: float) -> Array:
        """Half of the intervals of body parameters, (10 B,).

        What the motion does not tell does not scatter from block to block either: there the
        uncertainty of the URDF counts, as far as the log leaves it (the curvature of the fit).
        """
        nb = fit.n_bodies
        if not fit.prior.refit:
            return np.zeros(nb)
        own = np.sqrt(np.maximum(np.diag(self._bodies_spread(fit, keys)), 0.0))
        return np.asarray(np.maximum(t * error[:nb], scipy.stats.norm.ppf(0.975) * own))

    def _base(
        self, x: Array, replicas: Array, t: float
    ) -> tuple[tuple[BaseParameter, ...], float, tuple[str, ...]]:
        if self.sigma == 0:
            return (), float("nan"), ()
        found = base_set(self.design.bodies, self.bodies, self.names)
        nb = self.bodies.nominal.size
        value, urdf = found.combine @ x[:nb], found.combine @ self.bodies.nominal
        error = standard_error(replicas[:, :nb] @ found.combine.T)
        free = np.flatnonzero(self.bodies.columns)
        spread = np.linalg.inv(self.bodies.metric[np.ix_(free, free)]) * self.sigma**2
        stated = np.sqrt(
            np.einsum("ki,ij,kj->k", found.combine[:, free], spread, found.combine[:, free])
        )
        table = tuple(
            BaseParameter(
                name,
                float(u),
                float(v),
                float(v - t * e),
                float(v + t * e),
                one,
                float((v - u) / s),
            )
            for name, one, u, v, e, s in zip(
                found.names, found.units, urdf, value, error, stated, strict=True
            )
        )
        return table, found.condition, found.lost
