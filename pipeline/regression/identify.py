"""Rigid bodies, friction of every joint and couplings of a machine with a fixed base, together.

The order of a good engineer: the richest model first, whose residual is the noise; couplings and
the refit of bodies beside friction of any shape; then for every joint the simplest law that
predicts blocks it did not see as well as any; what does not stand is dropped and the rest fitted
anew; sizes with intervals from leaving out blocks; shares from drawing blocks anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pinocchio as pin

from pipeline.regression.laws.extras import Kind
from pipeline.regression.laws.friction import BESIDE
from pipeline.regression.options import Options
from pipeline.regression.preprocess import Rows
from pipeline.regression.reporting import Reporting
from pipeline.regression.result import Level, Result, Term
from pipeline.regression.statistics.noise import Span

__all__ = ["Options", "identify"]


def identify(
    rows: Rows,
    model: pin.Model,
    *,
    blocks: Sequence[Span] | None = None,
    options: Options | None = None,
) -> Result:
    """Identify a machine from its training rows.

    Args:
        rows: Training rows; nothing else is looked at.
        model: By the URDF; its joints in the order of the rows' columns.
        blocks: Stretches that are drawn and left out together, such as whole cycles; found from the
            correlation of the noise by default.
        options: Error rates.

    Raises:
        RegressionError: Joints do not match, or there are too few blocks.
    """
    return _Identification(rows, model, blocks, options or Options()).run()


class _Identification(Reporting):
    """One identification."""

    def run(self) -> Result:
        """All stages in order."""
        self._rich(colours=False)
        self._rich(colours=True)
        self._couple()
        self._rich(colours=True)
        self._block(max(c.correlation for c in self.noise))
        self._rich(colours=True)
        self._strengths()
        self._rise()
        self._rich(colours=True)
        self._search(self.options.extras)
        out: list[Term] = []
        while True:
            self._strengths()
            self._laws()
            result = self._finish()
            fallen = [e.extra for e in result.extras if e.level is Level.SUSPECTED]
            new = self._bar(result)
            if not fallen and not new:
                terms = self._without_claims(result)
                told = {(t.place, t.term) for t in terms}
                left = [t for t in out if (t.place, t.term) not in told]
                return replace(result, terms=(*terms, *left))
            out += [replace(t, level=Level.SUSPECTED) for t in new]
            if fallen:
                self._without(fallen)

    def _bar(self, result: Result) -> list[Term]:
        """Allow no longer what does not stand; what is told again all the same is no news."""
        instead = self.bodies_instead if result.refit else self.barred
        new = []
        for terms, barred in (
            (self._unsure(result), instead),
            (self._unlikely(result), self.barred),
        ):
            for t in terms:
                key = (str(self.names.index(t.place)), t.term)
                if key not in barred:
                    barred.add(key)
                    new.append(t)
        return new

    def _unsure(self, result: Result) -> list[Term]:
        """Offsets and rotor inertias that do not stand: beside bodies they name no friction."""
        sprung = {self.names[e.joint] for e in self.extras if e.kind is Kind.SPRING}
        beside = [
            t
            for t in result.terms
            if t.term in BESIDE and not (t.term == "offset" and t.place in sprung)
        ]
        claims = [(str(self.names.index(t.place)), t.term) for t in beside]
        stands = self._beside_any_bodies(claims, self._keys())
        bent = self._bent(self._keys()) if beside and self.options.extras else set()
        return [
            t
            for t, (j, _), good in zip(beside, claims, stands, strict=True)
            # Where the URDF's bodies are kept they are no rival.
            if t.closes < (self.options.needed if result.refit else self.options.worth)
            and (
                t.level is Level.APPROXIMATE or not good or (t.term == "offset" and int(j) in bent)
            )
        ]

    def _without_claims(self, result: Result) -> list[Term]:
        """Terms, of which offsets and rotor inertias that bodies could be are approximate."""
        beside = [t for t in result.terms if t.term in BESIDE]
        claims = [(str(self.names.index(t.place)), t.term) for t in beside]
        stands = self._beside_any_bodies(claims, self._keys())
        claimed = {id(t) for t, good in zip(beside, stands, strict=True) if not good}
        return [
            replace(t, level=Level.APPROXIMATE)
            if id(t) in claimed and t.level is Level.CONFIRMED
            else t
            for t in result.terms
        ]

    def _unlikely(self, result: Result) -> list[Term]:
        """Terms of friction that most draws do without and that close little, or may be nothing."""
        out = []
        for t in result.terms:
            if t.level is not Level.APPROXIMATE or t.place not in self.names:
                continue
            little = t.closes < self.options.worth
            rare = t.share < 0.5 and t.closes < self.options.needed
            if (t.term not in BESIDE and (little or rare)) or t.low <= 0.0 <= t.high:
                out.append(t)
        return out

    def _finish(self) -> Result:
        suspected: list[Term] = []
        for last in (False, True):  # the load is of the bodies as they come out
            columns = self._columns(self.couplings)
            fit = self._fit(self._system(columns), columns, self.sigma)
            keys, x, replicas = self._stand(fit, self._keys())
            if last:
                while small := self._small(fit, keys, x, replicas):
                    suspected += [t for _, t in small]
                    gone = [k for k, _ in small]
                    keys, x, replicas = self._stand(fit, [k for k in keys if k not in gone])
            self.load = self.design.load(x[: fit.n_bodies])
            self.sizes = dict(zip(fit.system.keys, x, strict=True))
        shares, laws = self._shares(fit)
        return self._result(fit, keys, x, replicas, shares, laws, suspected)
