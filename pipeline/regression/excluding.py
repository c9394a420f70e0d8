"""What is told and what could be in its place: a name stands only where the log excludes others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.regression.laws.extras import Extra, Kind
from pipeline.regression.laws.friction import BESIDE, QUADRANT
from pipeline.regression.statistics.gram import Columns, Key
from pipeline.regression.statistics.rivals import largest
from pipeline.regression.statistics.solve import Fit, compare
from pipeline.regression.statistics.standing import Standing

Array = NDArray[np.float64]
#: As large as this, per what is told, what is not told would make it another law.
OTHER = 0.25
#: Terms that make a law of friction another one.
LAWS = ("coulomb", "viscous", "quadratic", "load", QUADRANT, "saturating@0", "stribeck@2", "offset")
#: Friction per load in two quadrants, of which others are sums.
_BOTH = ("driving", "driven", "motor")
#: What torque at one joint may be in place of another of them.
BESIDES = (Kind.SPRING, Kind.ZERO, Kind.GAIN, Kind.LATE)


class Excluding(Standing):
    """How large rivals could be."""

    def _excluding(self, keys: Sequence[Key], sizes: Mapping[Key, float]) -> frozenset[Key]:
        """Columns beside which every rival is known to be small."""
        offered = self.options.extras & set(BESIDES)
        have = {e.same for e in self.extras}
        rivals = [
            Extra(kind, j)
            for kind in BESIDES
            for j in range(self.model.nv)
            if kind in offered and (kind, j) not in have
        ]
        felt, actions = self._acting([(e, 1) for e in rivals])
        rivals = [e for e, _ in felt]
        columns = self._columns(self.couplings)
        columns = replace(columns, shared={**columns.shared, **actions})
        fit = self._fit(self._system(columns), columns, self.sigma)
        t = self._quantile(self.options.coverage)

        def small(told: float, others: list[Key]) -> bool:
            if not others:
                return True
            sizes = largest(fit, self.weight, keys, others, t)
            return all(
                x * _effect(columns, k) < OTHER * told for k, x in zip(others, sizes, strict=True)
            )

        def beside(joint: int, but: Kind | None) -> list[Key]:
            return [
                ("shared", n)
                for e in rivals
                if e.joint == joint and e.kind is not but
                for n in e.names
            ]

        out: set[Key] = set()
        for j in range(self.model.nv):
            mine = [k for k in keys if k[0] == str(j)]
            law = [k for k in mine if k[1] not in BESIDE]
            parts = [sizes[k] * columns.local[j][k[1]] for k in law]
            told = _rms(np.sum(parts, axis=0)) if parts else 0.0
            terms = {k[1].partition("@")[0] for k in mine}
            gone = {"load", QUADRANT} if terms & set(_BOTH) else set()
            others = [u for u in LAWS if u.partition("@")[0] not in terms | gone]
            if small(told, [(str(j), u) for u in others]):
                out.update(law)
            for key in mine:
                zero = key[1] == "offset"
                spring = [k for k in beside(j, None) if k[1].startswith(Kind.SPRING)]
                if key[1] in BESIDE and (not zero or small(abs(sizes[key]), spring)):
                    out.add(key)
        have_all = fit.losses(self.folds, self.weight, fit.columns(keys))
        for e in self.extras:
            own = [("shared", n) for n in e.names]
            rest = [k for k in keys if k not in own]
            joints = {j for n in e.names for j in self.actions[n]}
            instead = [k for j in joints for k in beside(j, e.kind)]
            if not any(self._as_good(fit, have_all, [*rest, k]) for k in instead):
                out.update(own)
        out.update(k for k in keys if k[0] == "shared" and k[1] not in self.actions)
        return frozenset(out)

    def _as_good(self, fit: Fit, have: Array, keys: Sequence[Key]) -> bool:
        """Whether other columns predict as well, within one standard error."""
        worse, error = compare(
            fit.losses(self.folds, self.weight, fit.columns(keys)), have, self.weight
        )
        return worse <= error


def _effect(columns: Columns, key: Key) -> float:
    """Torque of a column of size one, root mean square over the joints it acts on."""
    place, term = key
    if place != "shared":
        return _rms(columns.local[int(place)][term])
    return float(np.sqrt(sum(_rms(x) ** 2 for x in columns.shared[term].values())))


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(np.square(x))))
